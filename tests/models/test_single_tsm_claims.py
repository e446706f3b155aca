"""What the three single-tendon models claim, against the equations as the papers print them.

The reference side is written here from the papers, in the papers' units (mm, s, N; rad for MMT), and is
integrated by SciPy: it shares no code and no unit with the kernels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tsm_fmu.kernels.kernel import kernel

Level = Callable[[float, float], float]
Rate = Callable[[float, float, float], float]


def icinco_level(v: float, a: float) -> float:
    rho1, rho2, mu1, mu2, mu3 = 2.097, 3.960, 1.368, 1.579, -1.855
    kappa1, kappa2, kappa3, kappa4, kappa5 = 0.172, 1.228, 0.016, 5.549, 0.005
    f1 = kappa1 * abs(v) / (abs(kappa2 * a) + 1)
    f2 = kappa4 * abs(v) / (abs(a) + kappa5)
    if v >= 0:
        anvp = rho1 + mu1 * math.exp(-f1)
        return anvp if a <= 0 else anvp + mu2 * (1 - math.exp(-abs(kappa3 * a)))
    return rho2 + mu3 * math.exp(-f2) if a <= 0 else rho2 - mu3 * math.exp(-f2)


def icinco_rate(force: float, v: float, a: float) -> float:
    sigma = 17.57
    zeta = force / sigma
    return sigma * (v - sigma * abs(v) / icinco_level(v, a) * zeta)


def iftomm_level(v: float, a: float) -> float:
    rho1, mu1, kappa1, kappa2, mu2, kappa3 = 0.8855, -0.6533, 0.341, 0.0777, 1.461, 0.0063
    rho2, mu3, kappa4, mu4, kappa5, kappa6 = 1.548, 0.452, 3.329, 0.875, 5.224, 0.0055
    f1 = kappa1 * abs(v) / (kappa2 * abs(a) + 1)
    f2 = kappa5 * abs(v) / (abs(a) + kappa6)
    if v >= 0:
        anvp = rho1 + mu1 * math.exp(-f1)
        return anvp if a <= 0 else anvp + mu2 * (1 - math.exp(-kappa3 * abs(a)))
    stribeck = rho2 + mu3 * math.exp(-kappa4 * abs(v))
    return stribeck + mu4 * math.exp(-f2) if a <= 0 else stribeck - mu4 * math.exp(-f2)


def iftomm_rate(k: float, sigma: float, n: float) -> Rate:
    def rate(zeta: float, v: float, a: float) -> float:
        r = zeta / iftomm_level(v, a)
        return k * (v - sigma * abs(v) * abs(r) ** (n - 1) * r + (sigma - 1) * v * abs(r) ** n)

    return rate


def mmt_level(swapped: bool) -> Level:
    rho1, mu1, kappa1, kappa2, mu2, kappa3 = 2.8642, -1.772, 0.084, 0.4104, 0.342, 9.345
    rho2, mu3, kappa4, kappa5 = 0.072, 0.9991, 0.1704, 1.1823

    def level(v: float, a: float) -> float:
        plus_v1 = rho1 + mu1 * math.exp(-kappa1 * abs(v) / (abs(kappa2 * a) + 1))
        plus_v2 = plus_v1 + mu2 * (1 - math.exp(-abs(kappa3 * a)))
        if v >= 0:
            return plus_v1 if (a <= 0) == swapped else plus_v2
        decay = mu3 * math.exp(-kappa4 * abs(v) / (abs(a) + kappa5))
        return abs(rho2 + decay) if a < 0 else abs(rho2 - decay)

    return level


def mmt_rate(swapped: bool) -> Rate:
    rho, lambda_, sigma0 = 7.938, 0.156, 5.038
    level = mmt_level(swapped)

    def rate(force: float, v: float, a: float) -> float:
        w = v + lambda_ * (1 if a > 0 else -1)
        r = force / sigma0 / level(v, a)
        return sigma0 * rho * (w - abs(w) * r * abs(r))

    return rate


@dataclass(frozen=True)
class Case:
    """A model preset with its printed equations; ``length`` is the paper's length or angle in SI."""

    model: str
    preset: str
    length: float
    level: Level
    rate: Rate
    speed: float
    force_per_level: float = 1.0
    accuracy: float = 1e-11

    def __str__(self) -> str:
        return f"{self.model}:{self.preset}"

    def frozen_step(self, force: float, v: float, a: float, dt: float) -> float:
        """Force after a kernel step from ``force`` at v, a in the paper's units."""
        k = kernel(self.model)
        p = k.params(self.preset)
        zeta = force / state_stiffness(self.model, p)
        u = k.module.Inputs(v * self.length, a * self.length, 0.0, 0.0)
        return k.module.step(p, k.module.State(zeta, 0.0), u, dt)[1].F


