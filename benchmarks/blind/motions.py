"""Excitations on a fine time grid: modulated sines, chirps, strokes with holds, nested reversals, work and rest.

Every motion starts at rest. Amplitudes are per unit: a plant scales them to its stroke.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

KINDS = ("sines", "chirp", "strokes", "nested", "work_rest", "slow", "steady")


@dataclass(frozen=True)
class Motion:
    """Position per unit of stroke over time, and its two derivatives.

    Attributes
    ----------
    t, x, v, a : ndarray, shape (n,)
        Time [s], position [stroke], speed [stroke/s], acceleration [stroke/s2].
    """

    t: FloatArray
    x: FloatArray
    v: FloatArray
    a: FloatArray


def motion(kind: str, duration: float, step: float, pace: float, rng: np.random.Generator) -> Motion:
    """One excitation.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    duration : float
        Length [s].
    step : float
        Step of the fine grid [s].
    pace : float
        Speed of the whole motion: 1 makes strokes of about 2 s.
    rng : numpy.random.Generator
    """
    t = np.arange(round(duration / step) + 1, dtype=np.float64) * step
    if kind == "sines":
        x = _sines(t, pace, rng)
    elif kind == "chirp":
        x = _chirp(t, pace, rng)
    elif kind == "slow":
        x = _eased(t, 1.0 - np.cos(2.0 * np.pi * 0.11 * pace * rng.uniform(0.9, 1.1) * t)) - 1.0
        x = x - x[0]
    elif kind == "steady":
        x = _sines(t, pace, rng, plain=True)
    else:
        x = _turning_points(kind, t, duration, pace, rng)
    v = np.gradient(x, step)
    return Motion(t, x, v, np.gradient(v, step))


def _eased(t: FloatArray, x: FloatArray, rise: float = 0.6) -> FloatArray:
    return x * _minimum_jerk(np.clip(t / rise, 0.0, 1.0))


def _minimum_jerk(q: FloatArray) -> FloatArray:
    return q**3 * (10.0 - 15.0 * q + 6.0 * q**2)


def _sines(t: FloatArray, pace: float, rng: np.random.Generator, plain: bool = False) -> FloatArray:
    """A sine that swells and quickens and slackens: no reversal within a small part of the stroke of the one before."""
    rate = pace * 0.5 * rng.uniform(0.9, 1.1)
    side = rng.choice([-1.0, 1.0])
    if plain:
        return side * _eased(t, 0.8 * np.sin(2.0 * np.pi * rate * t))
    slow, swell = pace * rng.uniform(0.055, 0.075), pace * rng.uniform(0.08, 0.11)
    phase = 2.0 * np.pi * rate * t + rng.uniform(2.0, 3.0) * (1.0 - np.cos(2.0 * np.pi * slow * t))
    return side * _eased(t, (0.66 + 0.3 * np.sin(2.0 * np.pi * swell * t + rng.uniform(0.0, 6.28))) * np.sin(phase))


def _chirp(t: FloatArray, pace: float, rng: np.random.Generator) -> FloatArray:
    low, high = 0.12 * pace * rng.uniform(0.9, 1.1), 1.9 * pace * rng.uniform(0.9, 1.1)
    span, growth = t[-1], np.log(high / low)
    phase = 2.0 * np.pi * low * span / growth * np.expm1(growth * t / span)
    return _eased(t, 0.8 * (low * np.exp(growth * t / span) / low) ** -0.55 * np.sin(phase))


def _turning_points(kind: str, t: FloatArray, duration: float, pace: float, rng: np.random.Generator) -> FloatArray:
    """Minimum-jerk moves between points, with holds between them."""
    x, now, at, k = np.zeros(t.size), 0.0, 0.15, 0
    resting = (0.38 * duration, 0.72 * duration)
    while at < duration:
        target, time, hold = _next_move(kind, k, now, pace, rng)
        if kind == "work_rest" and resting[0] < at < resting[1]:
            at = resting[1]
            x[t >= at - 1e-9] = now
            continue
        inside = (t >= at) & (t < at + time)
        x[inside] = now + (target - now) * _minimum_jerk((t[inside] - at) / time)
        x[t >= at + time] = target
        now, at, k = target, at + time + hold, k + 1
    return x


def _next_move(kind: str, k: int, now: float, pace: float, rng: np.random.Generator) -> tuple[float, float, float]:
    side = 1.0 if k % 2 == 0 else -1.0
    if kind == "nested":
        size = (1.0, 0.82, 0.62, 0.44, 0.27, 0.13, 0.25, 0.5)[k % 8] * rng.uniform(0.93, 1.05)
        return side * size, (0.35 + 0.9 * abs(side * size - now)) / pace, 0.02
    if kind == "strokes":
        hold = float((0.05, 0.2, 0.6, 1.6, 3.1)[k * 3 % 5] * rng.uniform(0.9, 1.1))
        return side * rng.uniform(0.55, 1.0), rng.choice([0.5, 0.9, 1.7]) * rng.uniform(0.9, 1.1) / pace, hold
    return side * rng.uniform(0.75, 1.0), rng.uniform(0.5, 0.8) / pace, 0.03
