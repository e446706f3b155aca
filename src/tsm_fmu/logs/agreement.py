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
        SI unit of the errors.
    rmse, peak_to_peak_error : float
        Root mean square of the error, and its largest minus smallest value.
    offset, shape_rmse : float
        The two parts of rmse, ``rmse^2 = offset^2 + shape_rmse^2``: the mean error (of several runs the root mean
        square of their means), and what is left about the mean of each run.
    nrmse : float
        rmse over the standard deviation of the measurement; infinite if that does not move.
    samples : int
    """

    unit: str
    rmse: float
    peak_to_peak_error: float
    offset: float
    shape_rmse: float
    nrmse: float
    samples: int


def agreement(unit: str, measured: Sequence[NDArray[np.float64]], errors: Sequence[NDArray[np.float64]]) -> Agreement:
    """Errors of several runs pooled over samples; the peak-to-peak value is the largest of a run."""
    pooled, level = np.concatenate(list(errors)), np.concatenate(list(measured))
    rmse = math.sqrt(float(np.mean(pooled**2)))
    means = np.array([float(np.mean(e)) for e in errors])
    squares = sum(e.size * mean**2 for e, mean in zip(errors, means, strict=True)) / pooled.size
    offset = float(means[0]) if len(means) == 1 else math.sqrt(squares)
    shape = math.sqrt(sum(float(np.sum((e - m) ** 2)) for e, m in zip(errors, means, strict=True)) / pooled.size)
    moves = float(np.ptp(level)) > 0.0  # the standard deviation of equal values may round above zero
    nrmse = rmse / float(np.std(level)) if moves else math.inf
    return Agreement(unit, rmse, max(float(np.ptp(e)) for e in errors), offset, shape, nrmse, pooled.size)
