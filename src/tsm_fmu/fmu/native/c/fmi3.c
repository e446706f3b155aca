/* FMI 3.0 for co-simulation: the functions that FMI 2.0 has otherwise; values and step are in fmi3_step.c, what a unit
 * without events, clocks and structural parameters does not have in fmi3_absent.c. */
#include "fmi3Functions.h"
#include "slave.h"

#include <string.h>

#define FMI(x) fmi3##x
#define Instance fmi3Instance
#define FmuState fmi3FMUState
#define GET_STATE fmi3GetFMUState
#define SET_STATE fmi3SetFMUState
#define FREE_STATE fmi3FreeFMUState
#define STATE_SIZE fmi3SerializedFMUStateSize
#define SERIALIZE fmi3SerializeFMUState
#define DESERIALIZE fmi3DeserializeFMUState
#include "fmi_alike.h"

typedef union {
    fmi3LogMessageCallback function;
    void *address;
} LogMessage;

static void log_message(const Slave *slave, Status status, const char *category, const char *text)
{
    LogMessage host;
    host.address = slave->callback;
    if (host.function != NULL) {
        host.function(slave->environment, (fmi3Status)status, category, text);
    }
}

/* ---- version */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

/* ---- life cycle */

static fmi3Instance no_instance(fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage, const char *text)
{
    if (logMessage != NULL) {
        logMessage(environment, fmi3Error, "logStatusError", text);
    }
    return NULL;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
    const fmi3ValueReference requiredIntermediateVariables[], size_t nRequiredIntermediateVariables,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3IntermediateUpdateCallback intermediateUpdate)
{
    LogMessage host;
    (void)resourcePath, (void)visible, (void)earlyReturnAllowed, (void)requiredIntermediateVariables;
    (void)intermediateUpdate;
    if (eventModeUsed || nRequiredIntermediateVariables > 0) {
        return no_instance(instanceEnvironment, logMessage,
            MODEL_NAME ": event mode or intermediate variables -- expected neither -- read the model description");
    }
    host.function = logMessage;
    return slave_new(instanceName, instantiationToken, loggingOn, log_message, instanceEnvironment, host.address);
}

#define NO_OTHER MODEL_NAME ": another kind of unit -- expected co-simulation -- import it for co-simulation"

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage)
{
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    return no_instance(instanceEnvironment, logMessage,
        NO_OTHER);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption)
{
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return no_instance(instanceEnvironment, logMessage,
        NO_OTHER);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
    fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Status status;
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    ALLOWED(INSTANTIATED, fmi3EnterInitializationMode);
    status = slave_setup(c, startTime);
    return (fmi3Status)(status == STATUS_OK ? slave_enter_initialization(c) : status);
}

/* ---- derivatives */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
    size_t nSensitivity)
{
    return (fmi3Status)slave_derivative(instance, "fmi3GetDirectionalDerivative", unknowns, nUnknowns, knowns, nKnowns, seed,
        nSeed, sensitivity, nSensitivity);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    (void)valueReferences, (void)orders, (void)values, (void)nValues;
    ALLOWED(READABLE, fmi3GetOutputDerivatives);
    return nValueReferences == 0 ? fmi3OK
        : (fmi3Status)slave_unsupported(c, "fmi3GetOutputDerivatives", "outputs have none over time");
}
