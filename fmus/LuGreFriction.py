"""PythonFMU slave of LuGreFriction."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import lugre_friction


class LuGreFriction(KernelSlave):
    kernel = lugre_friction