def state_stiffness(model: str, p) -> float:
    """Force per unit of the kernel's state."""
    return {"SingleTsmDahl": getattr(p, "sigma", 0.0), "SingleTsmBoucWen": 1.0}.get(model) or p.sigma0


def storage_stiffness(model: str, p) -> float:
    """Slope of the force over displacement at F = 0: the k of the storage F^2/(2 k)."""
    return p.k if model == "SingleTsmBoucWen" else p.sigma if model == "SingleTsmDahl" else p.sigma0 * p.rho


MM = 1e-3
BOUC_WEN = 1e-7  # of the level, single_tsm_bouc_wen.py; the others are exact
CASES = [
    Case("SingleTsmDahl", "published", MM, icinco_level, icinco_rate, 30.0),
    Case("SingleTsmBoucWen", "published", MM, iftomm_level, iftomm_rate(1.0, 5.491, 2.952), 6.0, accuracy=BOUC_WEN),
    Case("SingleTsmBoucWen", "reading_b", MM, iftomm_level, iftomm_rate(5.491, 2.952, 1.0), 6.0),
    Case("SingleTsmBoucWen", "reading_c", MM, iftomm_level, iftomm_rate(5.491, 1.0, 2.952), 6.0, accuracy=BOUC_WEN),
    Case("SingleTsmLuGre", "published", 1.0, mmt_level(swapped=False), mmt_rate(swapped=False), 1.3, 5.038),
    Case("SingleTsmLuGre", "swapped", 1.0, mmt_level(swapped=True), mmt_rate(swapped=True), 1.3, 5.038),
]
each_case = pytest.mark.parametrize("case", CASES, ids=str)
MODELS = ["SingleTsmDahl", "SingleTsmBoucWen", "SingleTsmLuGre"]
each_model = pytest.mark.parametrize("model", MODELS)


def motion(case: Case, time: np.ndarray, frequency: float) -> tuple[np.ndarray, np.ndarray]:
    """A two-tone v(t), a(t) in the paper's units, with no symmetry that could hide a branch."""
    w = 2 * np.pi * frequency
    v = case.speed * (0.7 * np.cos(w * time) + 0.4 * np.sin(1.7 * w * time + 0.3))
    a = case.speed * w * (-0.7 * np.sin(w * time) + 0.68 * np.cos(1.7 * w * time + 0.3))
    return v, a


def rows(*columns) -> np.ndarray:
    """Input rows v, a with T_in = T_load = 0."""
    v, a = np.broadcast_arrays(*columns)
    return np.column_stack([v, a, np.zeros_like(v), np.zeros_like(v)])


@each_case
def test_one_step_solves_the_printed_equation(case):
    rng = np.random.default_rng(20130)
    for _ in range(25):
        v = rng.choice([-1, 1]) * case.speed * rng.uniform(0.05, 1)
        a = rng.choice([-1, 1]) * case.speed * rng.uniform(0.01, 6)
        force = case.force_per_level * case.level(v, a) * rng.uniform(-1.4, 1.8)
        dt = rng.uniform(0.001, 0.3)
        exact = solve_ivp(
            lambda _, f, v=v, a=a: [case.rate(f[0], v, a)], (0, dt), [force], method="DOP853", rtol=1e-13, atol=1e-14
        ).y[0, -1]
        assert case.frozen_step(force, v, a, dt) == pytest.approx(
            exact, abs=case.accuracy * case.force_per_level * max(1.0, case.level(v, a))
        )


