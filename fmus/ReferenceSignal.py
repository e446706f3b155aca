"""PythonFMU slave of ReferenceSignal."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import reference_signal


class ReferenceSignal(KernelSlave):
    kernel = reference_signal
