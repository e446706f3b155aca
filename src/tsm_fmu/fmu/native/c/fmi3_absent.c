/* Functions of FMI 3.0 that a co-simulation without events, clocks and structural parameters does not have. */
#include "fmi3Functions.h"
#include "slave.h"

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
