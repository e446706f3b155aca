/* An FMI 2.0 unit that is not ours and gives its derivatives: a' = w, w' = -9.81 sin a - 0.3 w + 2 u, h = cos a + 0.5 f. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"

typedef struct { double x[7]; } Unit; /* a, w, der(a), der(w), u, f, h */

static void refresh(double *x)
{
    x[2] = x[1];
    x[3] = -9.81 * sin(x[0]) - 0.3 * x[1] + 2.0 * x[4];
    x[6] = cos(x[0]) + 0.5 * x[5];
}
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String place,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Unit *unit = calloc(1, sizeof(Unit));
    unit->x[0] = 0.4;
    return unit;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real start, fmi2Boolean sd, fmi2Real s) { return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    refresh(((Unit *)c)->x);
    for (size_t i = 0; i < n; i++) v[i] = ((Unit *)c)->x[r[i]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    for (size_t i = 0; i < n; i++) ((Unit *)c)->x[r[i]] = v[i];
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no) {
    double *x = ((Unit *)c)->x;
    for (int k = 0; k < 200; k++) {
        x[1] += step / 200 * (-9.81 * sin(x[0]) - 0.3 * x[1] + 2.0 * x[4]);
        x[0] += step / 200 * x[1];
    }
    return fmi2OK;
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference z[], size_t nz, const fmi2ValueReference v[],
                                        size_t nv, const fmi2Real dv[], fmi2Real dz[]) {
    double d[7] = {0}, *x = ((Unit *)c)->x;
    for (size_t i = 0; i < nv; i++) d[v[i]] += dv[i];
    d[2] = d[1];
    d[3] = -9.81 * cos(x[0]) * d[0] - 0.3 * d[1] + 2.0 * d[4];
    d[6] = -sin(x[0]) * d[0] + 0.5 * d[5];
    for (size_t i = 0; i < nz; i++) dz[i] = d[z[i]];
    return fmi2OK;
}
