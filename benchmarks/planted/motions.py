"""Easy motions: each shows what some effect needs. Position per half stroke, at rest at the start."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DT = 0.01


def motion(kind: str, rows: int, pace: float, rng: np.random.Generator) -> Array:
    """Position, between -1 and 1.

    Parameters
    ----------
    kind : str
        ``sines``, ``sweep``, ``strokes`` (with holds), ``nested``, ``paced`` (the same, every third move slow) or
        ``work_rest``.
    rows : int
        Samples, `DT` apart.
    pace : float
        1 makes moves of about a second.
    rng : numpy.random.Generator
    """
    t = np.arange(rows, dtype=np.float64) * (DT * pace)
    if kind == "sines":
        phases = rng.uniform(0.0, 6.28, 3)
        x = sum(
            amplitude * np.sin(2.0 * np.pi * f * t + p)
            for amplitude, f, p in zip((0.5, 0.3, 0.2), (0.17, 0.43, 1.07), phases, strict=True)
        )
        return np.minimum(t / 0.5, 1.0) ** 2 * x
    if kind == "sweep":
        turns = 0.2 / np.log(12.0) * t[-1] * np.expm1(np.log(12.0) * t / t[-1])
        return np.minimum(t / 0.5, 1.0) ** 2 * (1.0 - 0.6 * t / t[-1]) * np.sin(2.0 * np.pi * turns)
    return _moves(kind, t, rng)


def _moves(kind: str, t: Array, rng: np.random.Generator) -> Array:
    """Smooth moves between points, with holds."""
    x, now, at, k = np.zeros(t.size), 0.0, 0.2, 0
    while at < t[-1]:
        side = 1.0 if k % 2 == 0 else -1.0
        size, hold = rng.uniform(0.6, 1.0), (0.05, 0.3, 1.1, 2.3)[k % 4]
        if kind in ("nested", "paced"):
            size, hold = (1.0, 0.75, 0.5, 0.3, 0.15, 0.4, 0.6)[k % 7], 0.03
        if kind == "work_rest":
            hold = 0.4 * t[-1] if at > 0.3 * t[-1] and x[-1] != 0.0 and at < 0.5 * t[-1] else 0.03
        length = 0.35 + 0.7 * abs(side * size - now) * rng.uniform(0.6, 1.4)
        length *= 4.0 if kind == "paced" and k % 3 == 1 else 1.0
        q = np.clip((t - at) / length, 0.0, 1.0)
        x = np.where(t >= at, now + (side * size - now) * q**3 * (10.0 - 15.0 * q + 6.0 * q**2), x)
        now, at, k = side * size, at + length + hold, k + 1
    return x
