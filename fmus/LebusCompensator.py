"""PythonFMU slave of LebusCompensator."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import lebus_compensator


class LebusCompensator(KernelSlave):
    kernel = lebus_compensator
