/* An FMI 3.0 unit that is not ours: Y[i][j] = gain[i] u[j], n its steps, a binary, a text; ends at t_end when asked. */
#include <stdlib.h>
#include <string.h>
#include "fmi3Functions.h"

typedef struct { double time, t_end, gain[2], u[3], y[2][3]; int64_t n; int on; } Unit;

const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String place, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    Unit *unit = calloc(1, sizeof(Unit));
    unit->t_end = 1e9; unit->gain[0] = 1.0; unit->gain[1] = 2.0; unit->u[0] = 0.5; unit->u[1] = 0.25; unit->u[2] = -1.5;
    return unit;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
static void outputs(Unit *unit) { for (int i = 0; i < 2; i++) for (int j = 0; j < 3; j++) unit->y[i][j] = unit->gain[i] * unit->u[j]; }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 t, fmi3Float64 start, fmi3Boolean sd, fmi3Float64 s) { return fmi3OK; }
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { outputs(c); return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
static double *place(Unit *unit, fmi3ValueReference r, size_t *n) {
    switch (r) {
        case 1: *n = 1; return &unit->t_end;
        case 2: *n = 2; return unit->gain;
        case 3: *n = 3; return unit->u;
        case 4: *n = 6; return &unit->y[0][0];
        default: *n = 0; return NULL;
    }
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t nv) {
    size_t at = 0, k;
    outputs(c);
    for (size_t i = 0; i < n; i++) {
        double *from = place(c, r[i], &k);
        if (!from || at + k > nv) return fmi3Error;
        memcpy(v + at, from, k * sizeof(double));
        at += k;
    }
    return at == nv ? fmi3OK : fmi3Error;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t nv) {
    size_t at = 0, k;
    for (size_t i = 0; i < n; i++) {
        double *to = place(c, r[i], &k);
        if (!to || at + k > nv) return fmi3Error;
        memcpy(to, v + at, k * sizeof(double));
        at += k;
    }
    return at == nv ? fmi3OK : fmi3Error;
}
fmi3Status fmi3GetInt64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Int64 v[], size_t nv) { v[0] = ((Unit *)c)->n; return fmi3OK; }
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Boolean v[], size_t nv) { v[0] = ((Unit *)c)->n % 2; return fmi3OK; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no, fmi3Boolean *event,
    fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    Unit *unit = c;
    unit->n++;
    *event = *early = 0;
    *reached = unit->time = time + step;
    *terminate = unit->time >= unit->t_end - 1e-9;
    return fmi3OK;
}