@each_case
def test_error_on_a_continuous_motion_falls_with_first_order_in_the_step(case):
    stop, frequency = 1.9, 0.31
    steps = [400, 800, 1600, 3200]
    marks = np.linspace(0.2, stop, 35)

    def derivative(t, f):
        v, a = motion(case, np.array([t]), frequency)
        return [case.rate(f[0], v[0], a[0])]

    exact = solve_ivp(derivative, (0, stop), [0.0], method="Radau", rtol=1e-9, atol=1e-10, max_step=2e-3, t_eval=marks)
    k = kernel(case.model)
    errors = []
    for n in steps:
        time = np.linspace(0, stop, n + 1)
        v, a = motion(case, time, frequency)
        force = k.simulate(k.params(case.preset), time, rows(v * case.length, a * case.length))[:, 0]
        errors.append(np.sqrt(np.mean((np.interp(marks, time, force) - exact.y[0]) ** 2)))
    order = -np.polyfit(np.log2(steps), np.log2(errors), 1)[0]
    assert 0.85 < order < 1.2, errors


@each_case
def test_dividing_a_step_changes_nothing(case):
    rng = np.random.default_rng(7)
    k = kernel(case.model)
    p = k.params(case.preset)
    for _ in range(60):
        v = rng.choice([-1, 1]) * case.speed * rng.uniform(0.01, 1) * case.length
        a = rng.choice([-1, 1]) * case.speed * rng.uniform(0.01, 6) * case.length
        u = k.module.Inputs(v, a, 3.7, 1.9)
        state = k.module.State(case.force_per_level * rng.uniform(-3, 3) / state_stiffness(case.model, p), 0.0)
        dt, parts = rng.uniform(0.0003, 1.7), int(rng.integers(2, 9))
        whole = k.module.step(p, state, u, dt)[1].F
        for _ in range(parts):
            state, out = k.module.step(p, state, u, dt / parts)
        tolerance = 1e-12 if case.accuracy < 1e-8 else 2 * case.accuracy
        assert out.F == pytest.approx(whole, abs=tolerance * case.force_per_level * 3)


def random_parameters(model: str, rng: np.random.Generator) -> dict[str, float]:
    """A valid set with no round number in it; rho2 > |mu3| for LuGre, so that no speed is refused."""
    declared = {v.name: v for v in kernel(model).parameters}
    values = {
        n: v.start * rng.uniform(0.5, 1.6) for n, v in declared.items() if n.startswith(("kappa", "rho", "sigma"))
    }
    values["mu1"] = rng.uniform(-0.6, 1.3) * values["rho1"]
    values["mu2"] = rng.uniform(-0.3, 1.3) * values["rho1"]
    values["rho2"] = rng.uniform(0.6, 3.9)
    values["mu3"] = rng.uniform(-0.45, 0.45) * values["rho2"]
    if model == "SingleTsmBoucWen":
        values["mu4"] = rng.uniform(-0.45, 0.45) * values["rho2"]
        values |= {"k": rng.uniform(300, 7000), "sigma": rng.uniform(0.5, 6), "n": rng.uniform(1, 5)}
    if model == "SingleTsmLuGre":
        values |= {"swap_branches": int(rng.integers(0, 2)), "literal": 1}
    return values


def level_bounds(model: str, p) -> tuple[float, float]:
    """Least and greatest value of the sliding force over all v and a, in newton."""
    branch = p.mu4 if model == "SingleTsmBoucWen" else p.mu3
    stribeck = p.mu3 if model == "SingleTsmBoucWen" else 0.0
    low = min(p.rho1 + min(p.mu1, 0) + min(p.mu2, 0), p.rho2 + min(stribeck, 0) - abs(branch))
    high = max(p.rho1 + max(p.mu1, 0) + max(p.mu2, 0), p.rho2 + max(stribeck, 0) + abs(branch))
    scale = p.sigma0 if model == "SingleTsmLuGre" else 1.0
    return scale * low, scale * high


def wild_inputs(model: str, rng: np.random.Generator, n: int) -> np.ndarray:
    """White speeds and accelerations over six decades, with zeros and standstills among them."""
    scale = 1.0 if model == "SingleTsmLuGre" else 1e-3
    v, a = rng.choice([-1, 1], (2, n)) * 10 ** rng.uniform(-3, 3, (2, n)) * scale
    v[rng.random(n) < 0.1] = 0.0
    a[rng.random(n) < 0.1] = 0.0
    return rows(v, a)


