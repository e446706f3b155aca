"""PythonFMU slave of PairedTsmBacklash."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import paired_tsm_backlash


class PairedTsmBacklash(KernelSlave):
    kernel = paired_tsm_backlash
