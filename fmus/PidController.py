"""PythonFMU slave of PidController."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import pid_controller


class PidController(KernelSlave):
    kernel = pid_controller
