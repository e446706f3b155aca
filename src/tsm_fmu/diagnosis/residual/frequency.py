"""Where the disagreement lies in frequency: harmonics of a periodic motion, bands of any other.

A surrogate with the residual's spectrum has the same share in every band, so that share alone can prove nothing. Two
statistics that can:

- Where the motion repeats, the share of the residual at its harmonics, against noise with the background of the
  spectrum beside the harmonics: Thomson's F-test of lines (Proc. IEEE 70, 1982), with the background as a running
  median and its distribution from surrogates. Odd harmonics are what is the same in both directions (friction,
  backlash), even ones what is not.
- Else the share of a band that is coherent with the motion: one complex gain for the band from x, sgn v and |v|
  each, over the bins of all runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal.windows import hann

from ...kernels.arrays import FloatArray
from ...regression.problem import FitRun
from ...regression.residuals import period_of
from ..criteria import HARMONIC_PERIODS
from ..runs.motion_signals import Coordinates
from .surrogates import tail

HARMONICS = 12
SINGLE = 4
"""Harmonics that are looked at one by one."""
FEWEST_BINS = 12
"""Bins that a band needs."""


@dataclass(frozen=True)
class Band:
    """A part of the spectrum of one channel's residual.

    Attributes
    ----------
    name : str
    range : tuple of (float, float)
        [Hz]
    share : float
        Share of the residual's mean square.
    background : float
        The same without the motion: mean of the surrogates.
    explained, chance : float
        Share of the residual that comes with the motion; the same by chance.
    p : float
    """

    name: str
    range: tuple[float, float]
    share: float
    background: float
    explained: float
    chance: float
    p: float


def frequencies(
    residuals: Sequence[FloatArray], surrogates: Sequence[FloatArray], places: Sequence[Coordinates]
) -> list[Band]:
    """Harmonics where all runs repeat with one period, else bands.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n,)
        One channel, one array a run.
    surrogates : sequence of ndarray, shape (n, count)
        Surrogates of each.
    places : sequence of Coordinates
        At the same samples.
    """
    if any(r.size < 4 * FEWEST_BINS for r in residuals):
        return []
    whole = [_whole_periods(c) for c in places]
    periods = [w[1] for w in whole if w is not None]
    if len(periods) == len(places) and max(periods) < 1.02 * min(periods):
        return _harmonics(residuals, surrogates, [w for w in whole if w is not None])
    return _bands(residuals, surrogates, places)


def _whole_periods(c: Coordinates) -> tuple[int, float, int] | None:
    """Samples in the largest whole number of periods, the period [s], and their number; None without enough."""
    x = c.x[:, None]
    period, n = period_of(FitRun("", c.time, x, x)), c.x.size
    if period is None or n // period < HARMONIC_PERIODS + 1:
        return None
    count = n // period - 1  # one period is left to compare with
    around = range(max(period, count * period - count), min(n - period // 2, count * period + count) + 1)
    best = min(around, key=lambda m: float(np.mean((c.x[m:] - c.x[: n - m]) ** 2)))
    return best, best / count * float(np.median(np.diff(c.time))), count


def _harmonics(
    residuals: Sequence[FloatArray], surrogates: Sequence[FloatArray], whole: Sequence[tuple[int, float, int]]
) -> list[Band]:
    observed, by_chance = 0.0, 0.0
    total, noise = 0.0, 0.0
    top = min(HARMONICS, *(n // (2 * count) - 1 for n, _, count in whole))
    if top < 2:
        return []
    for r, d, (n, _, count) in zip(residuals, surrogates, whole, strict=True):
        lines = count * np.arange(1, top + 1)
        power, other = (np.abs(np.fft.rfft(y[:n] - y[:n].mean(axis=0), axis=0)) ** 2 / n for y in (r[:, None], d))
        observed, by_chance = observed + power[lines], by_chance + other[lines]
        total, noise = total + power.sum(axis=0), noise + other.sum(axis=0)
    shares, chances = np.asarray(observed / total), np.asarray(by_chance / noise)
    period = float(np.mean([w[1] for w in whole]))
    order = np.arange(1, top + 1)
    sets = {"odd harmonics": order % 2 == 1, "even harmonics": order % 2 == 0}
    sets |= {f"harmonic {k}": order == k for k in range(1, min(SINGLE, top) + 1)}
    found = []
    for name, members in sets.items():
        share, other = float(shares[members].sum()), chances[members].sum(axis=0)
        span = (float(order[members].min() / period), float(order[members].max() / period))
        expected = float(other.mean())
        found.append(Band(name, span, share, expected, share, expected, tail(share, other)))
    return found


def _bands(
    residuals: Sequence[FloatArray], surrogates: Sequence[FloatArray], places: Sequence[Coordinates]
) -> list[Band]:
    steps = [float(np.median(np.diff(c.time))) for c in places]
    axes = [np.fft.rfftfreq(r.size, dt) for r, dt in zip(residuals, steps, strict=True)]
    x = np.concatenate([c.x - c.x.mean() for c in places])
    v = np.concatenate([c.v for c in places])
    middle = float(np.sqrt(np.mean(v**2) / max(np.mean(x**2), 1e-300))) / (2.0 * np.pi)  # frequency of the motion
    highest = min(float(f[-1]) for f in axes)
    edges = [0.0, *(middle * k for k in (0.5, 2.0, 8.0, 32.0) if middle * k < 0.5 * highest), highest]
    spectra = [
        [_spectrum(y) for y in (r[:, None], d, _drivers(c))]
        for r, d, c in zip(residuals, surrogates, places, strict=True)
    ]
    total = [sum(np.sum(np.abs(s[i]) ** 2, axis=0) for s in spectra) for i in (0, 1)]
    found = []
    for low, high in pairwise(edges):
        inside = [(f > low) & (f <= high) for f in axes]
        if sum(int(i.sum()) for i in inside) < FEWEST_BINS:
            continue
        y, other, motion = (np.concatenate([s[i][k] for s, k in zip(spectra, inside, strict=True)]) for i in range(3))
        basis, size, _ = np.linalg.svd(motion, full_matrices=False)
        basis = basis[:, size > 1e-9 * size[0]]
        share, chances = (
            np.sum(np.abs(z) ** 2, axis=0) / np.maximum(t, 1e-300) for z, t in zip((y, other), total, strict=True)
        )
        with_motion, with_chance = (
            np.sum(np.abs(basis.conj().T @ z) ** 2, axis=0) / np.maximum(t, 1e-300)
            for z, t in zip((y, other), total, strict=True)
        )
        explained, whole = float(with_motion[0]), float(share[0])
        p = tail(explained / max(whole, 1e-300), with_chance / np.maximum(chances, 1e-300))
        expected = float(chances.mean())
        found.append(Band("frequency", (low, high), whole, expected, explained, float(with_chance.mean()), p))
    return found


def _spectrum(columns: FloatArray) -> NDArray[np.complex128]:
    """Through a Hann window: else the jump from end to start leaks into all bands, that of the motion with it."""
    n = columns.shape[0]
    return np.fft.rfft((columns - columns.mean(axis=0)) * hann(n, sym=False)[:, None], axis=0) / np.sqrt(n)


def _drivers(c: Coordinates) -> FloatArray:
    columns = np.column_stack([c.x, c.s, np.abs(c.v)])
    return columns / np.maximum(columns.std(axis=0), 1e-300)
