"""A zero that wanders: what a model leaves moves slower than the motion, and with nothing that the log holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.arrays import FloatArray
from ...regression.slow_zero import SlowZero
from ..criteria import LAW_SHARE, WANDER_FUNCTIONS, WANDER_MOTION_SHARE, WANDER_SHARE, WANDERING_SPREAD_SHARE
from ..evidence import Wander
from ..runs.motion_signals import Coordinates
from .predictable import predictable_share


def wandering_zeros(
    channels: Sequence[str], residuals: Sequence[FloatArray], places: Sequence[Coordinates], spread: FloatArray,
    units: tuple[str, str],
) -> dict[str, Wander]:  # fmt: skip
    """Zeros that wander in what a model leaves of runs, by channel.

    A few slow functions of time make most of what is left, in each run whose motion is faster than they are, and the
    coordinates predict next to nothing of it where it was not fitted. In a run whose motion is as slow they would
    follow what a law of that lacks: there they tell nothing.

    Parameters
    ----------
    channels : sequence of str
    residuals : sequence of ndarray, shape (n, channels)
        One array a run; where nothing is compared it is nought.
    places : sequence of Coordinates
        At the same samples.
    spread : ndarray, shape (channels,)
        Standard deviation of each channel.
    units : (str, str)
        SI units of x and of the load.
    """
    slow = [_slow_functions(p) for p in places]
    fast = [k for k, p in enumerate(places) if slow_share(p.x, slow[k]) < WANDER_MOTION_SHARE]
    if not fast:
        return {}
    sizes = _sizes(residuals, slow)
    large = sizes > WANDERING_SPREAD_SHARE * spread
    if not large.any():
        return {}
    shares = _slow_with_nothing(residuals, places, slow, fast, units)
    period = 2.0 * min(float(np.ptp(places[k].time)) for k in fast) / WANDER_FUNCTIONS
    found = zip(channels, sizes.tolist(), large & (shares > 0.0), strict=True)
    return {channel: Wander(size, period) for channel, size, there in found if there}


def slow_with_nothing(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], units: tuple[str, str]
) -> FloatArray:
    """Part of what is left of each channel that moves slowly and with nothing that the log holds; nought if not most.

    The same as `wandering_zeros` asks, in each run, however slow its motion is: that may have a law that is none of its
    coordinates, so that it is no zero yet.

    Parameters
    ----------
    residuals, places, units
        As for `wandering_zeros`.
    """
    return _slow_with_nothing(residuals, places, [_slow_functions(p) for p in places], range(len(places)), units)


def _slow_with_nothing(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], slow: Sequence[FloatArray], runs: Sequence[int],
    units: tuple[str, str],
) -> FloatArray:  # fmt: skip
    """Least part of what is left of these runs that slow functions make, if most, and the coordinates predict nothing.

    By channel; nought else.
    """
    shares = np.min([[slow_share(y, slow[k]) for y in residuals[k].T] for k in runs], axis=0)
    found = shares > WANDER_SHARE
    if found.any():
        about_zero = [r - r.mean(axis=0) for r in residuals]  # that of each run
        found &= predictable_share(about_zero, places, *units) < LAW_SHARE
    return np.where(found, shares, 0.0)


def wander_sizes(residuals: Sequence[FloatArray], places: Sequence[Coordinates]) -> FloatArray:
    """RMS of the slow part of what a model leaves of each channel, about the zero of each run.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n, channels)
        One array a run.
    places : sequence of Coordinates
        At the same samples.
    """
    return _sizes(residuals, [_slow_functions(p) for p in places])


def _sizes(residuals: Sequence[FloatArray], slow: Sequence[FloatArray]) -> FloatArray:
    amplitudes = np.concatenate([basis.T @ r for basis, r in zip(slow, residuals, strict=True)])  # of zero mean each
    return np.sqrt(np.sum(amplitudes**2, axis=0) / sum(len(r) for r in residuals))


def _slow_functions(place: Coordinates) -> FloatArray:
    return SlowZero((), float(place.time[0]), float(place.time[-1]), WANDER_FUNCTIONS).basis(place.time)


def slow_share(y: FloatArray, basis: FloatArray) -> float:
    """Part of the mean square of a signal about its mean that slow functions make, 0 to 1."""
    about_mean = y - y.mean()
    return float(np.sum((basis.T @ about_mean) ** 2) / max(float(np.sum(about_mean**2)), 1e-300))
