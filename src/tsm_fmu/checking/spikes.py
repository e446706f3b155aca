"""Spikes: single samples of a measurement that no motion can make.

A sample is compared with the range of its neighbours on both sides. A step, a reversal of friction and the flank of a
peak lie within it, so that only what goes and comes back within one sample is outside; and where that recurs, as with
noise, stick-slip or a coarse converter, it is no spike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import FloatArray
from ..logs.quantisation import quantisation_step
from .criteria import EVENT_SENSOR_STEPS, EVENT_TIMES_USUAL, FEWEST_BLOCKS, SPIKE_RANGE_SHARE, USUAL_QUANTILE

REACH = 3
"""Neighbours on either side."""
BLOCKS = 5 * FEWEST_BLOCKS
"""Parts of a run, at most, in each of which the largest excursion is taken: a few spikes are in few of them."""


def spikes(x: FloatArray) -> NDArray[np.intp]:
    """Samples of a channel that are spikes.

    Parameters
    ----------
    x : ndarray, shape (n,)
    """
    blocks = min(BLOCKS, x.size // (2 * REACH + 1))
    if blocks < FEWEST_BLOCKS:
        return np.empty(0, np.intp)
    near = [np.roll(x, k) for k in (*range(-REACH, 0), *range(1, REACH + 1))]
    outside = np.maximum(0.0, np.maximum(x - np.max(near, axis=0), np.min(near, axis=0) - x))
    outside[:REACH] = outside[-REACH:] = 0.0
    usual = np.quantile([part.max() for part in np.array_split(outside, blocks)], USUAL_QUANTILE)
    usual_range = float(np.subtract(*np.quantile(x, (0.99, 0.01))))
    least = max(SPIKE_RANGE_SHARE * usual_range, EVENT_SENSOR_STEPS * quantisation_step(x))
    return np.flatnonzero(outside > max(least, EVENT_TIMES_USUAL * float(usual)))


def without_spikes(x: FloatArray, time: FloatArray) -> FloatArray:
    """The channel with the line between the neighbours in place of each spike.

    Parameters
    ----------
    x, time : ndarray, shape (n,)
    """
    found = spikes(x)
    if not found.size:
        return x
    kept = np.delete(np.arange(x.size), found)
    repaired = x.copy()
    repaired[found] = np.interp(time[found], time[kept], x[kept])
    return repaired
