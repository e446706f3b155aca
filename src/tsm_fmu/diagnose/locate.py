"""Where the disagreement lies: its share over each coordinate, with a significance that allows for autocorrelation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..identify.problem import FloatArray
from .coordinates import Coordinates

BINS = 16
SURROGATES = 99
LEVEL = 0.05
"""False discovery rate over coordinates and channels (Benjamini and Hochberg 1995)."""
ROWS = 4000


@dataclass(frozen=True)
class Place:
    """Where a channel's disagreement concentrates along one coordinate.

    Attributes
    ----------
    channel, coordinate, unit : str
    range : tuple of (float, float)
        Part of the coordinate in which most of the disagreement lies.
    share_of_gap : float
        Share of the residual's mean square in that range.
    share_of_samples : float
        Share of the samples there: what chance alone would give.
    explained : float
        Share of the residual's variance that is a function of the coordinate.
    p : float
        Probability of such a function in phase-randomised surrogates of the residual.
    significant : bool
        After Benjamini-Hochberg over all coordinates and channels.
    """

    channel: str
    coordinate: str
    unit: str
    range: tuple[float, float]
    share_of_gap: float
    share_of_samples: float
    explained: float
    p: float
    significant: bool


def locate(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], channels: Sequence[str], motion_unit: str,
    load_unit: str, seed: int = 0,
) -> list[Place]:  # fmt: skip
    """Share of the residual over each coordinate, most telling first.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n, channels)
    places : sequence of Coordinates
    channels : sequence of str
    motion_unit, load_unit : str
    seed : int
        Of the surrogates.
    """
    rng = np.random.default_rng(seed)
    steps = [max(1, r.shape[0] * len(residuals) // ROWS) for r in residuals]
    short = [r[::s] for r, s in zip(residuals, steps, strict=True)]
    axes = _axes(places, steps, motion_unit, load_unit)
    found = []
    for c, channel in enumerate(channels):
        parts = [r[:, c] for r in short]
        surrogates = [np.concatenate([_surrogate(p, rng) for p in parts]) for _ in range(SURROGATES)]
        residual = np.concatenate(parts)
        for name, unit, values in axes:
            number = _bins(values)
            if number is None:
                continue
            explained = _explained(residual, number)
            beaten = sum(_explained(s, number) >= explained for s in surrogates)
            span, share, samples = _densest(residual, values, number)
            p = (1 + beaten) / (1 + SURROGATES)
            found.append(Place(channel, name, unit, span, share, samples, explained, p, False))
    kept = benjamini_hochberg([f.p for f in found])
    marked = [Place(**{**vars(f), "significant": k}) for f, k in zip(found, kept, strict=True)]
    return sorted(marked, key=lambda f: (not f.significant, -f.explained))


def benjamini_hochberg(p: Sequence[float], level: float = LEVEL) -> list[bool]:
    """Which of several p-values stay significant at a false discovery rate."""
    order = np.argsort(p)
    passed = [i for rank, i in enumerate(order, 1) if p[i] <= level * rank / len(p)]
    limit = max((p[i] for i in passed), default=-1.0)
    return [value <= limit for value in p]


def _axes(
    places: Sequence[Coordinates], steps: Sequence[int], unit: str, load_unit: str
) -> list[tuple[str, str, FloatArray]]:
    def joined(name: str) -> FloatArray:
        return np.concatenate([getattr(p, name)[::s] for p, s in zip(places, steps, strict=True)])

    found = [
        ("x", unit, joined("x")),
        ("v", f"{unit}/s", joined("v")),
        ("a", f"{unit}/s2", joined("a")),
        ("sgn v", "1", joined("s")),
        ("distance since reversal", unit, joined("since_reversal")),
        ("dwell", "s", joined("dwell")),
        ("time", "s", joined("time")),
    ]
    if all(p.load is not None for p in places):
        found.append(("load", load_unit, joined("load")))
    if unit == "rad" and np.ptp(found[0][2]) > 2.0 * np.pi:
        found.append(("drum angle", "rad", np.mod(found[0][2], 2.0 * np.pi)))
    return found


def _bins(values: FloatArray) -> NDArray[np.int_] | None:
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
    if edges.size < 3:
        levels = np.unique(values)
        return np.searchsorted(levels, values) if 1 < levels.size <= BINS else None
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)


def _explained(residual: FloatArray, number: NDArray[np.int_]) -> float:
    count = np.bincount(number)
    sums = np.bincount(number, residual)
    return float(np.sum(sums**2 / np.maximum(count, 1)) / max(float(np.sum(residual**2)), 1e-300))


def _densest(
    residual: FloatArray, values: FloatArray, number: NDArray[np.int_]
) -> tuple[tuple[float, float], float, float]:
    """The window of bins that holds most of the residual beyond its share of samples."""
    energy = np.bincount(number, residual**2) / max(float(np.sum(residual**2)), 1e-300)
    share = np.bincount(number) / number.size
    best, at = -1.0, (0, energy.size)
    for i in range(energy.size):
        for j in range(i + 1, energy.size + 1):
            if j - i < energy.size and energy[i:j].sum() - share[i:j].sum() > best:
                best, at = float(energy[i:j].sum() - share[i:j].sum()), (i, j)
    inside = (number >= at[0]) & (number < at[1])
    span = (float(values[inside].min()), float(values[inside].max()))
    return span, float(energy[at[0] : at[1]].sum()), float(share[at[0] : at[1]].sum())


def _surrogate(series: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The same spectrum with random phases: no relation to any coordinate is left."""
    spectrum = np.fft.rfft(series)
    phases = np.exp(2j * np.pi * rng.random(spectrum.size))
    phases[0] = 1.0
    return np.fft.irfft(spectrum * phases, series.size)
