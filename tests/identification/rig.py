"""A tendon drive made of scipy and numpy only: the tests' truth owes nothing to the code under test."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from tsm_fmu.regression.problem import FitRun

RATE = 200.0
TRUE = {"c": 0.9137, "beta": -0.3871, "alpha": 13.7}


def motion(seed: int, seconds: float = 12.0) -> tuple[np.ndarray, np.ndarray]:
    """Time and position of two sines with periods that do not divide."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / RATE)
    slow, fast, phase = rng.uniform(1.3, 1.9), rng.uniform(3.8, 5.7), rng.uniform(0.0, 6.0)
    return t, 0.41 * np.sin(slow * t + phase) + 0.17 * np.sin(fast * t)


def backlash_run(
    name: str,
    seed: int,
    *,
    x_0: float = -1.2617,
    x_h_0: float = 0.0113,
    noise: float = 0.0,
    encoder: float = 0.0,
    true: dict[str, float] = TRUE,
    seconds: float = 12.0,
) -> FitRun:
    """MSSP 2015 Eqs (9), (10) integrated by solve_ivp; first-order coloured noise and encoder steps on the output."""
    t, x = motion(seed, seconds)

    x_h = np.empty_like(x)
    x_h[0] = x_h_0
    for k in range(t.size - 1):  # the input moves evenly from sample to sample
        v = (x[k + 1] - x[k]) * RATE
        x_h[k + 1] = solve_ivp(_slope, (0.0, 1.0 / RATE), [x_h[k]], rtol=1e-8, atol=1e-11, args=(v, true)).y[0, -1]
    y = true["c"] * x + x_h + x_0
    y = y + coloured(t.size, noise, seed + 1)
    if encoder:
        y = encoder * np.round(y / encoder)
    return FitRun(name, t, x[:, None], y[:, None])


def _slope(_: float, x_h: np.ndarray, v: float, true: dict[str, float]) -> np.ndarray:
    return true["beta"] * v - true["alpha"] * abs(v) * x_h


def coloured(count: int, deviation: float, seed: int, pole: float = 0.9) -> np.ndarray:
    """First-order autoregressive noise, stationary from its first sample."""
    white = np.random.default_rng(seed).standard_normal(count + 200)
    return deviation * np.sqrt(1.0 - pole**2) * lfilter([1.0], [1.0, -pole], white)[200:]
