/* FMI 2.0 for co-simulation: the functions that FMI 3.0 has otherwise; values and step are in fmi2_step.c. */
#include "fmi2Functions.h"
#include "slave.h"

#include <string.h>

#define FMI(x) fmi2##x
#define Instance fmi2Component
#define FmuState fmi2FMUstate
#define GET_STATE fmi2GetFMUstate
#define SET_STATE fmi2SetFMUstate
#define FREE_STATE fmi2FreeFMUstate
#define STATE_SIZE fmi2SerializedFMUstateSize
#define SERIALIZE fmi2SerializeFMUstate
#define DESERIALIZE fmi2DeSerializeFMUstate
#include "fmi_alike.h"

static void log_message(const Slave *slave, Status status, const char *category, const char *text)
{
    const fmi2CallbackFunctions *host = slave->callback;
    if (host->logger != NULL) {  /* the text as the format, as hosts that are not in C do not read "%s" */
        host->logger(host->componentEnvironment, slave->name, (fmi2Status)status, category,
            strchr(text, '%') == NULL ? text : "%s", text);
    }
}

/* ---- versions */

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
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

/* ---- status */

fmi2Status fmi2CancelStep(fmi2Component c)
{
    ALLOWED(RUNNING, fmi2CancelStep);
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
