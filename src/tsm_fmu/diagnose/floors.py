"""How small a gap can be: the noise of a channel from repeats or, without any, from what no model follows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..identify.problem import FitRun, FloatArray
from ..identify.residuals import noise_floor


def repeats_floor(runs: Sequence[FitRun]) -> FloatArray | None:
    """RMS by which each channel does not repeat from period to period; None where a run has no period."""
    squares = []
    for run in runs:
        floor = noise_floor(run)
        if floor is None:
            return None
        squares.append(floor**2 * run.time.size)
    return np.sqrt(np.sum(squares, axis=0) / sum(run.time.size for run in runs))


def white_floor(runs: Sequence[FitRun]) -> FloatArray:
    """RMS of what changes from sample to sample, which no motion explains: a lower bound of the noise.

    From third differences, which a smooth signal hardly has; their median, against jumps.
    """
    deviations = [np.median(np.abs(np.diff(run.targets, n=3, axis=0)), axis=0) / 0.6745 for run in runs]
    return np.sqrt(np.mean(np.square(deviations), axis=0) / 20.0)
