"""The printed equations of the friction and backlash models, in scalars, for scipy's ``solve_ivp``.

Nothing of the kernels but the numbers of a parameter set is used here: each function takes a kernel's ``Params`` and
gives the rate of its one state, and its output at the samples. `Sines` is the motion that drives both sides, in closed
form, so that ``solve_ivp`` interpolates no log.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from math import copysign, exp
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Rate = Callable[[float, float, float], float]


class Sines:
    """Sum of two sines, amplitude and frequency [Hz] each, sampled at ``time``."""

    def __init__(self, parts: Sequence[tuple[float, float]], time: Array) -> None:
        (self._a, f), (self._b, g) = parts
        self._u, self._w, self.time = 2.0 * math.pi * f, 2.0 * math.pi * g, time

    def x(self, t: float) -> float:
        return self._a * math.sin(self._u * t) + self._b * math.sin(self._w * t)

    def v(self, t: float) -> float:
        return self._a * self._u * math.cos(self._u * t) + self._b * self._w * math.cos(self._w * t)

    def a(self, t: float) -> float:
        return -self._a * self._u**2 * math.sin(self._u * t) - self._b * self._w**2 * math.sin(self._w * t)

    @cached_property
    def columns(self) -> dict[str, Array]:
        """Samples by input name."""
        t = self.time.tolist()
        x, v, a = (np.array([signal(s) for s in t]) for signal in (self.x, self.v, self.a))
        return {"x": x, "x_in": x, "v": v, "a": a}


class Equations(NamedTuple):
    """Rate of the state over (state, v, a), and the output from the state and the samples of the motion."""

    rate: Rate
    output: Callable[[Array, dict[str, Array]], Array]
    needs_a: bool = True


def _pull_and_release(p: Any, swap: bool) -> Callable[[float, float], float]:
    """ICINCO 2013 Eqs (2a)-(2d); without ``swap`` of the pull branches MMT 2015 Eqs (7)-(11)."""
    rho1, rho2, mu1, mu2, mu3 = p.rho1, p.rho2, p.mu1, p.mu2, p.mu3
    kappa1, kappa2, kappa3, kappa4, kappa5 = p.kappa1, p.kappa2, p.kappa3, p.kappa4, p.kappa5

    def level(v: float, a: float) -> float:
        if v < 0.0:
            return rho2 - copysign(1.0, a) * mu3 * exp(kappa4 * v / (abs(a) + kappa5))
        pull = rho1 + mu1 * exp(-kappa1 * v / (kappa2 * abs(a) + 1.0))
        return pull + mu2 * (1.0 - exp(-kappa3 * abs(a))) if (a >= 0.0) is swap else pull

    return level


def dahl(p: Any) -> Equations:
    """ICINCO 2013 Eqs (4), (5)."""
    sigma, level = p.sigma, _pull_and_release(p, swap=True)
    return Equations(lambda z, v, a: v - sigma * abs(v) * z / level(v, a), lambda z, _: sigma * z)


def modified_lugre(p: Any) -> Equations:
    """MMT 2015 Eqs (5), (13), with |S|."""
    rho, lead, sigma0, signed = p.rho, p.lambda_, p.sigma0, _pull_and_release(p, swap=bool(p.swap_branches))

    def rate(z: float, v: float, a: float) -> float:
        w, y = v + copysign(1.0, a) * lead, z / abs(signed(v, a))
        return rho * (w - abs(w) * y * abs(y))

    return Equations(rate, lambda z, _: sigma0 * z)


def _shape(w: float, y: float, sigma: float, n: float) -> float:
    """Right side of Bouc-Wen, IFToMM 2013 Eq (2), MSSP 2015 Eq (6)."""
    power = abs(y) ** n
    return w - sigma * abs(w) * copysign(power, y) + (sigma - 1.0) * w * power


def bouc_wen(p: Any) -> Equations:
    """IFToMM 2013 Eqs (1)-(3)."""
    rho1, rho2, mu1, mu2, mu3, mu4 = p.rho1, p.rho2, p.mu1, p.mu2, p.mu3, p.mu4
    kappa1, kappa2, kappa3, kappa4, kappa5, kappa6 = p.kappa1, p.kappa2, p.kappa3, p.kappa4, p.kappa5, p.kappa6
    k, sigma, n = p.k, p.sigma, p.n

    def rate(z: float, v: float, a: float) -> float:
        if v < 0.0:
            branch = copysign(mu4, a) * exp(kappa5 * v / (abs(a) + kappa6))
            return k * _shape(v, z / (rho2 + mu3 * exp(kappa4 * v) - branch), sigma, n)
        level = rho1 + mu1 * exp(-kappa1 * v / (kappa2 * abs(a) + 1.0))
        level += mu2 * (1.0 - exp(-kappa3 * a)) if a >= 0.0 else 0.0
        return k * _shape(v, z / level, sigma, n)

    return Equations(rate, lambda z, _: z)


def lugre(p: Any) -> Equations:
    """AME 2020 Eq (40), MMT 2015 Eqs (2)-(4)."""
    sigma0, sigma1, sigma2, coulomb, static, v_s = p[:6]

    def rate(z: float, v: float, _: float) -> float:
        return v - sigma0 * abs(v) * z / (coulomb + (static - coulomb) * exp(-((v / v_s) ** 2)))

    def force(z: Array, motion: dict[str, Array]) -> Array:
        v = motion["v"]
        level = coulomb + (static - coulomb) * np.exp(-((v / v_s) ** 2))
        return sigma0 * z + sigma1 * (v - sigma0 * np.abs(v) * z / level) + sigma2 * v

    return Equations(rate, force, needs_a=False)


def paired_friction(p: Any) -> Equations:
    """MSSP 2015 Eqs (6), (7)."""
    rho, lead, sigma, n = p.rho, p.lambda_, p.sigma, p.n

    def force(z: Array, motion: dict[str, Array]) -> Array:
        x, v, a = motion["x"], motion["v"], motion["a"]
        up, down = np.exp(v), np.exp(-v)
        k_x = 0.5 * p.k_x * (2.0 * up + 2.0 * down * np.sign(x) * np.sign(a)) / (up + down)
        return p.force_scale * (k_x * x + p.k_zeta * z + p.upsilon * v + p.F_0)

    return Equations(lambda z, v, a: rho * _shape(v + copysign(1.0, a) * lead, z, sigma, n), force)


def backlash(p: Any) -> Equations:
    """MSSP 2015 Eqs (9), (10)."""
    beta, alpha = p.beta, p.alpha
    return Equations(
        lambda z, v, _: beta * v - alpha * abs(v) * z, lambda z, motion: p.c * motion["x"] + z + p.x_0, needs_a=False
    )


def solved(
    equations: Equations,
    motion: Sines,
    method: str,
    rtol: float,
    size: float = 1.0,
    step: float = math.inf,
    held: bool = False,
) -> Array:
    """Output at the samples by ``solve_ivp`` from a state of 0.

    Parameters
    ----------
    equations : Equations
    motion : Sines
    method : str
    rtol : float
        The absolute tolerance is a thousandth of it, times ``size``, the size of the state.
    size, step : float
        ``step`` is the longest step [s].
    held : bool
        The motion's speed and acceleration hold over each sample, as an FMU gets them, at their value at its end.
    """
    rate, v, a = equations.rate, motion.v, motion.a
    time = motion.time
    if held:
        speeds, accelerations = motion.columns["v"].tolist(), motion.columns["a"].tolist()
        per_second, last = (time.size - 1) / (time[-1] - time[0]), time.size - 1

        def of(t: float, z: Array) -> float:
            k = min(int(t * per_second) + 1, last)
            return rate(z[0], speeds[k], accelerations[k])
    elif equations.needs_a:

        def of(t: float, z: Array) -> float:
            return rate(z[0], v(t), a(t))
    else:

        def of(t: float, z: Array) -> float:
            return rate(z[0], v(t), 0.0)

    options: dict[str, Any] = {"rtol": rtol, "atol": 1e-3 * rtol * size, "max_step": step}
    run = solve_ivp(of, (time[0], time[-1]), [0.0], t_eval=time, method=method, **options)
    state = run.y[0] if run.y[0].size == time.size else np.full(time.size, np.nan)
    return equations.output(state, motion.columns)
