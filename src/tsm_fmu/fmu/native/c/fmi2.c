/* FMI 2.0 for co-simulation, all functions. */
#include "fmi2Functions.h"
#include "slave.h"

#include <string.h>

#define ALLOWED(modes, function) \
    do { if (slave_refuses(c, modes, #function)) return fmi2Error; } while (0)
#define NOT_NULL(argument, function) \
    do { if ((argument) == NULL) return (fmi2Status)slave_null(c, #function, #argument); } while (0)

static void log_message(const Slave *slave, Status status, const char *category, const char *text)
{
    const fmi2CallbackFunctions *host = slave->callback;
    if (host->logger != NULL) {  /* the text as the format, as hosts that are not in C do not read "%s" */
        host->logger(host->componentEnvironment, slave->name, (fmi2Status)status, category,
            strchr(text, '%') == NULL ? text : "%s", text);
    }
}

/* ---- versions, logging */

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[])
{
    size_t k;
    ALLOWED(ANY_MODE, fmi2SetDebugLogging);
    for (k = 0; k < nCategories; k++) {
        if (categories == NULL || categories[k] == NULL || strncmp(categories[k], "log", 3) != 0) {
            return (fmi2Status)slave_unsupported(c, "fmi2SetDebugLogging", "expected categories of the model description");
        }
    }
    ((Slave *)c)->logging = loggingOn != fmi2False;
    return fmi2OK;
}

/* ---- life cycle */

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String fmuResourceLocation,
    const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation, (void)visible;
    if (functions == NULL) {
        return NULL;
    }
    if (fmuType != fmi2CoSimulation) {
        if (functions->logger != NULL) {
            functions->logger(functions->componentEnvironment, instanceName, fmi2Error, "logStatusError",
                MODEL_NAME ": model exchange -- expected co-simulation -- import it as a slave");
        }
        return NULL;
    }
    return slave_new(instanceName, fmuGUID, loggingOn != fmi2False, log_message, NULL, (void *)functions);
}

void fmi2FreeInstance(fmi2Component c)
{
    slave_free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
    fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    ALLOWED(INSTANTIATED, fmi2SetupExperiment);
    return (fmi2Status)slave_setup(c, startTime);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    ALLOWED(INSTANTIATED, fmi2EnterInitializationMode);
    return (fmi2Status)slave_enter_initialization(c);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    ALLOWED(INITIALIZATION, fmi2ExitInitializationMode);
    return (fmi2Status)slave_exit_initialization(c);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    ALLOWED(STEPPING, fmi2Terminate);
    ((Slave *)c)->memory.mode = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    ALLOWED(ANY_MODE, fmi2Reset);
    slave_reset(c);
    return fmi2OK;
}

/* ---- values */

#define VALUES(Name, KIND, Type) \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, Type value[]) \
    { \
        return (fmi2Status)slave_read(c, "fmi2Get" #Name, KIND, vr, nvr, value, nvr); \
    } \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const Type value[]) \
    { \
        return (fmi2Status)slave_write(c, "fmi2Set" #Name, KIND, vr, nvr, value, nvr); \
    }

VALUES(Real, REAL, fmi2Real)
VALUES(Integer, INTEGER, fmi2Integer)
VALUES(Boolean, NO_KIND, fmi2Boolean)
VALUES(String, NO_KIND, fmi2String)

/* ---- FMU states */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    ALLOWED(ANY_MODE, fmi2GetFMUstate);
    NOT_NULL(FMUstate, fmi2GetFMUstate);
    *FMUstate = slave_copy(c, *FMUstate);
    return *FMUstate == NULL ? fmi2Error : fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    ALLOWED(ANY_MODE, fmi2SetFMUstate);
    NOT_NULL(FMUstate, fmi2SetFMUstate);
    ((Slave *)c)->memory = *(const Memory *)FMUstate;
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    ALLOWED(ANY_MODE, fmi2FreeFMUstate);
    if (FMUstate != NULL) {
        free(*FMUstate);
        *FMUstate = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    ALLOWED(ANY_MODE, fmi2SerializedFMUstateSize);
    NOT_NULL(FMUstate, fmi2SerializedFMUstateSize);
    NOT_NULL(size, fmi2SerializedFMUstateSize);
    *size = slave_serialized_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    ALLOWED(ANY_MODE, fmi2SerializeFMUstate);
    NOT_NULL(FMUstate, fmi2SerializeFMUstate);
    NOT_NULL(serializedState, fmi2SerializeFMUstate);
    return (fmi2Status)slave_serialize(c, FMUstate, (unsigned char *)serializedState, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate)
{
    ALLOWED(ANY_MODE, fmi2DeSerializeFMUstate);
    NOT_NULL(serializedState, fmi2DeSerializeFMUstate);
    NOT_NULL(FMUstate, fmi2DeSerializeFMUstate);
    *FMUstate = slave_deserialize(c, (const unsigned char *)serializedState, size);
    return *FMUstate == NULL ? fmi2Error : fmi2OK;
}

/* ---- derivatives */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
    const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    return (fmi2Status)slave_derivative(c, "fmi2GetDirectionalDerivative", vUnknown_ref, nUnknown, vKnown_ref, nKnown,
        dvKnown, nKnown, dvUnknown, nUnknown);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
    const fmi2Real value[])
{
    (void)vr, (void)order, (void)value;
    ALLOWED(WRITABLE, fmi2SetRealInputDerivatives);
    return nvr == 0 ? fmi2OK : (fmi2Status)slave_unsupported(c, "fmi2SetRealInputDerivatives", "inputs hold over a step");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
    fmi2Real value[])
{
    (void)vr, (void)order, (void)value;
    ALLOWED(READABLE, fmi2GetRealOutputDerivatives);
    return nvr == 0 ? fmi2OK : (fmi2Status)slave_unsupported(c, "fmi2GetRealOutputDerivatives", "outputs have none over time");
}

/* ---- step */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
    fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return (fmi2Status)slave_step(c, "fmi2DoStep", currentCommunicationPoint, communicationStepSize);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    ALLOWED(STEPPING, fmi2CancelStep);
    return (fmi2Status)slave_unsupported(c, "fmi2CancelStep", "steps are not asynchronous");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    (void)s, (void)value;
    ALLOWED(READABLE, fmi2GetStatus);
    return (fmi2Status)slave_unsupported(c, "fmi2GetStatus", "steps are not asynchronous");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    ALLOWED(READABLE, fmi2GetRealStatus);
    NOT_NULL(value, fmi2GetRealStatus);
    if (s != fmi2LastSuccessfulTime) {
        return (fmi2Status)slave_unsupported(c, "fmi2GetRealStatus", "expected fmi2LastSuccessfulTime");
    }
    *value = ((Slave *)c)->memory.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    (void)s, (void)value;
    ALLOWED(READABLE, fmi2GetIntegerStatus);
    return (fmi2Status)slave_unsupported(c, "fmi2GetIntegerStatus", "no status is an integer");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    ALLOWED(READABLE, fmi2GetBooleanStatus);
    NOT_NULL(value, fmi2GetBooleanStatus);
    if (s != fmi2Terminated) {
        return (fmi2Status)slave_unsupported(c, "fmi2GetBooleanStatus", "expected fmi2Terminated");
    }
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    (void)s, (void)value;
    ALLOWED(READABLE, fmi2GetStringStatus);
    return (fmi2Status)slave_unsupported(c, "fmi2GetStringStatus", "steps are not asynchronous");
}
