"""PythonFMU slave of SingleTsmDahl."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import single_tsm_dahl


class SingleTsmDahl(KernelSlave):
    kernel = single_tsm_dahl
