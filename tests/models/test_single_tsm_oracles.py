"""Printed-digit oracles of the single-tendon models, and the readings of MMT 2015 that its own numbers decide.

Values that a continuous signal reaches are met as the step falls; each test states its step. The literal ODE
of MMT 2015 and its LuGre comparison are written here from the paper.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tsm_fmu import InputError
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models import single_tsm_lugre
from tsm_fmu.models.laws.lugre import bristle_after

W = 2 * np.pi * 0.2  # MMT periodic motion: 1 rad at 0.2 Hz


def sine_rows(time, amplitude, frequency):
    w = 2 * np.pi * frequency
    v, a = amplitude * w * np.cos(w * time), -amplitude * w * w * np.sin(w * time)
    return np.column_stack([v, a, 0 * v, 0 * v])


def friction(model, time, inputs, preset=None, **values):
    k = kernel(model)
    return k.simulate(k.params(preset, values), time, inputs)[:, 0]


# --- ICINCO 2013


def test_icinco_step():
    assert 17.57 * bristle_after(-2 / 17.57, 3.0, 0.02, 2.5 / 17.57) == pytest.approx(-0.4517475853845, abs=1e-12)
    k = kernel("SingleTsmDahl")
    p = k.params(None, {"rho1": 2.5, "mu1": 0.0, "mu2": 0.0})  # F_f = 2.5 N
    s = k.module.State(-2 / 17570, 0.0)
    assert k.module.step(p, s, k.module.Inputs(3e-3, -1.0, 0.0, 0.0), 0.02)[1].F == pytest.approx(
        -0.4517475853845, abs=1e-12
    )


@pytest.mark.parametrize(
    ("v", "a", "expected"),
    [(10, -50, 3.427807), (10, 50, 4.297317), (-10, -50, 3.348478), (-10, 50, 4.571522)],
)
def test_icinco_sliding_force(v, a, expected):
    k = kernel("SingleTsmDahl")
    got = k.module.sliding_force(k.params(), v * 1e-3, a * 1e-3, math.copysign(1.0, a))
    assert got == pytest.approx(expected, abs=5e-7)


def test_icinco_force_over_time():
    marks = {
        0.01: 2.485179,
        0.1: 3.419376,
        0.26: 3.025259,
        0.3: -1.466508,
        0.4: -3.341821,
        0.7: -5.163852,
        0.9: 4.791457,
    }
    dt = 1e-5
    time = np.arange(0, 0.9 + dt / 2, dt)
    force = friction("SingleTsmDahl", time, sine_rows(time, 5e-3, 1.0))
    for t, expected in marks.items():
        assert force[round(t / dt)] == pytest.approx(expected, abs=1e-3), t


@pytest.mark.parametrize(
    ("amplitude", "frequency", "low", "high"),
    [
        (1e-3, 1.0, -4.858, 3.494),
        (2e-3, 1.0, -5.118, 4.107),
        (5e-3, 1.0, -5.358, 4.826),
        (10e-3, 1.0, -5.482, 5.008),
        (5e-3, 0.8, -5.271, 4.626),
    ],
)
def test_icinco_limit_cycle(amplitude, frequency, low, high):
    time = np.arange(0, 3 / frequency, 2e-5)
    force = friction("SingleTsmDahl", time, sine_rows(time, amplitude, frequency))
    cycle = force[time > 1 / frequency]
    assert (cycle.min(), cycle.max()) == (pytest.approx(low, abs=1e-3), pytest.approx(high, abs=1e-3))


# --- IFToMM 2013


@pytest.mark.parametrize(
    ("v", "a", "expected"),
    [(5, -10, 0.635227), (5, 10, 0.724430), (-1, -10, 2.083302), (-1, 10, 1.045087), (1e-12, -10, 0.232200)],
)
def test_iftomm_sliding_force(v, a, expected):
    k = kernel("SingleTsmBoucWen")
    got = k.module.sliding_force(k.params(), v * 1e-3, a * 1e-3, math.copysign(1.0, a))
    assert got == pytest.approx(expected, abs=5e-7)


@pytest.mark.parametrize(
    ("preset", "high", "low"),
    [("published", 0.8446, -1.548), ("reading_b", 0.8451, -1.609), ("reading_c", 0.8453, -1.701)],
)
def test_iftomm_readings_nearly_coincide_in_sliding(preset, high, low):
    """For x = 3 sin(2 pi 0.2 t) + 2 sin(2 pi 0.35 t) mm."""
    time = np.arange(0, 20, 1e-4)
    inputs = sine_rows(time, 3e-3, 0.2) + sine_rows(time, 2e-3, 0.35)
    force = friction("SingleTsmBoucWen", time, inputs, preset)
    assert force.max() == pytest.approx(high, abs=2e-4)
    assert force.min() == pytest.approx(low, abs=5e-4)


def test_iftomm_force_runs_away_where_the_release_level_is_negative():
    """Why F_f is a magnitude: the printed Eq (2), reading C with sigma = 1, fed a negative level."""
    k_, n, level = 5.491, 2.952, -1.2

    def rate(_, zeta, v=-3.0):
        r = zeta[0] / level
        return [k_ * (v - abs(v) * abs(r) ** (n - 1) * r)]

    def lost(_, zeta):
        return abs(zeta[0]) - 1e6

    lost.terminal = True
    run = solve_ivp(rate, (0, 5), [0.0], events=lost, method="Radau", rtol=1e-9)
    assert run.t_events[0].size == 1
    force = friction("SingleTsmBoucWen", [0, 5], [[-3e-3, 0, 0, 0]] * 2, "reading_c", rho2=1.2, mu3=0.0, mu4=0.0)
    assert force[1] == pytest.approx(-1.2, rel=1e-9)


# --- MMT 2015


@pytest.mark.parametrize(
    ("z0", "w", "level", "dt", "expected"),
    [
        (-0.9, 1.0, 1.1, 0.05, -0.370533923121),
        (0.3, 1.0, 1.1, 0.05, 0.621858258866),
        (1.5, 1.0, 1.1, 0.05, 1.277767931140),
        (0.9, -0.7, 0.95, 0.2, -0.370204158186),
    ],
)
def test_mmt_step(z0, w, level, dt, expected):
    k = kernel("SingleTsmLuGre")
    flat = {"rho1": level, "rho2": level, "mu1": 0.0, "mu2": 0.0, "mu3": 0.0, "lambda": 0.0}
    state = k.module.step(k.params(None, flat), k.module.State(z0, 0.0), k.module.Inputs(w, 0.0, 0.0, 0.0), dt)[0]
    assert state.zeta == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("v", "a", "expected"),
    [
        (1.2566, 0, 1.269709),
        (0.5, 1, 1.144190),
        (0.5, -1, 1.486160),
        (-0.5, 1, 0.888845),  # S = -0.888845 as printed
        (-0.5, -1, 1.032845),
        (0, -1.579, 1.434200),
    ],
)
def test_mmt_sliding_level(v, a, expected):
    p = kernel("SingleTsmLuGre").params()
    assert single_tsm_lugre.sliding_level(p, v, a, float(np.sign(a))) == pytest.approx(expected, abs=5e-7)


@pytest.mark.parametrize(
    ("preset", "dt", "marks"),
    [
        (
            "published",
            2.5e-5,
            {
                0.1: 3.9585,
                0.5: 7.7373,
                1.2: 7.36029,
                1.3: 5.9547,
                1.5: 1.3848,
                2.0: -5.01662,
                3.7: -4.35640,
                4.5: 5.96029,
            },
        ),
        ("swapped", 1e-4, {0.5: 6.0797, 1.2: 5.6118, 2.0: -5.0210, 4.5: 7.5470}),
    ],
)
def test_mmt_force_over_time(preset, dt, marks):
    time = np.arange(0, 4.5 + dt / 2, dt)
    force = friction("SingleTsmLuGre", time, sine_rows(time, 1.0, 0.2), preset)
    for t, expected in marks.items():
        assert force[round(t / dt)] == pytest.approx(expected, abs=1e-3), t


def non_periodic(time):
    """MMT Section 5: 0.5 rad at 0.2 Hz and 0.6 rad at 0.25 sqrt(3) Hz."""
    return sine_rows(time, 0.5, 0.2) + sine_rows(time, 0.6, 0.25 * math.sqrt(3))


def test_mmt_force_range():
    """The non-periodic signal over 30 s: a longer run reaches 8.145 N."""
    time = np.arange(0, 30, 2e-4)
    periodic, other = (friction("SingleTsmLuGre", time, u) for u in (sine_rows(time, 1.0, 0.2), non_periodic(time)))
    assert (periodic.min(), periodic.max()) == (pytest.approx(-5.02, abs=5e-3), pytest.approx(7.84, abs=5e-3))
    assert (other.min(), other.max()) == (pytest.approx(-5.04, abs=5e-3), pytest.approx(8.11, abs=5e-3))


@pytest.mark.parametrize(("offset", "work", "share"), [(0.156, 21.04, 0.111), (0.0, 19.95, 0.151)])
def test_mmt_work_of_a_cycle(offset, work, share):
    """Work in N rad; the share of the cycle in which friction drives the motion, elastic return included."""
    time = np.arange(0, 10 + 5e-5, 1e-4)
    inputs = sine_rows(time, 1.0, 0.2)
    force, v = friction("SingleTsmLuGre", time, inputs, **{"lambda": offset}), inputs[:, 0]
    last = time >= 5
    assert np.trapezoid((force * v)[last], time[last]) == pytest.approx(work, abs=0.01)
    assert np.mean((force * v)[last] < 0) == pytest.approx(share, abs=1e-3)


def literal_mmt(eq9):
    """Eqs (5)-(8) with (10), (11), or with (9), exactly as printed, S of either sign."""

    def rate(t, zeta):
        v, a = W * math.cos(W * t), -W * W * math.sin(W * t)
        sgn_a = (a > 0) - (a < 0)
        if v >= 0:
            level = 2.8642 - 1.772 * math.exp(-0.084 * abs(v) / (0.4104 * abs(a) + 1))
            level += 0.342 * (1 - math.exp(-9.345 * abs(a))) if a <= 0 else 0
        else:
            decay = 0.9991 * math.exp(-0.1704 * abs(v) / (abs(a) + 1.1823))
            level = 0.072 + (sgn_a if eq9 else -sgn_a) * decay
        w = v + 0.156 * sgn_a
        r = zeta[0] / level
        return [7.938 * (w - abs(w) * r * abs(r))]

    return rate


def blow_up(rate, zeta, stop):
    def lost(_, z):
        return abs(z[0]) - 1e5

    lost.terminal = True
    run = solve_ivp(rate, (0, stop), [zeta], events=lost, method="Radau", rtol=1e-10, atol=1e-12, max_step=1e-3)
    return run.t_events[0][0] if run.t_events[0].size else None


@pytest.mark.parametrize(("eq9", "t_blow_up"), [(False, 2.562), (True, 1.509)])
def test_mmt_as_printed_escapes_and_the_kernel_does_not(eq9, t_blow_up):
    assert blow_up(literal_mmt(eq9), 0.0, 4.0) == pytest.approx(t_blow_up, abs=2e-3)
    time = np.arange(0, 60, 1e-3)
    force = friction("SingleTsmLuGre", time, sine_rows(time, 1.0, 0.2))
    assert np.abs(force).max() < 5.038 * (2.8642 + 0.342)


@pytest.mark.parametrize(("S", "w", "zeta_0", "expected"), [(-0.9271, -1.0, -1.05, 0.0845), (-0.31, -2.7, 0.0, None)])
def test_escape_time_is_that_of_the_literal_equation(S, w, zeta_0, expected):
    closed = single_tsm_lugre.escape_time(S, 7.938, w, zeta_0)
    integrated = blow_up(lambda _, z: [7.938 * (w - abs(w) * (z[0] / S) * abs(z[0] / S))], zeta_0, 1.0)
    assert closed == pytest.approx(integrated, abs=2e-6)
    if expected is not None:
        assert closed == pytest.approx(expected, abs=5e-5)


def test_the_literal_reading_is_refused_with_the_escape_time():
    with pytest.raises(InputError, match=r"literal = 1 with rho2 = 0\.072 and mu3 = 0\.9991 .* use \|S\|") as refused:
        kernel("SingleTsmLuGre").params("published", {"literal": 1})
    rest = 0.9271 / 7.938 * math.pi / 2
    assert f"t_esc = {rest:.4f} s from zeta = 0" in str(refused.value)


def test_the_literal_reading_is_the_other_one_where_s_is_positive():
    k = kernel("SingleTsmLuGre")
    values = {"rho2": 1.071, "mu3": -0.9991}
    assert k.params(None, values | {"literal": 1})._replace(literal=0) == k.params(None, values)


def test_s_reaching_zero_stops_the_run_with_the_reason():
    limit = (0.7 + 1.1823) * math.log(0.9991 / 0.072) / 0.1704  # |v| at a = 0.7 rad/s2
    time = np.linspace(0, 1, 200)
    below, above = (np.column_stack([-f * limit * time, 0.7 + 0 * time, 0 * time, 0 * time]) for f in (0.999, 1.001))
    assert np.isfinite(friction("SingleTsmLuGre", time, below)).all()
    with pytest.raises(InputError, match=r"SingleTsmLuGre stopped: sliding level S reached 0 for v < 0 -- expected"):
        friction("SingleTsmLuGre", time, above)
    assert np.isfinite(friction("SingleTsmLuGre", time, above * [1, -1, 1, 1])).all()  # the other branch has no zero


def test_mmt_readings_against_the_papers_own_lugre_numbers():
    """MSE(model, LuGre) must lie in (sqrt 1.4538 -+ sqrt 0.027)^2 by the triangle inequality; cycle 5-10 s."""
    low, high = (math.sqrt(1.4538) - math.sqrt(0.027)) ** 2, (math.sqrt(1.4538) + math.sqrt(0.027)) ** 2
    assert (low, high) == (pytest.approx(1.085, abs=1e-3), pytest.approx(1.877, abs=1e-3))
    time = np.arange(0, 10 + 5e-5, 1e-4)
    inputs = sine_rows(time, 1.0, 0.2)
    lugre = friction("LuGreFriction", time, inputs[:, :1], "mmt2015")

    def mse(preset, **values):
        force = friction("SingleTsmLuGre", time, inputs, preset, **values)
        return np.mean((force - lugre)[time >= 5] ** 2)

    eq9 = {"mu3": -0.9991}  # Eq (9) is Eqs (10), (11) with mu3 of the other sign
    readings = {(preset, len(mu3)): mse(preset, **mu3) for preset in ("published", "swapped") for mu3 in ({}, eq9)}
    reported = {("published", 0): 2.011, ("published", 1): 1.8777, ("swapped", 0): 1.420, ("swapped", 1): 1.320}
    assert readings == pytest.approx(reported, abs=1e-3)
    assert readings["published", 0] > high
    assert low < readings["swapped", 0] < high
    assert low < readings["swapped", 1] < high
    for offset, least, most in ((0.0, 1.93, 3.03), (-0.156, 4.0, 5.5)):
        shifted = [mse(preset, **mu3, **{"lambda": offset}) for preset in ("published", "swapped") for mu3 in ({}, eq9)]
        assert min(shifted) == pytest.approx(least, abs=0.05)
        assert max(shifted) == pytest.approx(most, abs=0.05)
