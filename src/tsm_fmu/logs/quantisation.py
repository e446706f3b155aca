"""Quantisation step of a sampled signal, found from the values it takes."""

from __future__ import annotations

from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

__all__ = ["quantisation_step"]

_OFF_GRID = 0.12  # of a step; values spread evenly between the levels have 0.29
_RARE = 0.01  # of the samples of the median level
_SPIKES = 0.01  # of all samples: where fewer are single ones, these are no levels
_OFTEN = 10  # samples of the median level beside which a single sample is no level
_FEW_OFF_GRID, _REPEATED = 1e-3, 10  # three levels are no grid by chance: evenly apart, and taken again and again

_MOST_KNOWN = 10_000  # signals
_KNOWN: dict[bytes, float] = {}
"""Steps of signals by their digest: each check of a log asks for those of the same few channels again."""


def quantisation_step(values: NDArray[np.float64]) -> float:
    """Step between the levels of a quantised signal; 0.0 where there is no common step.

    The gaps between neighbouring levels give a first step; a straight line through level over level number
    refines it, so that numbers rounded when the log was written do no harm. What has hardly any of the samples that a
    level usually has is a spike, added behind the converter, and no level.

    Parameters
    ----------
    values : ndarray, shape (n,)
    """
    signal = sha256(np.ascontiguousarray(values).data).digest()
    found = _KNOWN.get(signal)
    if found is None:
        if len(_KNOWN) >= _MOST_KNOWN:
            _KNOWN.clear()
        found = _KNOWN[signal] = _step_of(values)
    return found


def _step_of(values: NDArray[np.float64]) -> float:
    levels, samples = np.unique(values, return_counts=True)
    usual = float(np.median(samples)) if samples.size else 0.0
    again = usual >= _OFTEN or np.count_nonzero(samples == 1) < _SPIKES * values.size
    levels = levels[samples >= max(_RARE * usual, 2.0 if again else 0.0)]
    gaps = np.diff(levels)
    # gaps of the rounding of the arithmetic itself are no levels
    gaps = gaps[gaps > 1e-12 * max(1e-300, float(np.abs(levels).max(initial=0.0)))]
    few = gaps.size == 2 and values.size >= _REPEATED * levels.size
    least, off_grid = (2, _FEW_OFF_GRID) if few else (3, _OFF_GRID)
    if gaps.size < least:
        return 0.0
    smallest = float(np.quantile(gaps, 0.02))
    alike = gaps[(gaps >= 0.5 * smallest) & (gaps <= 1.5 * smallest)]
    if alike.size == 0:  # gaps of two sizes far apart, as an encoder's log has that was interpolated
        return 0.0
    step = float(np.mean(alike))
    start, number = 0.0, np.zeros(levels.size)
    for _ in range(3):
        number = np.cumsum(np.concatenate(([0.0], np.rint(np.diff(levels) / step))))
        if number[-1] < least:
            return 0.0
        slope, start = np.polyfit(number, levels, 1)
        step = float(slope)
        if step <= 0.0:
            return 0.0
    spread = float(np.sqrt(np.mean(np.square(levels - start - step * number))))
    return step if spread < off_grid * step else 0.0
