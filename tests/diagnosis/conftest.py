"""Runs of a friction rig in closed form, for the tests of the diagnosis: nothing of the package makes them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tsm_fmu.regression.problem import FitRun

DT, LEVEL, X_PRE, VISCOUS = 0.01, 0.73, 0.0067, 0.117

Rig = Callable[..., FitRun]


def hyperbolic(x: np.ndarray) -> np.ndarray:
    """Presliding dz/dx = (1 - s z)^2 / X_PRE: exactly 1 - s z = u / (1 + u d/X_PRE) after d."""
    z = np.zeros(x.size)
    for k in range(1, x.size):
        d = x[k] - x[k - 1]
        s = np.sign(d)
        u = 1.0 - s * z[k - 1]
        z[k] = s * (1.0 - u / (1.0 + u * abs(d) / X_PRE))
    return z


def exponential(x: np.ndarray, reach: float = X_PRE) -> np.ndarray:
    """Dahl's presliding dz/dx = (1 - s z) / reach, exactly."""
    z = np.zeros(x.size)
    for k in range(1, x.size):
        d = x[k] - x[k - 1]
        s = np.sign(d)
        z[k] = s + (z[k - 1] - s) * np.exp(-abs(d) / reach)
    return z


@pytest.fixture(scope="session")
def rig() -> Rig:
    """``rig(seed, ...)``: F = LEVEL z + VISCOUS v over a motion of three sines, with noise, for ``LuGreFriction``."""

    def run(
        seed: int, *, pace: float = 1.0, inertia: float = 0.0, noise: float = 0.004, rows: int = 2000,
        presliding: Callable[[np.ndarray], np.ndarray] = exponential,
        instrument: Callable[[np.ndarray], np.ndarray] = lambda y: y,
    ) -> FitRun:  # fmt: skip
        rng = np.random.default_rng(seed)
        t, phases = np.arange(rows) * DT, rng.random(3) * 6.0
        v = np.zeros(rows)
        for amplitude, f, p in zip((1.1, 0.6, 0.4), (0.13, 0.37, 1.31), phases, strict=True):
            v += pace * amplitude * np.sin(2 * np.pi * f * pace * t + p)
        force = LEVEL * presliding(np.cumsum(v) * DT) + VISCOUS * v + inertia * np.gradient(v, DT)
        force = instrument(force) + noise * rng.normal(size=rows)
        return FitRun(f"run{seed}", t, v[:, None], force[:, None])

    return run


@pytest.fixture(scope="session")
def known() -> dict[str, float]:
    """Parameters of ``LuGreFriction`` near those of `rig`."""
    return {"sigma0": 100.0, "sigma1": 0.0, "sigma2": 0.1, "F_c": 0.7, "F_s": 0.7, "v_s": 0.3}


@pytest.fixture(scope="session")
def hyperbola() -> Callable[[np.ndarray], np.ndarray]:
    return hyperbolic
