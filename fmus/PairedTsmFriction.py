"""PythonFMU slave of PairedTsmFriction."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import paired_tsm_friction


class PairedTsmFriction(KernelSlave):
    kernel = paired_tsm_friction
