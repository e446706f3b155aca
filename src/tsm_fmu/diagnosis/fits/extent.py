"""Shapes of an effect to begin from: what a motion could show of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from types import ModuleType

import numpy as np
from scipy.stats import qmc

from ...effects import shapes_of, starts_of
from ...effects.about import Scale, Shape, Start
from ...kernels.arrays import FloatArray
from ..criteria import SHAPE_RANGE_RATIO, WIDTH_RATIO
from ..runs.motion_signals import Coordinates

SHAPES = 7
"""Shapes tried for each shape parameter of an effect."""
EVENLY: tuple[Scale, ...] = ("position", "centre", "angle", "width", "share")
"""Scales over which shapes are spread evenly, and not over the logarithm."""


def quantiles(module: ModuleType) -> FloatArray:
    """Quantiles of the ranges of an effect's shape parameters to begin from, shape (n, shapes)."""
    shapes = shapes_of(module)
    if not shapes:
        return np.empty((1, 0))
    count = max(SHAPES * min(len(shapes), 3), *(shape.tries for shape in shapes.values()))
    return qmc.Halton(len(shapes), rng=7).random(count)


def turn_of(module: ModuleType) -> str | None:
    """Shape parameter of an effect that is the length of a turn; None of one without."""
    return next((name for name, shape in shapes_of(module).items() if shape.scale == "turns"), None)


class Extent:
    """Sizes of a motion, from which shape parameters are drawn."""

    def __init__(self, signals: Sequence[Coordinates]) -> None:
        loads = [c.load for c in signals if c.load is not None]
        span = max(float(np.ptp(c.x)) for c in signals) or 1.0
        speed, acceleration = (
            float(np.sqrt(np.mean(np.concatenate([getattr(c, n) for c in signals]) ** 2))) or 1.0 for n in ("v", "a")
        )
        self.lowest = min(float(np.min(c.x)) for c in signals)
        self.highest = max(float(np.max(c.x)) for c in signals)
        self.scales: dict[Scale, float] = {
            "stroke": span,
            "per stroke": 1.0 / span,
            "travel": max(float(np.sum(np.abs(np.diff(c.x)))) for c in signals) or 1.0,
            "speed": speed,
            "acceleration": acceleration,
            "time": max(float(np.ptp(c.time)) for c in signals),
            "load": float(np.max(np.abs(np.concatenate(loads)))) if loads else 1.0,
        }

    def at_quantile(self, shape: Shape, q: float) -> float:
        """Value of a shape parameter at the quantile ``q`` of its range."""
        if shape.scale == "turns":
            return self._turns_of(shape.lo + (shape.hi - shape.lo) * q)
        if shape.scale in EVENLY:
            share = shape.lo + (shape.hi - shape.lo) * q
            of_stroke = shape.scale in ("position", "centre")
            return self.lowest + (self.highest - self.lowest) * share if of_stroke else share
        return self.scales.get(shape.scale, 1.0) * shape.lo * (shape.hi / shape.lo) ** q

    def shapes(self, module: ModuleType) -> list[dict[str, float]]:
        """Values of an effect's shape parameters: spread over what these runs could show."""
        return [self.shape_at(module, row) for row in quantiles(module)]

    def shape_at(self, module: ModuleType, quantiles: Sequence[float]) -> dict[str, float]:
        """Values of an effect's shape parameters at quantiles of their ranges."""
        shapes = shapes_of(module).items()
        return {n: self.at_quantile(shape, float(q)) for (n, shape), q in zip(shapes, quantiles, strict=True)}

    def starts(self, module: ModuleType) -> list[dict[str, float]]:
        """Values of an effect's states at the start of a run to begin from; a single, empty one where it has none."""
        starts = starts_of(module)
        return [dict(zip(starts, values, strict=True)) for values in product(*map(self.states, starts.values()))]

    def quantile_of_turn(self, shape: Shape, size: float) -> float:
        """Quantile of the range of a shape parameter that is the length of a turn, for a turn of this size."""
        return (self._turns_of(size) - shape.lo) / (shape.hi - shape.lo)

    def _turns_of(self, size: float) -> float:
        """Turns of a size in the stroke, and so also the size of as many turns."""
        return (self.highest - self.lowest or 1.0) / (2.0 * math.pi * size)

    def states(self, start: Start) -> list[float]:
        """Values of a state at the start of a run to begin from."""
        return [self.scales.get(start.scale, 1.0) * value for value in start.tries]

    def limits(self, shape: Shape) -> tuple[float, float] | None:
        """Range that a refit may use; None for that of the declaration."""
        if shape.scale in ("angle", "share", "number"):
            return None
        if shape.scale == "width":
            return shape.lo / WIDTH_RATIO, shape.hi * WIDTH_RATIO
        lo, hi = self.at_quantile(shape, 0.0), self.at_quantile(shape, 1.0)
        if shape.scale == "turns":
            return hi, lo  # a drum of fewer turns is no drum: any smooth function of the position
        if shape.scale in EVENLY:
            middle, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
            return middle - SHAPE_RANGE_RATIO * half, middle + SHAPE_RANGE_RATIO * half
        return lo / SHAPE_RANGE_RATIO, hi * SHAPE_RANGE_RATIO
