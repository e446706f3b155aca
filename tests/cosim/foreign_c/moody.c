/* An FMI 2.0 unit that is not ours: y = k u at each step, and moods that other people's units have.

mood 1: a discarded step that ends the simulation at t_end (as Stair of the Reference-FMUs)
mood 2: a discarded step without more
mood 3: the code exits the process at t_end     mood 4: it accesses memory that is not its own
mood 5: it never returns from the step   mood 6: as 4, when it is terminated
An instance with the name "crash" or "hang" does so while it is made.
fmi2SetupExperiment puts all variables to their defaults, as 20-sim does. */
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"

typedef struct { double real[4]; int mood; int positive; double reached; int ended; } Unit; /* k, t_end, u, y */

static void defaults(Unit *unit) { double start[4] = {1.0, 0.5, 0.0, 0.0}; memcpy(unit->real, start, sizeof start); unit->mood = 0; }

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String place,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Unit *unit = calloc(1, sizeof(Unit));
    if (strcmp(name, "crash") == 0) *(volatile int *)8 = 1;
    while (strcmp(name, "hang") == 0) {}
    defaults(unit);
    return unit;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) { return fmi2OK; }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real start, fmi2Boolean sd, fmi2Real s) {
    defaults(c);
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { if (((Unit *)c)->mood == 6) *(volatile int *)8 = 1; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { defaults(c); return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
    for (size_t i = 0; i < n; i++) v[i] = ((Unit *)c)->real[r[i]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
    for (size_t i = 0; i < n; i++) ((Unit *)c)->real[r[i]] = v[i];
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]) {
    for (size_t i = 0; i < n; i++) v[i] = ((Unit *)c)->mood;
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer v[]) {
    for (size_t i = 0; i < n; i++) ((Unit *)c)->mood = v[i];
    return fmi2OK;
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean v[]) {
    for (size_t i = 0; i < n; i++) v[i] = ((Unit *)c)->positive;
    return fmi2OK;
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean v[]) { return fmi2Error; }
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]) { return fmi2Error; }
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[]) { return fmi2Error; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no) {
    Unit *unit = c;
    if (unit->mood && unit->mood != 6 && time + step > unit->real[1]) {
        if (unit->mood == 1) { unit->ended = 1; unit->reached = unit->real[1]; unit->real[3] = -7.25; }
        if (unit->mood == 3) exit(7);
        if (unit->mood == 4) *(volatile int *)8 = 1;
        while (unit->mood == 5) {}
        return fmi2Discard;
    }
    unit->real[3] = unit->real[0] * unit->real[2];
    unit->positive = unit->real[3] > 0.0;
    return fmi2OK;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *v) { *v = ((Unit *)c)->ended; return fmi2OK; }
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *v) { *v = ((Unit *)c)->reached; return fmi2OK; }
