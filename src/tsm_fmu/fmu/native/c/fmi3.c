/* FMI 3.0 for co-simulation, all functions. */
#include "fmi3Functions.h"
#include "slave.h"

#include <string.h>

#define ALLOWED(modes, function) \
    do { if (slave_refuses(instance, modes, #function)) return fmi3Error; } while (0)
#define NOT_NULL(argument, function) \
    do { if ((argument) == NULL) return (fmi3Status)slave_null(instance, #function, #argument); } while (0)

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

/* ---- versions, logging */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[])
{
    size_t k;
    ALLOWED(ANY_MODE, fmi3SetDebugLogging);
    for (k = 0; k < nCategories; k++) {
        if (categories == NULL || categories[k] == NULL || strncmp(categories[k], "log", 3) != 0) {
            return (fmi3Status)slave_unsupported(instance, "fmi3SetDebugLogging",
                "expected categories of the model description");
        }
    }
    ((Slave *)instance)->logging = loggingOn;
    return fmi3OK;
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

void fmi3FreeInstance(fmi3Instance instance)
{
    slave_free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
    fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Status status;
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    ALLOWED(INSTANTIATED, fmi3EnterInitializationMode);
    status = slave_setup(instance, startTime);
    return (fmi3Status)(status == STATUS_OK ? slave_enter_initialization(instance) : status);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    ALLOWED(INITIALIZATION, fmi3ExitInitializationMode);
    return (fmi3Status)slave_exit_initialization(instance);
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    ALLOWED(STEPPING, fmi3Terminate);
    ((Slave *)instance)->memory.mode = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    ALLOWED(ANY_MODE, fmi3Reset);
    slave_reset(instance);
    return fmi3OK;
}

/* ---- values */

#define VALUES(Name, KIND, Type) \
    fmi3Status fmi3Get##Name(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
        Type values[], size_t nValues) \
    { \
        return (fmi3Status)slave_read(instance, "fmi3Get" #Name, KIND, valueReferences, nValueReferences, values, nValues); \
    } \
    fmi3Status fmi3Set##Name(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
        const Type values[], size_t nValues) \
    { \
        return (fmi3Status)slave_write(instance, "fmi3Set" #Name, KIND, valueReferences, nValueReferences, values, nValues); \
    }

VALUES(Float64, REAL, fmi3Float64)
VALUES(Int32, INTEGER, fmi3Int32)
VALUES(Int64, ENUMERATION, fmi3Int64)
VALUES(Boolean, NO_KIND, fmi3Boolean)
VALUES(Float32, NO_KIND, fmi3Float32)
VALUES(Int8, NO_KIND, fmi3Int8)
VALUES(UInt8, NO_KIND, fmi3UInt8)
VALUES(Int16, NO_KIND, fmi3Int16)
VALUES(UInt16, NO_KIND, fmi3UInt16)
VALUES(UInt32, NO_KIND, fmi3UInt32)
VALUES(UInt64, NO_KIND, fmi3UInt64)
VALUES(String, NO_KIND, fmi3String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
    (void)valueSizes;
    return (fmi3Status)slave_read(instance, "fmi3GetBinary", NO_KIND, valueReferences, nValueReferences, values, nValues);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
    (void)valueSizes;
    return (fmi3Status)slave_write(instance, "fmi3SetBinary", NO_KIND, valueReferences, nValueReferences, values, nValues);
}

/* ---- FMU states */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    ALLOWED(ANY_MODE, fmi3GetFMUState);
    NOT_NULL(FMUState, fmi3GetFMUState);
    *FMUState = slave_copy(instance, *FMUState);
    return *FMUState == NULL ? fmi3Error : fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    ALLOWED(ANY_MODE, fmi3SetFMUState);
    NOT_NULL(FMUState, fmi3SetFMUState);
    ((Slave *)instance)->memory = *(const Memory *)FMUState;
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    ALLOWED(ANY_MODE, fmi3FreeFMUState);
    if (FMUState != NULL) {
        free(*FMUState);
        *FMUState = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    ALLOWED(ANY_MODE, fmi3SerializedFMUStateSize);
    NOT_NULL(FMUState, fmi3SerializedFMUStateSize);
    NOT_NULL(size, fmi3SerializedFMUStateSize);
    *size = slave_serialized_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    ALLOWED(ANY_MODE, fmi3SerializeFMUState);
    NOT_NULL(FMUState, fmi3SerializeFMUState);
    NOT_NULL(serializedState, fmi3SerializeFMUState);
    return (fmi3Status)slave_serialize(instance, FMUState, serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size, fmi3FMUState *FMUState)
{
    ALLOWED(ANY_MODE, fmi3DeserializeFMUState);
    NOT_NULL(serializedState, fmi3DeserializeFMUState);
    NOT_NULL(FMUState, fmi3DeserializeFMUState);
    *FMUState = slave_deserialize(instance, serializedState, size);
    return *FMUState == NULL ? fmi3Error : fmi3OK;
}

/* ---- derivatives */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
    size_t nSensitivity)
{
    return (fmi3Status)slave_derivative(instance, "fmi3GetDirectionalDerivative", unknowns, nUnknowns, knowns, nKnowns, seed,
        nSeed, sensitivity, nSensitivity);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    (void)valueReferences, (void)orders, (void)values, (void)nValues;
    ALLOWED(READABLE, fmi3GetOutputDerivatives);
    return nValueReferences == 0 ? fmi3OK
        : (fmi3Status)slave_unsupported(instance, "fmi3GetOutputDerivatives", "outputs have none over time");
}

/* ---- step */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
    fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
    fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    Status status;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (eventHandlingNeeded == NULL || terminateSimulation == NULL || earlyReturn == NULL || lastSuccessfulTime == NULL) {
        return (fmi3Status)slave_null(instance, "fmi3DoStep", "a result");
    }
    status = slave_step(instance, "fmi3DoStep", currentCommunicationPoint, communicationStepSize);
    *eventHandlingNeeded = fmi3False;
    *terminateSimulation = fmi3False;
    *earlyReturn = fmi3False;
    *lastSuccessfulTime = instance == NULL ? 0.0 : ((Slave *)instance)->memory.time;
    return (fmi3Status)status;
}

/* ---- functions that a co-simulation without events, clocks and structural parameters does not have */

#define UNSUPPORTED(function, why) return (fmi3Status)slave_unsupported(instance, #function, why)
#define NO_EVENTS "the model has no event mode"
#define NO_CLOCKS "the model has no clocks"
#define NO_EXCHANGE "the model is for co-simulation"

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
    size_t nSensitivity)
{
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns, (void)seed, (void)nSeed, (void)sensitivity;
    (void)nSensitivity;
    UNSUPPORTED(fmi3GetAdjointDerivative, "directional derivatives only");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference, size_t *nDependencies)
{
    (void)valueReference, (void)nDependencies;
    UNSUPPORTED(fmi3GetNumberOfVariableDependencies, "they are in the model description");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
    fmi3ValueReference independents[], size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
    size_t nDependencies)
{
    (void)dependent, (void)elementIndicesOfDependent, (void)independents, (void)elementIndicesOfIndependents;
    (void)dependencyKinds, (void)nDependencies;
    UNSUPPORTED(fmi3GetVariableDependencies, "they are in the model description");
}

#define PLAIN(function, why) \
    fmi3Status function(fmi3Instance instance) { UNSUPPORTED(function, why); }

PLAIN(fmi3EnterEventMode, NO_EVENTS)
PLAIN(fmi3EnterStepMode, NO_EVENTS)
PLAIN(fmi3EvaluateDiscreteStates, NO_EVENTS)
PLAIN(fmi3EnterConfigurationMode, "the model has no structural parameters")
PLAIN(fmi3ExitConfigurationMode, "the model has no structural parameters")
PLAIN(fmi3EnterContinuousTimeMode, NO_EXCHANGE)

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime)
{
    (void)discreteStatesNeedUpdate, (void)terminateSimulation, (void)nominalsOfContinuousStatesChanged;
    (void)valuesOfContinuousStatesChanged, (void)nextEventTimeDefined, (void)nextEventTime;
    UNSUPPORTED(fmi3UpdateDiscreteStates, NO_EVENTS);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Clock values[])
{
    (void)valueReferences, (void)nValueReferences, (void)values;
    UNSUPPORTED(fmi3GetClock, NO_CLOCKS);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Clock values[])
{
    (void)valueReferences, (void)nValueReferences, (void)values;
    UNSUPPORTED(fmi3SetClock, NO_CLOCKS);
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
    (void)valueReferences, (void)nValueReferences, (void)intervals, (void)qualifiers;
    UNSUPPORTED(fmi3GetIntervalDecimal, NO_CLOCKS);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions, (void)qualifiers;
    UNSUPPORTED(fmi3GetIntervalFraction, NO_CLOCKS);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Float64 shifts[])
{
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    UNSUPPORTED(fmi3GetShiftDecimal, NO_CLOCKS);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    UNSUPPORTED(fmi3GetShiftFraction, NO_CLOCKS);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Float64 intervals[])
{
    (void)valueReferences, (void)nValueReferences, (void)intervals;
    UNSUPPORTED(fmi3SetIntervalDecimal, NO_CLOCKS);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    UNSUPPORTED(fmi3SetIntervalFraction, NO_CLOCKS);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Float64 shifts[])
{
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    UNSUPPORTED(fmi3SetShiftDecimal, NO_CLOCKS);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    UNSUPPORTED(fmi3SetShiftFraction, NO_CLOCKS);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
    fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    (void)noSetFMUStatePriorToCurrentPoint, (void)enterEventMode, (void)terminateSimulation;
    UNSUPPORTED(fmi3CompletedIntegratorStep, NO_EXCHANGE);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    (void)time;
    UNSUPPORTED(fmi3SetTime, NO_EXCHANGE);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    (void)continuousStates, (void)nContinuousStates;
    UNSUPPORTED(fmi3SetContinuousStates, NO_EXCHANGE);
}

#define STATES(function) \
    fmi3Status function(fmi3Instance instance, fmi3Float64 values[], size_t count) \
    { \
        (void)values, (void)count; \
        UNSUPPORTED(function, NO_EXCHANGE); \
    }
#define NUMBER(function) \
    fmi3Status function(fmi3Instance instance, size_t *count) \
    { \
        (void)count; \
        UNSUPPORTED(function, NO_EXCHANGE); \
    }

STATES(fmi3GetContinuousStateDerivatives)
STATES(fmi3GetEventIndicators)
STATES(fmi3GetContinuousStates)
STATES(fmi3GetNominalsOfContinuousStates)
NUMBER(fmi3GetNumberOfEventIndicators)
NUMBER(fmi3GetNumberOfContinuousStates)

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime)
{
    (void)clockReference, (void)activationTime;
    UNSUPPORTED(fmi3ActivateModelPartition, NO_CLOCKS);
}
