"""Mean of a residual over a coordinate, with intervals that allow for autocorrelation: data for a plot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...kernels.arrays import FloatArray, IntArray
from ...regression.uncertainty import autocorrelation_time
from ..evidence import Dependence
from ..runs.motion_signals import Coordinates
from .locate import axes_of, bins

BINS = 14
RESAMPLES = 400
LEVEL = 0.9
"""Of the intervals of a dependence."""


def dependence(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], coordinate: str, motion_unit: str, load_unit: str,
    seed: int = 0,
) -> list[Dependence]:  # fmt: skip
    """Mean of the residual in bins of a coordinate, one curve for each direction unless the coordinate knows it."""
    name, unit, values = next(a for a in axes_of(places, motion_unit, load_unit) if a[0] == coordinate)
    residual, s = np.concatenate(list(residuals)), np.concatenate([c.s for c in places])
    sides = {"": np.full(s.size, True)} if name in ("v", "sgn v") else {"forth": s > 0.0, "back": s < 0.0}
    found = []
    for side, inside in sides.items():
        if inside.sum() < 4 * BINS or (number := bins(values[inside], BINS)) is None:
            continue
        _, number = np.unique(number, return_inverse=True)  # bins may be empty where many values are equal
        blocks = _blocks(residuals, residual[inside] - _means(number, residual[inside])[number])[inside]
        low, high = _interval(number, residual[inside], blocks, seed)
        at, mean = _means(number, values[inside]), _means(number, residual[inside])
        found.append(Dependence(name, unit, side, at, mean, low, high))
    return found


def _means(number: IntArray, values: FloatArray) -> FloatArray:
    return np.bincount(number, values) / np.maximum(np.bincount(number), 1)


def _blocks(residuals: Sequence[FloatArray], unexplained: FloatArray) -> IntArray:
    """Number of the block of each sample: several autocorrelation times of what no bin explains, eight a run."""
    length = math.ceil(4.0 * autocorrelation_time(unexplained))
    found, first = [], 0
    for r in residuals:
        count = max(8, r.size // max(length, 1)) if r.size >= 8 else 1
        found.append(first + np.arange(r.size) * count // r.size)
        first += count
    return np.concatenate(found)


def _interval(number: IntArray, residual: FloatArray, block: IntArray, seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    _, block = np.unique(block, return_inverse=True)
    count, width = int(block.max()) + 1, int(number.max()) + 1
    cell = block * width + number
    total = np.bincount(cell, residual, count * width).reshape(count, width)
    samples = np.bincount(cell, minlength=count * width).reshape(count, width)
    weight = rng.multinomial(count, np.full(count, 1.0 / count), RESAMPLES).astype(float)  # integers have no BLAS
    drawn = weight @ samples
    resampled = (weight @ total) / np.where(drawn > 0.0, drawn, np.nan)
    low, high = np.nanquantile(resampled, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], axis=0)
    return low, high
