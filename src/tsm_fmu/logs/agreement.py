"""How far a simulation is from a measurement, channel by channel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Agreement:
    """Simulated minus measured, of one channel.

    Attributes
    ----------
    unit : str
        SI unit of the next two.
    rmse, peak_to_peak_error : float
        Root mean square of the error, and its largest minus smallest value.
    nrmse : float
        rmse over the standard deviation of the measurement; infinite if that does not move.
    samples : int
    """

    unit: str
    rmse: float
    peak_to_peak_error: float
    nrmse: float
    samples: int


def agreement(unit: str, measured: Sequence[NDArray[np.float64]], errors: Sequence[NDArray[np.float64]]) -> Agreement:
    """Errors of several runs pooled over samples; the peak-to-peak value is the largest of a run."""
    pooled, level = np.concatenate(list(errors)), np.concatenate(list(measured))
    rmse = math.sqrt(float(np.mean(pooled**2)))
    moves = float(np.ptp(level)) > 0.0  # the standard deviation of equal values may round above zero
    nrmse = rmse / float(np.std(level)) if moves else math.inf
    return Agreement(unit, rmse, max(float(np.ptp(e)) for e in errors), nrmse, pooled.size)
