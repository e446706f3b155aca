"""PythonFMU slave of FeedforwardCompensator."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import feedforward_compensator


class FeedforwardCompensator(KernelSlave):
    kernel = feedforward_compensator
