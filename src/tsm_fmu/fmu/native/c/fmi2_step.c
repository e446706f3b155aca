/* The calls of a running simulation in FMI 2.0. */
#include "fmi2Functions.h"
#include "slave.h"

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
    fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return (fmi2Status)slave_step(c, "fmi2DoStep", currentCommunicationPoint, communicationStepSize);
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    return (fmi2Status)slave_read_real(c, "fmi2GetReal", vr, nvr, value, nvr);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    return (fmi2Status)slave_write_real(c, "fmi2SetReal", vr, nvr, value, nvr);
}

#define VALUES(Name, KIND, Type) \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, Type value[]) \
    { \
        return (fmi2Status)slave_read(c, "fmi2Get" #Name, KIND, vr, nvr, value, nvr); \
    } \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const Type value[]) \
    { \
        return (fmi2Status)slave_write(c, "fmi2Set" #Name, KIND, vr, nvr, value, nvr); \
    }

VALUES(Integer, INTEGER, fmi2Integer)
VALUES(Boolean, NO_KIND, fmi2Boolean)
VALUES(String, NO_KIND, fmi2String)
