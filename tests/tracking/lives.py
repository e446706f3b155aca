"""Lives of a friction joint made without the library: Maxwell-slip elements, whose levels change as a test says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tsm_fmu import Record

RATE = 100.0
LEVELS = np.array([0.231, 0.417, 0.673, 0.919])
"""Slip levels of the elements [N]; together the Coulomb friction."""
STIFFNESS = np.array([1310.0, 893.0, 577.0, 401.0])
"""Of the elements [N/m]."""
NOISE = 0.023


def friction(x: np.ndarray, level: float, viscous: float, stiff: float = 1.0) -> np.ndarray:
    """Force [N] over the position [m]: parallel springs that slip, and viscous friction."""
    limits = level * LEVELS
    springs, force, last = np.zeros(4), np.empty_like(x), x[0]
    for k, now in enumerate(x):
        springs = np.clip(springs + stiff * STIFFNESS * (now - last), -limits, limits)
        force[k], last = springs.sum(), now
    return force + viscous * np.gradient(x, 1.0 / RATE)


def life(
    levels: Sequence[float], seed: int = 7, *, viscous: float = 4.7, between: float = 0.004, seconds: float = 9.0,
    stiff: Sequence[float] = (),
) -> list[Record]:  # fmt: skip
    """One run for each level (1: new), each with a motion, a noise and a seat in the rig of its own.

    `stiff` is the part of the strands that hold, run by run.
    """
    rng = np.random.default_rng(seed)
    runs = []
    for number, level in enumerate(levels, 1):
        t = np.arange(0.0, seconds, 1.0 / RATE)
        slow, fast, phase = rng.uniform(1.1, 1.6), rng.uniform(3.1, 4.9), rng.uniform(0.0, 6.0)
        x = 0.043 * np.sin(slow * t + phase) + 0.019 * np.sin(fast * t)
        seat = 1.0 + between * rng.standard_normal()
        coloured = np.convolve(rng.standard_normal(t.size + 4), np.full(5, 0.2), "valid")
        force = friction(x, level * seat, viscous, stiff[number - 1] if stiff else 1.0) + NOISE * (
            rng.standard_normal(t.size) + coloured
        )
        velocity = np.gradient(x, 1.0 / RATE)
        runs.append(Record(f"day_{number:02d}", t, {"v": velocity, "x": x, "F": force},
                           {"v": "m/s", "x": "m", "F": "N"}))  # fmt: skip
    return runs
