"""PairedTsmFriction: oracles of MSSP 2015 in raw numbers, invariants, the torque balance and its refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.models.paired_tsm_friction import Inputs, start, step

MODEL = kernel("PairedTsmFriction")
A, OMEGA = math.pi / 3, 0.4 * math.pi


def sine(t, amplitude=A, omega=OMEGA):
    x = amplitude * np.sin(omega * t)
    v = amplitude * omega * np.cos(omega * t)
    return np.column_stack([x, v, -(omega**2) * x, 0 * t, 0 * t])


def force(p, dt, stop=3.0):
    t = np.arange(round(stop / dt) + 1) * dt
    return MODEL.simulate(p, t, sine(t))[:, 0]


def states(p, t, u):
    s, _ = start(p, Inputs(*u[0]))
    found = [s]
    for k in range(1, len(t)):
        s, _ = step(p, s, Inputs(*u[k]), t[k] - t[k - 1])
        found.append(s)
    return np.array(found)


ORACLES = [
    (None, 0.005, 58.4556),
    (None, 0.1, 162.9377),
    (None, 0.5, 160.58662),
    (None, 1.35, 114.3159),
    (None, 1.4, 73.3645),
    (None, 2.0, -160.07561),
    (None, 3.0, -150.26466),
    (0.0, 1.35, 57.2541),
    (0.0, 1.4, 10.4408),
]


@pytest.mark.parametrize("lam", [None, 0.0])
def test_published_force_of_a_sine_is_the_first_order_limit_of_the_step(lam):
    p = MODEL.params("raw", {} if lam is None else {"lambda": lam})
    coarse, fine, finest = (force(p, dt) for dt in (2e-4, 1e-4, 5e-5))
    for at, printed in [(t, f) for given, t, f in ORACLES if given == lam]:
        a, b, c = coarse[round(at / 2e-4)], fine[round(at / 1e-4)], finest[round(at / 5e-5)]
        digit = 10.0 ** -len(str(printed).partition(".")[2])
        assert 2 * c - b == pytest.approx(printed, abs=0.6 * digit)
        if abs(a - b) > 1e-6:
            assert math.log2((a - b) / (b - c)) == pytest.approx(1.0, abs=0.05)


def test_published_hysteresis_state_of_a_sine():
    p = MODEL.params("raw")
    expected = {0.005: 0.188985, 0.1: 0.999152, 0.5: 1.0, 1.35: 0.938151, 1.4: 0.640796, 2.0: -1.0}
    runs = []
    for dt in (1e-3, 5e-4):
        t = np.arange(round(2.0 / dt) + 1) * dt
        zeta = states(p, t, sine(t))[:, 0]
        runs.append([zeta[round(at / dt)] for at in expected])
    assert 2 * np.array(runs[1]) - runs[0] == pytest.approx(list(expected.values()), abs=2e-5)


def test_range_of_the_periodic_signal_in_raw_and_in_newton():
    t = np.arange(20001) * 1e-3
    raw = MODEL.simulate(MODEL.params("raw"), t, sine(t))[5000:, 0]
    assert raw.max() == pytest.approx(163.35, abs=0.01)
    assert raw.min() == pytest.approx(-162.84, abs=0.01)
    newton = MODEL.simulate(MODEL.params("published"), t, sine(t))[5000:, 0]
    assert newton == pytest.approx(raw / 25, rel=1e-14)


@pytest.mark.parametrize(("lam", "speed"), [(-0.1172, 0.394), (0.0, 0.279), (0.1172, 0.163)])
def test_lambda_moves_the_speed_at_which_zeta_reverses(lam, speed):
    dt = 2e-4
    t = np.arange(round(2.0 / dt) + 1) * dt
    u = sine(t)
    zeta = states(MODEL.params("raw", {"lambda": lam}), t, u)[:, 0]
    crossing = np.flatnonzero((zeta[:-1] > 0) & (zeta[1:] <= 0))
    assert crossing.size == 1
    assert abs(u[crossing[0], 1]) == pytest.approx(speed, abs=1.5e-3)


@pytest.mark.parametrize("lam", [0.0, -0.1172])
def test_zeta_is_rate_independent_if_and_only_if_lambda_is_zero(lam):
    p = MODEL.params("raw", {"lambda": lam})
    t = np.arange(5001) * 1e-3
    slow = states(p, t, sine(t))[:, 0]
    fast = states(p, t / 10, sine(t / 10, omega=10 * OMEGA))[:, 0]

    if lam == 0.0:
        assert np.abs(slow - fast).max() < 5e-15
    else:
        assert np.abs(slow - fast).max() == pytest.approx(0.52, abs=0.02)


def test_work_of_a_closed_cycle_is_positive_without_lambda():
    t = np.arange(15001) * 1e-3
    for shape in ((0.5, 1.0), (1.7512, 2.0458), (3.3, 4.1)):
        p = MODEL.params("raw", dict(zip(("sigma", "n"), shape, strict=True)) | {"lambda": 0.0, "F_0": 0.0})
        y = MODEL.simulate(p, t, sine(t))
        assert y[5000:10000, 3].sum() > 0
        zeta = states(p, t, sine(t))[:, 0]
        assert (zeta[5000:10000] * sine(t)[5000:10000, 1]).sum() > 0


def test_stiffness_term_is_the_printed_quotient_of_exponentials():
    p = MODEL.params("raw", {"k_zeta": 0.0, "upsilon": 0.0, "F_0": 0.0})
    for x in (-0.7, 0.9):
        for v in (-1.3, 0.0, 0.6):
            for a in (-2.0, 3.0):
                e = math.exp(2 * v)
                printed = 10.121 * (e + np.sign(x) * np.sign(a)) / (e + 1) * x
                _, o = start(p, Inputs(x, v, a, 0.0, 0.0))
                assert o.F == pytest.approx(printed, rel=1e-13)
    assert math.isfinite(start(p, Inputs(0.7, 1e6, 1.0, 0.0, 0.0))[1].F)


def test_force_jumps_by_the_closed_form_where_a_changes_sign():
    p = MODEL.params("raw")
    s, _ = start(p, Inputs(0.8, 0.31, -0.2, 0.0, 0.0))
    tiny = 1e-12
    s, before = step(p, s, Inputs(0.8, 0.31, -1e-9, 0.0, 0.0), tiny)
    _, after = step(p, s, Inputs(0.8, 0.31, 1e-9, 0.0, 0.0), tiny)
    assert after.F - before.F == pytest.approx(10.121 * 0.8 * (1 - math.tanh(0.31)), rel=1e-6)


def test_sign_of_a_holds_at_zero_and_is_zero_before_any():
    p = MODEL.params("raw", {"k_x": 0.0, "upsilon": 0.0, "F_0": 0.0})
    s, o = start(p, Inputs(0.3, 0.0, 0.0, 0.0, 0.0))
    s, o = step(p, s, Inputs(0.3, 0.0, 0.0, 0.0, 0.0), 0.1)
    assert (s.s_a, o.F) == (0.0, 0.0)  # w = v: nothing moves
    s, _ = step(p, s, Inputs(0.3, 0.0, -1.0, 0.0, 0.0), 0.1)
    held, _ = step(p, s, Inputs(0.3, 0.0, 0.0, 0.0, 0.0), 0.1)
    assert held.s_a == -1.0
    assert held.zeta > s.zeta > 0  # lambda < 0 with a < 0: w > 0


def test_torque_balance_of_estimator_and_plant():
    p = MODEL.params("published", {"R": 0.0173})
    _, o = start(p, Inputs(0.41, 0.37, -0.9, 0.83, 0.29))
    assert o.tau_out == pytest.approx(0.83 - 0.0173 * o.F, rel=1e-15)
    assert o.tau_drive == pytest.approx(0.29 + 0.0173 * o.F, rel=1e-15)
    assert o.P_loss == pytest.approx(0.0173 * o.F * 0.37, rel=1e-15)
    assert start(p, Inputs(0.41, 0.37, -0.9, o.tau_drive, 0.0))[1].tau_out == pytest.approx(0.29, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("sigma", 0.49, r"parameter sigma = 0.49 .*bounded from 1/2.* -- expected a value in \[0.5, inf\)"),
        ("n", 0.97, r"parameter n = 0.97 .* -- expected a value in \[1, inf\)"),
        ("rho", 0.0, r"parameter rho = 0.0 1/rad .* -- expected a value in \(0, inf\)"),
        ("rho", -3.1, r"parameter rho = -3.1 1/rad .* -- expected a value in \(0, inf\)"),
        ("force_scale", 0.0, r"parameter force_scale = 0.0 .* -- expected a value in \(0, inf\)"),
        ("lambda", math.inf, r"parameter lambda = inf rad/s .* -- expected a finite number"),
    ],
)
def test_unbounded_parameters_are_refused(name, value, expected):
    with pytest.raises(InputError, match=expected):
        MODEL.params("published", {name: value})
