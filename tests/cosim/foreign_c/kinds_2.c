/* An FMI 2.0 unit that is not ours, with a variable of each kind that goes in and one that comes out. */
#include "fmi2Functions.h"
#include "kinds.h"

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String place,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) { return kinds(); }
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) { return fmi2OK; }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real start, fmi2Boolean sd, fmi2Real s) { return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { Kinds *new = kinds(); *(Kinds *)c = *new; free(new); return fmi2OK; }
static double *real(Kinds *k, fmi2ValueReference r) { return r == 0 ? &k->load : r == 1 ? &k->speed : &k->rate; }
static long long *integer(Kinds *k, fmi2ValueReference r) { return r == 0 ? &k->ask : r == 1 ? &k->count : r == 2 ? &k->mode : &k->gear; }
static int *boolean(Kinds *k, fmi2ValueReference r) { return r == 0 ? &k->held : &k->over; }
#define EACH(get) for (size_t i = 0; i < n; i++) get; return fmi2OK;
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) { EACH(v[i] = *real(c, r[i])) }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) { EACH(*real(c, r[i]) = v[i]) }
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]) { EACH(v[i] = (fmi2Integer)*integer(c, r[i])) }
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer v[]) { EACH(*integer(c, r[i]) = v[i]) }
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean v[]) { EACH(v[i] = *boolean(c, r[i])) }
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean v[]) { EACH(*boolean(c, r[i]) = v[i] != 0) }
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]) { EACH(v[i] = r[i] ? ((Kinds *)c)->answer : ((Kinds *)c)->call) }
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[]) { EACH(kinds_text(c, v[i])) }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no) { kinds_step(c, step); return fmi2OK; }
