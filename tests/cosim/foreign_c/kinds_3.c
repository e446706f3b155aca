/* The FMI 3.0 twin of kinds_2.c: Float32 in, Float64 out, integers of 16 and 32 bits, 64 for Enumerations. */
#include "fmi3Functions.h"
#include "kinds.h"

const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String place, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) { return kinds(); }
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 t, fmi3Float64 start, fmi3Boolean sd, fmi3Float64 s) { return fmi3OK; }
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
#define K ((Kinds *)c)
#define EACH(get) for (size_t i = 0; i < n; i++) get; return fmi3OK;
#define OF(type) fmi3Instance c, const fmi3ValueReference r[], size_t n, type v[], size_t nv
fmi3Status fmi3GetFloat64(OF(fmi3Float64)) { EACH(v[i] = r[i] == 2 ? K->speed : K->rate) }
fmi3Status fmi3SetFloat64(OF(const fmi3Float64)) { EACH(*(r[i] == 2 ? &K->speed : &K->rate) = v[i]) }
fmi3Status fmi3GetFloat32(OF(fmi3Float32)) { EACH(v[i] = (fmi3Float32)K->load) }
fmi3Status fmi3SetFloat32(OF(const fmi3Float32)) { EACH(K->load = v[i]) }
fmi3Status fmi3GetInt16(OF(fmi3Int16)) { EACH(v[i] = (fmi3Int16)K->ask) }
fmi3Status fmi3SetInt16(OF(const fmi3Int16)) { EACH(K->ask = v[i]) }
fmi3Status fmi3GetInt32(OF(fmi3Int32)) { EACH(v[i] = (fmi3Int32)K->count) }
fmi3Status fmi3GetInt64(OF(fmi3Int64)) { EACH(v[i] = r[i] == 6 ? K->mode : K->gear) }
fmi3Status fmi3SetInt64(OF(const fmi3Int64)) { EACH(K->mode = v[i]) }
fmi3Status fmi3GetBoolean(OF(fmi3Boolean)) { EACH(v[i] = r[i] == 8 ? K->held : K->over) }
fmi3Status fmi3SetBoolean(OF(const fmi3Boolean)) { EACH(K->held = v[i]) }
fmi3Status fmi3GetString(OF(fmi3String)) { EACH(v[i] = r[i] == 10 ? K->call : K->answer) }
fmi3Status fmi3SetString(OF(const fmi3String)) { EACH(kinds_text(K, v[i])) }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no, fmi3Boolean *event,
    fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    kinds_step(c, step);
    *event = *terminate = *early = 0;
    *reached = time + step;
    return fmi3OK;
}
