"""PythonFMU slave of SingleTsmLuGre."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import single_tsm_lugre


class SingleTsmLuGre(KernelSlave):
    kernel = single_tsm_lugre
