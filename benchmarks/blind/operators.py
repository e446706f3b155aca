"""Operators with memory on a fine grid: stop elements, play, a first-order lag, a second-order resonance."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.special import gammaincinv

from .motions import FloatArray

ELEMENTS = 32


@njit(cache=False)
def _stops(x: FloatArray, force: FloatArray, reach: FloatArray, start: FloatArray) -> FloatArray:
    e = start * reach
    total = np.empty(x.size)
    for k in range(x.size):
        dx = x[k] - x[k - 1] if k else 0.0
        total[k] = 0.0
        for i in range(e.size):
            e[i] = min(max(e[i] + dx, -reach[i]), reach[i])
            total[k] += force[i] * e[i] / reach[i]
    return total


def maxwell_slip(x: FloatArray, length: float) -> FloatArray:
    """Sum of stop (Maxwell slip) elements in [-1, 1], their reaches spread for an exponential reversal curve.

    A curve that leaves saturation has 1 - 2 exp(-d/length) after the travel d. For that the stiffness per reach
    D = 2 Delta is 2 exp(-D/length)/length**2. Each element has the force and the stiffness of its part of that spread.
    One of each two alike starts at either end: no force at first, and the first curve is half of the reversal
    curve. Inner loops close (Prandtl-Ishlinskii).
    """
    part = 0.5 - 0.5 * np.cos(np.pi * np.arange(ELEMENTS + 1) / ELEMENTS)  # finer at both ends
    edges = gammaincinv(2.0, part)
    force, stiffness = np.diff(part), -2.0 * np.diff(np.exp(-edges))
    return _stops(
        x, np.repeat(0.5 * force, 2), np.repeat(length * force / stiffness, 2), np.tile([1.0, -1.0], ELEMENTS)
    )


def even_slip(x: FloatArray, reach: FloatArray, force: FloatArray) -> FloatArray:
    """Sum of stop elements with given reaches and forces, relaxed at the start."""
    return _stops(x, np.asarray(force, float), np.asarray(reach, float), np.zeros(len(reach)))


@njit(cache=False)
def play(x: FloatArray, half: float) -> FloatArray:
    """Output of a gap of half width ``half``, centred at the start."""
    y = np.empty(x.size)
    y[0] = x[0]
    for k in range(1, x.size):
        y[k] = min(max(y[k - 1], x[k] - half), x[k] + half)
    return y


@njit(cache=False)
def lag(u: FloatArray, step: float, tau: float, start: float) -> FloatArray:
    """First-order lag by the trapezoidal rule."""
    y = np.empty(u.size)
    y[0] = start
    r = step / (2.0 * tau)
    for k in range(1, u.size):
        y[k] = ((1.0 - r) * y[k - 1] + r * (u[k] + u[k - 1])) / (1.0 + r)
    return y


@njit(cache=False)
def approach(level: FloatArray, x: FloatArray, stiffness: float) -> FloatArray:
    """Force that approaches the level, with the sign of the motion, at ``stiffness`` over the travel."""
    f = np.zeros(x.size)
    for k in range(1, x.size):
        dx = x[k] - x[k - 1]
        end = level[k] if dx > 0.0 else -level[k]
        f[k] = end + (f[k - 1] - end) * np.exp(-abs(dx) * stiffness / level[k])
    return f


@njit(cache=False)
def resonance(u: FloatArray, step: float, rate: float, damping: float) -> FloatArray:
    """Deflection of y'' + 2 damping rate y' + rate**2 y = rate**2 u, less u (symplectic Euler)."""
    y, w = u[0], 0.0
    out = np.empty(u.size)
    for k in range(u.size):
        w += step * (rate * rate * (u[k] - y) - 2.0 * damping * rate * w)
        y += step * w
        out[k] = y - u[k]
    return out


@njit(cache=False)
def hold_time(v: FloatArray, step: float, still: float) -> tuple[FloatArray, FloatArray]:
    """Length of the last hold [s] and travel since its end, row by row."""
    held, gone, hold, travel = np.empty(v.size), np.empty(v.size), 0.0, 0.0
    resting = True
    for k in range(v.size):
        if abs(v[k]) < still:
            if not resting:
                hold = 0.0
            resting = True
            hold += step
            travel = 0.0
        else:
            resting = False
            travel += abs(v[k]) * step
        held[k], gone[k] = hold, travel
    return held, gone


@njit(cache=False)
def two_temperatures(power: FloatArray, step: float, tau1: float, tau2: float) -> FloatArray:
    """Temperature of a small body that power heats and a larger one cools; steady value 1 at mean power 1."""
    t1, t2 = 0.0, 0.0
    out = np.empty(power.size)
    for k in range(power.size):
        flow = (t1 - t2) / tau1
        t1 += step * (0.5 * power[k] / tau1 - flow)
        t2 += step * (flow * tau1 - t2) / tau2
        out[k] = t1
    return out
