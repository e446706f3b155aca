"""PythonFMU slave of DcMotor."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import dc_motor


class DcMotor(KernelSlave):
    kernel = dc_motor