@each_model
@pytest.mark.parametrize("seed", range(6))
def test_force_never_leaves_its_bound(model, seed):
    rng = np.random.default_rng(seed)
    k = kernel(model)
    values = random_parameters(model, rng)
    sup = level_bounds(model, k.params(None, values))[1]
    for excess in (0.0, -2.3):  # from rest, and from above the bound
        p = k.params(None, values)
        p = p._replace(zeta_0=excess * sup / state_stiffness(model, p))
        time = np.cumsum(10 ** rng.uniform(-5, 1, 3000))
        force = k.simulate(p, time, wild_inputs(model, rng, 3000))[:, 0]
        assert np.abs(force).max() <= max(sup, abs(excess) * sup) * (1 + 1e-12)
        assert np.abs(force[-100:]).max() <= sup * (1 + 1e-9)  # a start beyond the bound is forgotten


@each_model
def test_sliding_settles_inside_the_closed_form_bounds_of_the_level(model):
    rng = np.random.default_rng(3)
    k = kernel(model)
    p = k.params(None, random_parameters(model, rng))
    low, high = level_bounds(model, p)
    settled = []
    for v in (1e-9, 1e6, -1e-9, -1e6):
        for a in (-1e12, -1e-9, 1e-9, 1e12):
            settled.append(abs(k.simulate(p, [0, 1e15], rows([v, v], [a, a]))[-1, 0]))
    assert low * (1 - 1e-6) <= min(settled) <= max(settled) <= high * (1 + 1e-6)
    assert max(settled) - min(settled) > 0.2 * (high - low)


NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)


def work_within(k, p, state, u, dt: float, speed: float) -> float:
    """Integral of F v over one step: Gauss-Legendre over partial steps from the same state."""
    return sum(
        0.5 * weight * dt * k.module.step(p, state, u, 0.5 * (1 + node) * dt)[1].F * speed
        for node, weight in zip(NODES, WEIGHTS, strict=True)
    )


@each_model
def test_every_step_takes_at_least_the_energy_it_stores(model):
    """IFToMM Proposition 3 with the storage F^2/(2k) of the slope k; Dahl and LuGre (lambda = 0) likewise."""
    rng = np.random.default_rng(11)
    k = kernel(model)
    for _ in range(12):
        extra = {"lambda": 0.0} if model == "SingleTsmLuGre" else {}
        p = k.params(None, random_parameters(model, rng) | extra)
        stiffness, sup = storage_stiffness(model, p), level_bounds(model, p)[1]
        state = k.module.State(0.0, 0.0)
        dissipated = 0.0
        for _ in range(25):
            v = rng.normal()
            v, a = v * sup / stiffness, rng.normal() * sup / stiffness
            u, dt = k.module.Inputs(v, a, 0.0, 0.0), rng.uniform(0.01, 1.0)
            before = state_stiffness(model, p) * state.zeta
            work = work_within(k, p, state, u, dt, v)
            state, out = k.module.step(p, state, u, dt)
            loss = work - (out.F**2 - before**2) / (2 * stiffness)
            assert loss >= -1e-6 * sup**2 / stiffness  # the quadrature's error where F passes 0
            dissipated += loss
        assert dissipated > 0.1 * sup**2 / stiffness


@pytest.mark.parametrize(("preset", "holds"), [("published", True), ("reading_b", False), ("reading_c", False)])
def test_the_storage_as_printed_fits_reading_a_only(preset, holds):
    """Proposition 3 prints W = zeta^2/2, in N and mm: v F >= zeta dzeta/dt pointwise."""
    case = next(c for c in CASES if c.preset == preset and c.model == "SingleTsmBoucWen")
    rng = np.random.default_rng(5)
    v, a = rng.normal(0, 6, 400), rng.normal(0, 30, 400)
    share = rng.uniform(-1, 1, 400)
    margin = []
    for i in range(400):
        zeta = share[i] * case.level(v[i], a[i])
        dt = 1e-6
        rate = (case.frozen_step(zeta, v[i], a[i], dt) - zeta) / dt
        margin.append(v[i] * zeta - zeta * rate)
    assert (min(margin) >= -1e-3) == holds


def constant_level(model: str) -> dict[str, float]:
    """Parameters whose sliding level is 1.37 (of zeta for LuGre) in all branches."""
    values = {"rho1": 1.37, "rho2": 1.37, "mu1": 0.0, "mu2": 0.0, "mu3": 0.0}
    return values | {"SingleTsmBoucWen": {"mu4": 0.0}, "SingleTsmLuGre": {"lambda": 0.0}}.get(model, {})


