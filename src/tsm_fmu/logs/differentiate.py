"""Speed and acceleration from a measured position, without phase shift.

A Savitzky-Golay filter fits a fourth-order polynomial to a window of samples around each row and takes its
derivative (Savitzky and Golay 1964; Schafer 2011). Its window is chosen so that the derivative is 3 dB low at
the cut-off frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from ..kernels.arrays import FloatArray, IntArray
from ..models.contract import InputError
from .quantisation import quantisation_step

__all__ = ["Derivative", "after_gaps", "default_cutoff", "differentiate", "sample_period"]

_ORDER = 4
_SHORTEST = 7
_LONGEST = 2001  # beyond it the polynomial fit loses digits
_MOST_LOST = 10
"""Rows that one gap may lack and still be bridged: a hiccup of the logger, not a pause in which anything may happen.

At a longer one the derivative on either side is that of its own stretch.
"""
_JITTER = 0.05
"""Part of a period by which samples may be off an even clock: beyond it positions are interpolated on an even one."""
_JITTERING = 0.9
"""Part of the intervals that must be below two periods for that: a log of a few samples here and there has no clock."""
_PRODUCT = {1: 1.248, 2: 1.409}  # cut-off frequency times window length, for long windows


@dataclass(frozen=True)
class Derivative:
    """A derivative and how it was made.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Derivative in units of the signal over s (order 1) or s2 (order 2).
    cutoff : float
        Frequency [Hz] at which the derivative is 3 dB low.
    window : int
        Samples in the polynomial window.
    bridged : int
        Rows that the log lacks, whose positions were interpolated for this.
    gaps : int
        Longer gaps: what is before and what is after was differentiated alone.
    resampled : bool
        Whether the samples were not even, and positions were interpolated on an even clock for this.
    """

    values: FloatArray
    cutoff: float
    window: int
    bridged: int = 0
    gaps: int = 0
    resampled: bool = False


def sample_period(time: FloatArray, first_row: int = 0) -> float:
    """Sample period [s] of an evenly sampled record; jitter below half a period passes.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time [s].
    first_row : int
        Row number of the first sample, for the message.

    Raises
    ------
    InputError
        If samples are missing or doubled: an interval below 0.5 or above 1.5 of the median.
    """
    steps = np.diff(time)
    middle = float(np.median(steps))
    uneven = np.flatnonzero((steps < 0.5 * middle) | (steps > 1.5 * middle))
    if uneven.size:
        k = int(uneven[0])
        raise InputError(
            f"interval of {steps[k]:g} s between rows {first_row + k} and {first_row + k + 1} (t = {time[k]:g} s), "
            f"{uneven.size} such in all -- expected even sampling near {middle:g} s to differentiate "
            "-- cut the log with --from and --to, or add the measured speed to it"
        )
    return float(time[-1] - time[0]) / (time.size - 1)


def _on_even_clock(time: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Time and signal on an even clock, interpolated without overshoot; as they are where the samples already are.

    Short gaps get the rows that they lack. Where the stamps jitter, the clock is that of their median.
    """
    steps = np.diff(time)
    if not steps.size:
        return time, x
    intervals = steps / np.median(steps)
    whole = np.rint(intervals)
    even = bool(whole.min() >= 1.0 and np.abs(intervals - whole).max() <= _JITTER)
    if even and whole.max() == 1.0:
        return time, x
    if even:
        rows = np.concatenate(([0], np.cumsum(whole.astype(int))))
        clock = np.interp(np.arange(rows[-1] + 1), rows, time)
    elif np.mean(intervals < 2.0) < _JITTERING:
        return time, x
    else:
        clock = np.linspace(time[0], time[-1], int(np.rint(intervals.sum())) + 1)
    from scipy.interpolate import PchipInterpolator

    return clock, np.asarray(PchipInterpolator(time, x)(clock))


def _stretches(time: FloatArray) -> list[slice]:
    """Rows between gaps that are too long to be bridged; all of them where the sampling is uneven without gaps."""
    edges = [0, *map(int, after_gaps(time)), time.size]
    return [slice(a, b) for a, b in pairwise(edges)]


def after_gaps(time: FloatArray) -> IntArray:
    """Samples before which a clock has a gap that is too long to be bridged."""
    steps = np.diff(time)
    return (
        np.flatnonzero(np.rint(steps / np.median(steps)) > _MOST_LOST + 1) + 1 if steps.size else np.empty(0, np.intp)
    )


