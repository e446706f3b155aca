"""PythonFMU slave of DistalEstimator."""

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import distal_estimator


class DistalEstimator(KernelSlave):
    kernel = distal_estimator