def path_force(model: str, values: dict[str, float], frequency: float) -> np.ndarray:
    """Force at 800 fixed points of one path, run through at ``frequency``."""
    k = kernel(model)
    p = k.params(None, values)
    travel = 3 * level_bounds(model, p)[1] / storage_stiffness(model, p)
    phase = np.linspace(0, 2.4, 801)
    x = travel * (np.sin(2 * np.pi * phase) + 0.45 * np.sin(2 * np.pi * 2.3 * phase))
    time = phase / frequency
    v = np.concatenate([[0.0], np.diff(x) / np.diff(time)])
    a = np.gradient(v, time)
    return k.simulate(p, time, rows(v, a))[:, 0]


@each_model
def test_rate_independent_with_a_constant_level(model):
    slow, fast = (path_force(model, constant_level(model), f) for f in (0.2, 2.0))
    assert np.abs(slow).max() > 1.0
    np.testing.assert_allclose(slow, fast, atol=1e-11)


@each_model
def test_rate_dependent_with_the_published_levels(model):
    slow, fast = (path_force(model, {}, f) for f in (0.2, 2.0))
    assert np.abs(slow - fast).max() > 0.02


def test_lambda_alone_makes_the_friction_depend_on_the_rate():
    values = constant_level("SingleTsmLuGre") | {"lambda": 0.156}
    slow, fast = (path_force("SingleTsmLuGre", values, f) for f in (0.2, 2.0))
    assert np.abs(slow - fast).max() > 0.5


def test_symmetric_levels_make_the_friction_odd():
    rng = np.random.default_rng(23)
    for model in MODELS:
        k = kernel(model)
        p = k.params(None, constant_level(model))
        time = np.arange(300) * 0.013
        v, a = rng.normal(0, 1.37 / storage_stiffness(model, p), (2, 300)) * 20
        there = k.simulate(p, time, rows(v, a))[:, 0]
        np.testing.assert_allclose(k.simulate(p, time, rows(-v, -a))[:, 0], -there, atol=1e-13)


@pytest.mark.parametrize(
    ("model", "extra", "tolerance"),
    [
        ("SingleTsmBoucWen", {"k": 2310.0, "sigma": 1.0, "n": 1.0}, 1e-12),
        ("LuGreFriction", {"sigma0": 2310.0, "sigma1": 0.0, "sigma2": 0.0, "F_c": 1.37, "F_s": 1.37}, 1e-12),
    ],
)
def test_limits_that_are_the_dahl_model(model, extra, tolerance):
    rng = np.random.default_rng(2)
    time = np.arange(500) * 1e-3
    v, a = rng.normal(0, 0.8, (2, 500))
    dahl = kernel("SingleTsmDahl")
    p = dahl.params(None, constant_level("SingleTsmDahl") | {"sigma": 2310.0})
    expected = dahl.simulate(p, time, rows(v, a))[:, 0]
    k = kernel(model)
    columns = v[:, None] if model == "LuGreFriction" else rows(v, a)
    p = k.params(None, extra | ({} if model == "LuGreFriction" else constant_level(model)))
    np.testing.assert_allclose(k.simulate(p, time, columns)[1:, 0], expected[1:], atol=tolerance)
    assert np.ptp(expected) > 2.0


def test_lugre_exponent_is_the_bouc_wen_shape_with_n_2_and_sigma_1():
    """(zeta/S)|zeta/S| is the Bouc-Wen law with n = 2, sigma = 1, k = sigma0 rho: level by level the same force."""
    rng = np.random.default_rng(31)
    shared = {"rho1": 1.9, "rho2": 1.2, "mu1": -0.7, "mu2": 0.31, "kappa1": 0.4, "kappa2": 0.23, "kappa3": 0.81}
    lugre = kernel("SingleTsmLuGre")
    p = lugre.params(
        "swapped", shared | {"mu3": -0.43, "kappa4": 0.37, "kappa5": 0.9, "lambda": 0.0, "sigma0": 1.0, "rho": 5.1}
    )
    wen = kernel("SingleTsmBoucWen")
    q = wen.params(
        None, shared | {"mu3": 0.0, "mu4": -0.43, "kappa5": 0.37, "kappa6": 0.9, "k": 5.1, "sigma": 1.0, "n": 2.0}
    )
    time = np.arange(600) * 0.01
    v, a = rng.normal(0, 6, (2, 600))
    one = lugre.simulate(p, time, rows(v, a))[:, 0]
    np.testing.assert_allclose(one, wen.simulate(q, time, rows(v, a))[:, 0], atol=3e-7)
    assert np.ptp(one) > 2.0
