"""PythonFMU slave of TendonDrive."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import tendon_drive


class TendonDrive(KernelSlave):
    kernel = tendon_drive
