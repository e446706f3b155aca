"""LuGreFriction: exact bristle step, steady state, bounds, energy, presets."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.models.laws.lugre import bristle_after
from tsm_fmu.models.lugre_friction import Inputs, State, start, step

MODEL = kernel("LuGreFriction")
PUBLISHED = MODEL.params("published")
MMT = MODEL.params("mmt2015")


def g(p, v):
    return p.F_c + (p.F_s - p.F_c) * math.exp(-((v / p.v_s) ** 2))


def test_dahl_step_of_the_printed_oracle():
    """F0 = -2, v = 3, F_f = 2.5, sigma = 17.57, dt = 0.02: the same equation with F = sigma z."""
    assert 17.57 * bristle_after(-2 / 17.57, 3.0, 0.02, 2.5 / 17.57) == pytest.approx(-0.4517475853845, abs=5e-13)


@pytest.mark.parametrize("v", [0.37, -0.052, 1.9])
def test_step_is_the_solution_of_equation_40(v):
    p = MMT
    for z, dt in [(0.0, 0.013), (-0.08, 0.21), (0.3, 0.05)]:
        exact = solve_ivp(
            lambda _, z: v - p.sigma0 * abs(v) / g(p, v) * z, (0, dt), [z], rtol=1e-12, atol=1e-15, method="DOP853"
        ).y[0, -1]
        s, o = step(p, State(z), Inputs(v), dt)
        assert s.z == pytest.approx(exact, abs=1e-12)
        rate = v - p.sigma0 * abs(v) / g(p, v) * exact
        force = p.sigma0 * exact + p.sigma1 * rate + p.sigma2 * v
        assert o.F == pytest.approx(force, abs=1e-9)
        assert o.P_loss == pytest.approx(force * v, abs=1e-9)


@pytest.mark.parametrize("p", [PUBLISHED, MMT], ids=["published", "mmt2015"])
@pytest.mark.parametrize("v", [0.05, -0.05, -0.61, 2e-6])
def test_steady_friction_is_the_stribeck_curve(p, v):
    _, o = step(p, State(0.0), Inputs(v), 1e8)
    assert o.F == pytest.approx(math.copysign(g(p, v), v) + p.sigma2 * v, rel=1e-12)


@pytest.mark.parametrize("p", [PUBLISHED, MMT], ids=["published", "mmt2015"])
def test_splitting_a_step_changes_nothing(p):
    for z, v, dt in [(0.0, 0.041, 0.003), (-2e-6, 0.4, 1.7e-5), (0.05, -1.3, 0.08)]:
        whole, _ = step(p, State(z), Inputs(v), dt)
        parts = State(z)
        for _ in range(9):
            parts, _ = step(p, parts, Inputs(v), dt / 9)
        assert parts.z == pytest.approx(whole.z, rel=1e-12)


def test_rest_holds_the_presliding_force():
    p = MMT
    s, o = step(p, State(0.02), Inputs(0.0), 3.7)
    assert (s.z, o.F, o.P_loss) == (0.02, p.sigma0 * 0.02, 0.0)


def test_bristle_force_is_bounded_odd_and_rate_independent_without_stribeck():
    rng = np.random.default_rng(40)
    t = np.cumsum(10 ** rng.uniform(-5, -1, 3000))
    v = rng.normal(size=(3000, 1)) * 10 ** rng.uniform(-6, 1, (3000, 1))
    p = MMT._replace(sigma1=0.0, sigma2=0.0)
    f = MODEL.simulate(p, t, v)[:, 0]
    assert np.abs(f).max() <= p.F_s
    assert (MODEL.simulate(p, t, -v)[:, 0] == -f).all()
    flat = p._replace(F_s=p.F_c)
    even = np.arange(3000) / 1024  # powers of 2 keep the travel of each step exact at a quarter of the pace
    assert (MODEL.simulate(flat, 4 * even, v / 4)[:, 0] == MODEL.simulate(flat, even, v)[:, 0]).all()


def test_energy_taken_over_closed_cycles_is_not_negative():
    rng = np.random.default_rng(41)
    dt = 2e-4
    t = np.arange(10001) * dt
    for _ in range(12):
        p = MODEL.params(
            "mmt2015",
            {
                "F_c": (c := rng.uniform(0.3, 5)),
                "F_s": c * rng.uniform(1, 2),
                "sigma1": 0.1,
                "v_s": rng.uniform(0.05, 2),
            },
        )
        omega = 2 * math.pi * rng.integers(1, 9)
        v = rng.uniform(0.01, 3) * np.cos(omega * t)
        assert MODEL.simulate(p, t, v[:, None])[1:, 1].sum() * dt > 0


def test_published_presliding_and_time_constant():
    """F_c/sigma0 = 7.8 um and 0.157 ms at 0.05 m/s: far below usual steps, so an explicit integration would blow up."""
    p = PUBLISHED
    assert p.F_c / p.sigma0 == pytest.approx(7.85e-6, rel=1e-3)
    tau = p.F_c / p.sigma0 / 0.05
    assert tau == pytest.approx(0.157e-3, rel=1e-3)
    s, _ = step(p, State(0.0), Inputs(0.05), tau)
    assert s.z == pytest.approx(p.F_c / p.sigma0 * (1 - math.exp(-1)), rel=1e-13)
    assert start(p, Inputs(0.05))[1].F == pytest.approx(15.8 + 4.3 * 0.05, abs=0.02)  # sigma1 v of relaxed bristles


def test_loss_of_passivity_is_said():
    assert MODEL.warnings(MMT) == ()
    (text,) = MODEL.warnings(PUBLISHED._replace(F_s=2 * PUBLISHED.F_c))
    assert "sigma2 = 4.3 N.s/m is below sigma1 (F_s - F_c)/F_c = 316.228 N.s/m" in text


@pytest.mark.parametrize("name", ["sigma0", "F_c", "F_s", "v_s"])
def test_parameters_without_a_bound_on_the_deflection_are_refused(name):
    with pytest.raises(InputError, match=rf"parameter {name} = 0.0 .* -- expected a value in \(0, inf\)"):
        MODEL.params("published", {name: 0.0})
    with pytest.raises(InputError, match=r"parameter sigma1 = -0.1 .* -- expected a value in \[0, inf\)"):
        MODEL.params("published", {"sigma1": -0.1})


def test_the_published_friction_is_that_of_half_a_kilogram():
    """Both levels are 0.16 times the weight of 0.5 kg: no Stribeck peak."""
    assert (PUBLISHED.F_c, PUBLISHED.F_s) == pytest.approx((0.7848, 0.7848), rel=1e-12)
    assert (PUBLISHED.sigma0, PUBLISHED.sigma1, PUBLISHED.sigma2, PUBLISHED.v_s) == pytest.approx(
        (1e5, math.sqrt(1e5), 4.3, 1e-5), rel=1e-12
    )
