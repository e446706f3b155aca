"""The normalised Bouc-Wen step against the hypergeometric travel and an adaptive integration of the printed Eq (6)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import hyp2f1

from tsm_fmu.models.laws import bouc_wen
from tsm_fmu.models.laws.bouc_wen import bouc_wen_after

SIGMA, N, RHO = 1.7512, 2.0458, 26.6659


def integrated(zeta, travel, sigma, n):
    """DOP853 on the printed right-hand side, stopped and started again where zeta passes 0 (a kink of |zeta|^n)."""
    s = np.sign(travel)

    def rate(_, z):
        return s - sigma * abs(z) ** (n - 1) * z + (sigma - 1) * s * abs(z) ** n

    def zero(_, z):
        return z[0]

    zero.terminal = True
    options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
    q = abs(travel)
    if zeta * s < 0:
        first = solve_ivp(rate, (0, q), [zeta], events=zero, **options)
        if first.status != 1:
            return first.y[0, -1]
        q -= first.t_events[0][0]
        zeta = 0.0
    return solve_ivp(rate, (0, q), [zeta], **options).y[0, -1]


@pytest.mark.parametrize(("reached", "u"), [(0.5, 0.0205036), (0.9, 0.0545477), (0.99, 0.0976434)])
def test_loading_from_zero_takes_the_hypergeometric_travel(reached, u):
    closed = reached * hyp2f1(1, 1 / N, 1 + 1 / N, reached**N) / RHO
    assert closed == pytest.approx(u, abs=5e-8)
    assert bouc_wen_after(0.0, RHO * closed, SIGMA, N) == pytest.approx(reached, abs=2e-8)


def test_unloading_from_minus_one_passes_zero_after_the_hypergeometric_travel():
    closed = hyp2f1(1, 1 / N, 1 + 1 / N, -(2 * SIGMA - 1)) / RHO
    assert closed == pytest.approx(0.0240461, abs=5e-8)
    assert bouc_wen_after(-1.0, RHO * closed, SIGMA, N) == pytest.approx(0.0, abs=2e-8)


@pytest.mark.parametrize("n", [1.0, 1.3, N, 2.952, 5.0, 37.3])
@pytest.mark.parametrize("sigma", [0.5, 0.71, SIGMA, 5.491])
def test_error_stays_below_1e_7_whatever_the_step(sigma, n):
    for zeta in (-1.0, -0.37, -0.011, 0.0, 0.023, 0.83):
        for travel in (0.0007, 0.041, 0.33, 2.7, -0.29):
            exact = integrated(zeta, travel, sigma, n)
            whole = bouc_wen_after(zeta, travel, sigma, n)
            parts = zeta
            for _ in range(7):
                parts = bouc_wen_after(parts, travel / 7, sigma, n)
            assert whole == pytest.approx(exact, abs=1e-7)
            assert parts == pytest.approx(exact, abs=1e-7)


def test_a_sharp_law_costs_no_more_than_a_round_one(monkeypatch):
    """Fits wander to n = 250; a step from one limit past the other then took 16 n parts and more."""
    monkeypatch.setattr(bouc_wen, "_MOST_PARTS", 400)
    for n in (1.03, 2.7, 19.0, 251.3):
        for sigma in (0.5, 0.93, 1.9):
            assert bouc_wen_after(-1.0, 41.3, sigma, n) == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize("d", [-0.0079, 0.0007, 0.0079])
@pytest.mark.parametrize("n", [1.2, 2.6, 31.0])
def test_the_approach_of_the_limit_is_its_integral(d, n):
    """Eq (6d): n q is the integral of n/(1 - (1 - d)^n) over d; scaled so that n d is as far from 0 as it may be."""
    far, near = d / n, 0.17 * d / n
    q = quad(lambda x: 1.0 / (1.0 - (1.0 - x) ** n), near, far, epsabs=0.0, epsrel=1e-12)[0]
    assert bouc_wen._approached(far, q, n) == pytest.approx(near, rel=1e-7)
    assert bouc_wen._approached(far, 0.0, n) == far


@pytest.mark.parametrize("zeta", [-12.3, -1.7, 1.8, 9.1])
def test_states_beyond_the_limit_come_back_like_the_integration(zeta):
    for travel in (0.013, 0.41, 2.9):
        exact = integrated(zeta, travel, 1.31, 2.4)
        assert bouc_wen_after(zeta, travel, 1.31, 2.4) == pytest.approx(exact, abs=3e-8 * abs(zeta))


def test_order_of_the_sub_steps_is_five(monkeypatch):
    exact = integrated(-0.93, 0.19, SIGMA, N)
    errors = []
    for resolution in (0.2, 0.1, 0.05):  # so fine that the distance to 0 sets no step
        monkeypatch.setattr(bouc_wen, "_RESOLUTION", resolution)
        errors.append(abs(bouc_wen_after(-0.93, 0.19, SIGMA, N) - exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[0] > 1e-7  # far above rounding, so that the ratio means something
    assert (orders > 4.5).all()


def test_elementary_solutions_of_n_1_and_n_2():
    assert bouc_wen_after(0.17, 0.83, 1.0, 1.0) == pytest.approx(1 - 0.83 * np.exp(-0.83), abs=1e-7)  # Dahl
    assert bouc_wen_after(0.0, 0.61, 2.3, 2.0) == pytest.approx(np.tanh(0.61), abs=2e-8)
    assert bouc_wen_after(-0.4, -1.9, 0.9, 2.0) == pytest.approx(-np.tanh(np.arctanh(0.4) + 1.9), abs=2e-8)


def test_bounded_and_monotone_for_any_step():
    rng = np.random.default_rng(20150601)
    for _ in range(4000):
        sigma, n = rng.uniform(0.5, 8), rng.uniform(1, 9)
        zeta, travel = rng.uniform(-3, 3), rng.choice([-1, 1]) * 10 ** rng.uniform(-9, 4)
        after = bouc_wen_after(zeta, travel, sigma, n)
        assert abs(after) <= max(1.0, abs(zeta))
        if abs(zeta) <= 1:
            assert (after - zeta) * travel >= 0


def test_odd_and_contracting():
    rng = np.random.default_rng(7)
    for _ in range(300):
        a, b, travel = rng.uniform(-1, 1, 3) * (1, 1, 2.3)
        one, other = bouc_wen_after(a, travel, SIGMA, N), bouc_wen_after(b, travel, SIGMA, N)
        assert bouc_wen_after(-a, -travel, SIGMA, N) == -one
        if a * travel > 0 and b * travel > 0:  # towards 1 from the loaded side neighbours approach each other
            assert abs(one - other) <= abs(a - b) + 1e-8


def test_runaway_state_is_refused():
    with pytest.raises(ValueError, match=r"beyond 1e6 -- expected about 1"):
        bouc_wen_after(2e6, 0.1, SIGMA, N)


@pytest.mark.parametrize("n", [1.3, 2.2, 3.7])
@pytest.mark.parametrize("unload", [-0.6, 0.0, 0.7])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_series_near_zero_leave_out_the_fourth_power(n, unload, sign):
    """Eq (6b): q = y 2F1(1, 1/n; 1 + 1/n; t) of t = kappa |y|^n; both ways the error of y is of order t^4 y."""
    kappa = 1.0 if sign > 0.0 else -unload
    for t in (0.2, 0.05, 0.01):
        y = sign * (t / abs(kappa)) ** (1.0 / n) if kappa else sign * t
        exact = y * hyp2f1(1.0, 1.0 / n, 1.0 + 1.0 / n, kappa * abs(y) ** n)
        bound = 2.0 * (t if kappa else 0.0) ** 4 + 1e-14
        assert bouc_wen._travel_from_zero(y, unload, n) == pytest.approx(exact, rel=bound)
        assert bouc_wen._from_zero(exact, unload, n) == pytest.approx(y, rel=bound)
