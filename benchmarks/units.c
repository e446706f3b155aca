/* Units written by hand for FMI 2.0, as little as a host needs: the functions of a simulation, no check, no message.
 *
 * Compiled once for each model, with COLEMAN_HODGDON or LUGRE defined. Value references are those of our FMUs:
 * parameters, then inputs, then outputs.
 */
#include <math.h>
#include <stdlib.h>

#ifdef COLEMAN_HODGDON /* MSSP 2015 Eqs (9), (10a): c, beta, alpha, x_0, x_h_0; x_in; x_out, x_h */
enum { INPUT = 5, OUTPUT = 6 };
#else                  /* AME 2020 Eq (40): sigma0, sigma1, sigma2, F_c, F_s, v_s; v; F, P_loss */
enum { INPUT = 6, OUTPUT = 7 };
#endif

typedef struct {
    double values[OUTPUT + 2];
    double state, before;
} Unit;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *place, const void *host, int seen, int logging)
{
    (void)name, (void)type, (void)guid, (void)place, (void)host, (void)seen, (void)logging;
    return calloc(1, sizeof(Unit));
}

int fmi2SetupExperiment(void *c, int defined, double tolerance, double start, int stops, double stop)
{
    (void)c, (void)defined, (void)tolerance, (void)start, (void)stops, (void)stop;
    return 0;
}

int fmi2EnterInitializationMode(void *c) { (void)c; return 0; }
int fmi2Terminate(void *c) { (void)c; return 0; }
void fmi2FreeInstance(void *c) { free(c); }

int fmi2ExitInitializationMode(void *c)
{
    Unit *unit = c;
#ifdef COLEMAN_HODGDON
    unit->state = unit->values[4];
    unit->before = unit->values[INPUT];
#endif
    return unit == NULL;
}

int fmi2SetReal(void *c, const unsigned *references, size_t n, const double *values)
{
    size_t k;
    for (k = 0; k < n; k++) ((Unit *)c)->values[references[k]] = values[k];
    return 0;
}

int fmi2GetReal(void *c, const unsigned *references, size_t n, double *values)
{
    size_t k;
    for (k = 0; k < n; k++) values[k] = ((const Unit *)c)->values[references[k]];
    return 0;
}

int fmi2DoStep(void *c, double time, double step, int keep)
{
    Unit *unit = c;
    const double *p = unit->values;
    const double u = p[INPUT];
    double *y = unit->values + OUTPUT;
    (void)time, (void)step, (void)keep;
#ifdef COLEMAN_HODGDON
    {
        const double c_ = p[0], beta = p[1], alpha = p[2], dx = u - unit->before;
        if (dx != 0.0) {
            const double asymptote = copysign(beta / alpha, beta * dx);
            unit->state = asymptote + (unit->state - asymptote) * exp(-alpha * fabs(dx));
        }
        unit->before = u;
        y[0] = c_ * u + unit->state + p[3];
        y[1] = unit->state;
    }
#else
    {
        const double sigma0 = p[0], r = u / p[5], s = (p[3] + (p[4] - p[3]) * exp(-r * r)) / sigma0;
        double z = unit->state;
        if (u != 0.0) {
            const double steady = copysign(s, u);
            z = steady + (z - steady) * exp(-fabs(u) * step / s);
        }
        unit->state = z;
        y[0] = sigma0 * z + p[1] * (u - fabs(u) * z / s) + p[2] * u;
        y[1] = y[0] * u;
    }
#endif
    return 0;
}

/* FMPy looks for all functions when it loads a library. */
#define NONE(name) int fmi2##name(void) { return 3; }
NONE(GetTypesPlatform) NONE(GetVersion) NONE(SetDebugLogging) NONE(Reset) NONE(GetInteger) NONE(GetBoolean) NONE(GetString)
NONE(SetInteger) NONE(SetBoolean) NONE(SetString) NONE(GetFMUstate) NONE(SetFMUstate) NONE(FreeFMUstate)
NONE(SerializedFMUstateSize) NONE(SerializeFMUstate) NONE(DeSerializeFMUstate) NONE(GetDirectionalDerivative)
NONE(SetRealInputDerivatives) NONE(GetRealOutputDerivatives) NONE(CancelStep) NONE(GetStatus) NONE(GetRealStatus)
NONE(GetIntegerStatus) NONE(GetBooleanStatus) NONE(GetStringStatus)
