"""PythonFMU slave of LebusWinding."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import lebus_winding


class LebusWinding(KernelSlave):
    kernel = lebus_winding
