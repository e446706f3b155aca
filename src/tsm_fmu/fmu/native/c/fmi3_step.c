/* The calls of a running simulation in FMI 3.0. */
#include "fmi3Functions.h"
#include "slave.h"

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

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    fmi3Float64 values[], size_t nValues)
{
    return (fmi3Status)slave_read_real(instance, "fmi3GetFloat64", valueReferences, nValueReferences, values, nValues);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
    const fmi3Float64 values[], size_t nValues)
{
    return (fmi3Status)slave_write_real(instance, "fmi3SetFloat64", valueReferences, nValueReferences, values, nValues);
}

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
