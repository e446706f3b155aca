"""PythonFMU slave of Sum."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import sum


class Sum(KernelSlave):
    kernel = sum
