"""PythonFMU slave of LebusTransmission."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import lebus_transmission


class LebusTransmission(KernelSlave):
    kernel = lebus_transmission
