"""The motion that an encoder's readings leave open: the smoothest one within its steps.

What moved stood within half a step q of each reading x. Of all curves that do, the one is taken that has the least
jerk: with the reading's own weight it solves (Whittaker 1923)::

    min  sum (y - x)^2 + sum lambda (d3y/dt3)^2                                         (1)

where lambda, in each place as large as the steps allow, is raised where y keeps to them and lowered where it does not.
No cut-off is chosen: a reversal stays as sharp as it was read, and a slow stroke is smoothed over many samples. A
reading that stays far longer than the levels beside it were passed, or two that alternate, are a rest: nothing moves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from ..kernels.arrays import BoolArray, FloatArray

__all__ = ["smoothest_within_steps"]

_ORDER = 3
_KEPT = 0.6  # of a step: readings are rounded, some the wrong way
_SETTLING, _HEAVIER = 20, 3.0  # rounds at most in which readings that are left gain weight, and by what
_ROUNDS, _FASTEST, _SLOWER, _LEAST = 30, math.log(8.0), 0.9, 0.05  # factors of lambda: large ones first
_LOWERED = 1.5  # times as fast as it is raised: few readings ask for it
_DIGITS = math.log(2e11)  # of lambda times its weights: stiff over some 50 samples; more has no digits left
_PINNED = 1e4  # weight of a sample that is known
_EVEN = 4.0  # samples over which lambda is evened out
_SOFTLY = 1.5  # parts of a level before a rest in which it may come to that, and one after it
_REST, _REST_OF_TWO = 8.0, 40.0  # times as long as the levels beside it: a reversal takes at most 4.8, of two 8.9
_FEWEST = 8  # samples of a rest


def smoothest_within_steps(time: FloatArray, x: FloatArray, step: float) -> FloatArray:
    """The smoothest position that keeps to the readings of an encoder, but for a tenth of a step.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Rising [s]; samples need not be even.
    x : ndarray, shape (n,)
        Readings.
    step : float
        Between two levels of them, above 0.
    """
    found, moving = x.copy(), 0
    for rest in [*_rests(x, step), _Rest(x.size, x.size, None)]:
        start = found[moving] if moving else None
        found[moving : rest.first + 1] = _smoothest(
            time[moving : rest.first + 1], x[moving : rest.first + 1], step, start, rest.edge
        )
        here = slice(rest.first, rest.end)
        if rest.edge is not None:
            found[here] = rest.edge
        elif rest.first < x.size:  # a rest is where the motion before it ended
            found[here] = x[here] + (found[rest.first] - x[rest.first])
        moving = rest.end - 1
    return found


class _Rest(NamedTuple):
    """First and past the last sample of a rest, and where it is if it reads two levels in turn: on their edge."""

    first: int
    end: int
    edge: float | None


def _rests(x: FloatArray, step: float) -> Iterator[_Rest]:
    """Rests, in turn.

    A stretch that begins or ends softly does so within the level of the rest: it has as much of that as it may take.
    """
    edges = np.flatnonzero(np.abs(np.diff(x)) > 0.2 * step) + 1
    first = np.concatenate([[0], edges, [x.size]])
    lengths, at = np.diff(first), x[first[:-1]]
    begun, levels = 0, at.tolist()
    for a in np.flatnonzero(_may_rest(lengths, at, step)).tolist():
        if a < begun:
            continue
        of_two = max(_past_the_last(levels, a, partner, step) for partner in (step, -step))
        for b, longer in ((of_two, _REST_OF_TWO), (a + 1, _REST)):
            before, after = (int(lengths[k]) if 0 <= k < lengths.size else 0 for k in (a - 1, b))
            if first[b] - first[a] > max(longer * max(before, after), _FEWEST):
                come, go = (int(_SOFTLY * max(0, n - 1)) for n in (before, after))
                edge = None if b == a + 1 else 0.5 * (levels[a] + levels[a + 1])
                yield _Rest(int(first[a]) + come, int(first[b]) - go, edge)
                begun = b
                break


def _may_rest(lengths: NDArray[np.intp], at: FloatArray, step: float) -> BoolArray:
    """Levels that stay long, alone or with the next one, or are read in turn with it; few ask for a closer look."""

    def stays(levels: int, longer: float) -> BoolArray:
        """Whether so many levels from one on take so many times as long as those beside them."""
        whole = np.convolve(lengths, np.ones(levels, dtype=int), "valid")
        beside = np.concatenate([[0], lengths, [0]])
        return whole > np.maximum(longer * np.maximum(beside[: whole.size], beside[levels + 1 :]), _FEWEST)

    found = stays(1, _REST)
    if lengths.size > 1:
        found[:-1] |= stays(2, _REST_OF_TWO)
        to_third = np.abs(at[2:] - at[:-2])
        found[:-2] |= np.minimum(to_third, np.abs(to_third - step)) < 0.2 * step
    return found


def _past_the_last(levels: Sequence[float], a: int, partner: float, step: float) -> int:
    """Number past the last of the levels from one on that are all that one or its neighbour."""
    b = a + 1
    while b < len(levels) and min(abs(levels[b] - levels[a]), abs(levels[b] - levels[a] - partner)) < 0.2 * step:
        b += 1
    return b


def _smoothest(time: FloatArray, x: FloatArray, step: float, start: float | None, end: float | None) -> FloatArray:
    """That of a stretch without a rest, from and to where it was found to be, if it was."""
    n, known = x.size, {k: at for k, at in ((0, start), (-1, end)) if at is not None}
    y, own = x.copy(), np.ones(n)
    for k, at in known.items():
        y[k], own[k] = at, _PINNED
    if n < 4 * _ORDER:
        return y
    middle = float(x.mean())
    y -= middle
    slope, rows = _derivative(time), slice(_ORDER // 2, n - _ORDER + _ORDER // 2)
    log = _first(x, step)[rows]
    stiffest = _DIGITS - np.log(np.einsum("ij,ij->i", slope, slope))
    slopes = np.ascontiguousarray(slope.T)
    smooth = y
    for k in range(_ROUNDS):
        smooth = _solved(slopes, np.exp(np.minimum(log, stiffest)), y, own)
        off = (np.abs(smooth - y) > _KEPT * step)[rows]
        reach = np.exp(log[off] / (2 * _ORDER))  # samples over which the curve is stiff
        width = int(np.clip(2.0 * np.median(reach), 3, max(3, n // 8))) if off.any() else 0
        near = maximum_filter1d(off, 2 * width + 1)
        change = max(_FASTEST * _SLOWER**k, _LEAST)
        log = gaussian_filter1d(log + np.where(near, -_LOWERED * change, change), _EVEN, mode="nearest")
    for _ in range(_SETTLING):
        off = np.abs(smooth - y) > _KEPT * step
        if not off.any():
            break
        own[off] *= _HEAVIER
        smooth = _solved(slopes, np.exp(np.minimum(log, stiffest)), y, own)
    return np.clip(smooth, y - step, y + step) + middle  # where the motion has a kink


def _first(x: FloatArray, step: float) -> FloatArray:
    """Log of lambda to begin with: as loose as the steps that a sample moves ask."""
    moved = np.abs(np.diff(x, prepend=x[0])) / step
    return gaussian_filter1d(-2.0 * np.log(np.maximum(moved, 1.0)), _EVEN, mode="nearest")


def _derivative(time: FloatArray) -> FloatArray:
    """Weights of the derivative of Eq (1) over each four samples, per cube of the sample period, shape (n - 3, 4)."""
    t = time / np.median(np.diff(time))
    at = np.lib.stride_tricks.sliding_window_view(t, _ORDER + 1)
    found = np.full(at.shape, float(math.factorial(_ORDER)))
    for j in range(_ORDER + 1):
        for k in range(_ORDER + 1):
            if k != j:
                found[:, j] /= at[:, j] - at[:, k]
    return found


def _solved(slopes: FloatArray, weights: FloatArray, x: FloatArray, own: FloatArray) -> FloatArray:
    """The minimum of Eq (1), with the readings' own weights: a system with as many diagonals as (1) has samples."""
    n, m = x.size, weights.size
    banded = np.zeros((_ORDER + 1, n))
    banded[_ORDER] = own
    for i, one in enumerate(slopes):
        weighted = weights * one
        for j in range(i, _ORDER + 1):
            banded[_ORDER + i - j, j : j + m] += weighted * slopes[j]
    return np.asarray(solveh_banded(banded, own * x, check_finite=False))
