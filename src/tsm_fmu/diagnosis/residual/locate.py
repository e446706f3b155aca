"""Where the disagreement lies: its share over each coordinate, with a significance that allows for autocorrelation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.stats import false_discovery_control

from ...kernels.arrays import FloatArray
from ..criteria import FALSE_DISCOVERY_RATE
from ..evidence import Place
from ..runs.motion_signals import Coordinates
from .frequency import frequencies
from .surrogates import surrogates, tail

BINS = 16
SURROGATES = 199
ROWS = 4000


def locate(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], channels: Sequence[str], motion_unit: str,
    load_unit: str, seed: int = 0,
) -> list[Place]:  # fmt: skip
    """Share of the residual over each coordinate, most telling first.

    Significance is against noise with the continuous part of the residual's spectrum (`surrogates`). Of coordinates
    the statistic is the share that is a function of them, in each direction of motion on its own, beyond what the
    direction explains; of frequencies see `frequency`.

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
    thin = [c.part(slice(None, None, s)) for c, s in zip(places, steps, strict=True)]
    axes = [(*axis, number) for axis in axes_of(thin, motion_unit, load_unit) if (number := bins(axis[2])) is not None]
    direction = (np.concatenate([c.s for c in thin]) > 0.0).astype(int)
    found = []
    for c, channel in enumerate(channels):
        parts = [r[:, c] for r in short]
        surrogates_of_runs = [surrogates(p, SURROGATES, rng) for p in parts]
        residual, noise = np.concatenate(parts), np.concatenate(surrogates_of_runs)
        deviation = float(residual.std())
        spreads = [_Spread(residual[:, None]), _Spread(noise)]
        of_direction = [s.between(direction) for s in spreads]
        for name, unit, values, number in axes:
            span, share, samples = _densest(residual, values, number)
            both = number if name == "sgn v" else 2 * number + direction
            less = [0.0, 0.0] if name == "sgn v" else of_direction
            shares, beyond = [], []
            for s, alone in zip(spreads, less, strict=True):
                between = s.between(both)
                shares.append(float(np.mean(between / s.total)))
                beyond.append((between - alone) / s.total)
            explained, by_chance = shares
            p = tail(float(beyond[0][0]), beyond[1])
            part = deviation * max(explained - by_chance, 0.0) ** 0.5
            found.append(Place(channel, name, unit, span, share, samples, explained, by_chance, p, False, part))
        found += [
            Place(channel, f.name, "Hz", f.range, f.share, f.background, f.explained, f.chance, f.p, False,
                  deviation * max(f.explained - f.chance, 0.0) ** 0.5)
            for f in frequencies(parts, surrogates_of_runs, thin)
        ]  # fmt: skip
    adjusted = false_discovery_control([f.p for f in found])  # Benjamini and Hochberg
    marked = [replace(f, significant=bool(p <= FALSE_DISCOVERY_RATE)) for f, p in zip(found, adjusted, strict=True)]
    return sorted(marked, key=lambda f: (not f.significant, f.chance - f.explained))


def axes_of(places: Sequence[Coordinates], unit: str, load_unit: str) -> list[tuple[str, str, FloatArray]]:
    """Name, unit and values (all runs joined) of each coordinate that the runs have."""

    def joined(name: str) -> FloatArray:
        return np.concatenate([getattr(p, name) for p in places])

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


def bins(values: FloatArray, count: int = BINS) -> NDArray[np.int_] | None:
    """Number of the quantile bin of each sample; None for a coordinate that stands still."""
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, count + 1)))
    if edges.size < 3:
        levels = np.unique(values)
        return np.searchsorted(levels, values) if 1 < levels.size <= count else None
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)


class _Spread:
    """Sums of squares of columns about their means: in all, and of the means of bins."""

    def __init__(self, columns: FloatArray) -> None:
        self.centred = columns - columns.mean(axis=0)
        self.total = np.maximum(np.sum(self.centred**2, axis=0), 1e-300)

    def between(self, number: NDArray[np.int_]) -> FloatArray:
        return np.sum((_membership(number) @ self.centred) ** 2, axis=0)


def _membership(number: NDArray[np.int_]) -> csr_array:
    """Matrix (bins, n) that sums each bin and divides by the root of its count."""
    weight = 1.0 / np.sqrt(np.maximum(np.bincount(number), 1))[number]
    return csr_array((weight, (number, np.arange(number.size))))


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
    low, high = np.quantile(values[inside], [0.005, 0.995])  # a derivative may begin with an outlier
    span = (float(low), float(high))
    return span, float(energy[at[0] : at[1]].sum()), float(share[at[0] : at[1]].sum())
