"""PythonFMU slave of RotationalLoad."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import rotational_load


class RotationalLoad(KernelSlave):
    kernel = rotational_load
