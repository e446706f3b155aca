"""The readings that the print of MMT 2015 allows, and what its own LuGre numbers say about them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ...models.laws.friction_branches import pull_level, release_level
from ..motions import ImposedMotion, friction

MODEL = "SingleTsmLuGre"
PRESETS = {"printed": "published", "swapped": "swapped"}
"""Order of the pull branches, Eqs (7) and (8)."""
EQUATIONS = {"Eqs (10)-(12)": 1.0, "Eq. (9)": -1.0}
"""Sign of mu3: Eq (9) is Eqs (10) and (11) with the other sign."""


def signed_level(p: Any, v: float, a: float, sgn_a: float) -> float:
    """S of Eqs (7), (8), (10), (11) with its sign, as printed."""
    if v >= 0.0:
        mu2 = p.mu2 if sgn_a * (1.0 if p.swap_branches else -1.0) > 0.0 else 0.0
        return pull_level(v, a, p.rho1, p.mu1, mu2, p.kappa1, p.kappa2, p.kappa3)
    return release_level(v, a, sgn_a, p.rho2, p.mu3, p.kappa4, p.kappa5)


def blow_up(equation: str, parts: tuple[tuple[float, float], ...], stop: float) -> float:
    """Time [s] at which Eq (5) with S as printed loses zeta to infinity; ``stop`` if it does not."""
    p = kernel(MODEL).params("published", {"mu3": EQUATIONS[equation] * kernel(MODEL).params("published").mu3})

    def rate(t: float, zeta: FloatArray) -> list[float]:
        v = sum(x * math.tau * f * math.cos(math.tau * f * t) for x, f in parts)
        a = -sum(x * (math.tau * f) ** 2 * math.sin(math.tau * f * t) for x, f in parts)
        w = v + p.lambda_ * float(np.sign(a))
        r = zeta[0] / signed_level(p, v, a, float(np.sign(a)))
        return [p.rho * (w - abs(w) * r * abs(r))]

    def lost(_: float, zeta: FloatArray) -> float:
        return abs(zeta[0]) - 1e5

    lost.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    run = solve_ivp(rate, (0.0, stop), [0.0], events=lost, method="Radau", rtol=1e-8, atol=1e-10, max_step=5e-3)
    return float(run.t[-1])


def fitted_lugre(motion: ImposedMotion, force: FloatArray, scored: Any) -> tuple[dict[str, float], float]:
    """LuGre set of least mean square difference from a force, from the published one, and that difference [N2]."""
    names = ("sigma0", "sigma1", "sigma2", "F_c", "F_s", "v_s")
    first = kernel("LuGreFriction").params("mmt2015")

    def residual(logs: FloatArray) -> FloatArray:
        values = dict(zip(names, np.exp(logs), strict=True))
        return (friction("LuGreFriction", motion, "mmt2015", **values) - force)[scored]

    start = np.log([getattr(first, name) for name in names])
    fit = least_squares(residual, start, bounds=(start - 5.0, start + 3.0), x_scale=0.3, max_nfev=60)
    return dict(zip(names, np.exp(fit.x).tolist(), strict=True)), float(np.mean(fit.fun**2))