def default_cutoff(time: FloatArray, x: FloatArray) -> float:
    """Cut-off [Hz] from the signal: twice the frequency above which only noise is left.

    That is where the power that remains above it (Welch's spectrum) is no more than the power of the noise: the
    spectrum's floor (median of its upper half) over the whole band, or the q^2/12 of a quantisation step q.

    Parameters
    ----------
    time, x : ndarray, shape (n,)
        Evenly sampled signal.
    """
    period = sample_period(time)
    from scipy.signal import welch  # here and below: half a second, which only those who differentiate pay

    frequency, power = welch(x, 1.0 / period, nperseg=max(8, x.size // 4), detrend="linear")
    remaining = np.cumsum(power[::-1])[::-1] * frequency[1]
    floor = float(np.median(power[frequency.size // 2 :])) * frequency[-1]
    noise = max(floor, quantisation_step(x) ** 2 / 12.0, 1e-12 * remaining[0])
    return 2.0 * float(frequency[max(1, int(np.argmax(remaining <= noise)))])


def differentiate(
    time: FloatArray, x: FloatArray, order: int = 1, cutoff: float | None = None, first_row: int = 0
) -> Derivative:
    """First or second derivative of ``x`` without phase shift.

    Parameters
    ----------
    time, x : ndarray, shape (n,)
        The signal; gaps of a few rows are bridged, samples that jitter are interpolated on an even clock.
    order : {1, 2}
    cutoff : float, optional
        Frequency [Hz] at which the derivative is 3 dB low; `default_cutoff` without it.
    first_row : int
        Row number of the first sample, for messages.

    Raises
    ------
    InputError
        If the cut-off is outside what rate and length of the record allow; where it has long gaps, of a stretch
        between them.
    """
    stretches = _stretches(time)
    longest = max(stretches, key=lambda rows: rows.stop - rows.start)
    main = _of_stretch(time[longest], x[longest], order, cutoff, first_row + longest.start)
    if len(stretches) == 1:
        return main
    found = []
    for rows in stretches:
        at = first_row + rows.start
        place = f" in rows {at} to {first_row + rows.stop - 1}, beside a gap"
        # the same filter, where that is within what a short stretch allows
        stretch = time[rows], x[rows], order, cutoff, at, main.cutoff, place
        found.append(main if rows is longest else _of_stretch(*stretch))
    values = np.concatenate([one.values for one in found])
    bridged, resampled = sum(one.bridged for one in found), any(one.resampled for one in found)
    return Derivative(values, main.cutoff, main.window, bridged, len(stretches) - 1, resampled)


def _of_stretch(
    time: FloatArray, x: FloatArray, order: int, cutoff: float | None, first_row: int, wished: float | None = None,
    place: str = "",
) -> Derivative:  # fmt: skip
    """That of rows without a gap that cannot be bridged; with the cut-off wished for as far as it is possible."""
    given = time
    time, x = _on_even_clock(time, x)
    period = sample_period(time, first_row)
    longest = min(x.size - 1 + x.size % 2, _LONGEST)
    if longest < _SHORTEST:
        raise InputError(
            f"{x.size} samples{place} -- expected at least {_SHORTEST} to differentiate -- give a longer log"
        )
    lowest, highest = (_cutoff(window, period, order) for window in (longest, _SHORTEST))
    if cutoff is None:
        cutoff = min(max(wished or default_cutoff(time, x), lowest), highest)
    elif not lowest <= cutoff <= highest:
        raise InputError(
            f"cut-off {cutoff:g} Hz{place} -- expected {lowest:.3g} to {highest:.3g} Hz for {x.size} samples at "
            f"{1.0 / period:.6g} Hz -- choose a --cutoff inside"
        )
    half = int(np.rint(0.5 * (_PRODUCT[order] / (cutoff * period) - 1.0)))
    window = min(max(2 * half + 1, _SHORTEST), longest)
    from scipy.signal import savgol_filter

    values: Any = savgol_filter(x, window, _ORDER, deriv=order, delta=period, mode="interp")
    resampled = not np.isin(given, time).all()
    intervals = np.diff(given) / period
    uneven = 2.0 * float(np.quantile(np.abs(intervals - np.rint(intervals)), 0.9))
    bridged = int((np.rint(intervals) - 1.0)[intervals > 1.5 + uneven].sum())
    return Derivative(np.interp(given, time, values), _cutoff(window, period, order), window, bridged, 0, resampled)


@cache
def _cutoff(window: int, period: float, order: int) -> float:
    """Frequency [Hz] at which the filter's gain, relative to the exact derivative, is -3 dB."""
    from scipy.optimize import brentq
    from scipy.signal import savgol_coeffs

    taps = savgol_coeffs(window, _ORDER, deriv=order, use="dot")
    k = np.arange(window) - window // 2

    def excess(angle: float) -> float:
        gain = taps @ np.sin(angle * k) / angle if order == 1 else -(taps @ np.cos(angle * k)) / angle**2
        return float(gain) - math.sqrt(0.5)

    angle: Any = brentq(excess, math.pi / window, 3.6 * math.pi / window)
    return float(angle) / (2.0 * math.pi * period)
