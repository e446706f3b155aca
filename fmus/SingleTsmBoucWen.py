"""PythonFMU slave of SingleTsmBoucWen."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import single_tsm_bouc_wen


class SingleTsmBoucWen(KernelSlave):
    kernel = single_tsm_bouc_wen
