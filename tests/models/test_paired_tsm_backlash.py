"""PairedTsmBacklash and the Coleman-Hodgdon segment: oracles and closed forms of MSSP 2015."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.models.laws.coleman_hodgdon import hysteresis_after

MODEL = kernel("PairedTsmBacklash")
PUBLISHED = MODEL.params("published")
C, BETA, ALPHA = 1.00056, -0.91693, 10.1062
A = math.pi / 3


def simulate(p, x_in):
    x_in = np.asarray(x_in, dtype=float)
    return MODEL.simulate(p, np.arange(x_in.size) * 0.01, x_in[:, None])


def test_path_of_turning_points_to_the_printed_digits():
    y = simulate(PUBLISHED, [0, A, -A, A, A / 2, -A / 2, 0])
    printed = [-0.09072715426, 0.09072945309, -0.09072945309, 0.08981603800, 0.09072943006, -0.08981603812]
    assert y[1:, 1] == pytest.approx(printed, abs=6e-12)
    assert y[-1, 0] == pytest.approx(-0.08981603812, abs=6e-12)


def test_segment_is_the_solution_of_equation_10():
    for x_h, dx in [(0.031, 0.27), (-0.08, -0.113), (0.4, -1.9)]:
        solution = solve_ivp(
            lambda _, h, s: s * BETA - ALPHA * h,
            (0, abs(dx)),
            [x_h],
            args=(math.copysign(1, dx),),
            rtol=1e-12,
            atol=1e-14,
        )
        assert hysteresis_after(x_h, dx, BETA, ALPHA) == pytest.approx(solution.y[0, -1], abs=1e-11)


def test_equations_8_and_9_agree_with_the_step():
    def equation_8(t, x_out):
        x, rate = 0.9 * math.sin(t), 0.9 * math.cos(t)
        return ALPHA * abs(rate) * (C * x - x_out) + (C + BETA) * rate

    x_out = 0.0
    for a, b in [(0, math.pi / 2), (math.pi / 2, 4.1)]:
        x_out = solve_ivp(equation_8, (a, b), [x_out], rtol=1e-11, atol=1e-13, method="DOP853").y[0, -1]
    path = 0.9 * np.sin([0, math.pi / 2, 4.1])
    assert simulate(PUBLISHED, path)[-1, 0] == pytest.approx(x_out, abs=1e-9)


@pytest.mark.parametrize(("amplitude", "alpha"), [(A, ALPHA), (0.07, 3.864), (0.41, 0.83)])
def test_loop_half_height_and_area(amplitude, alpha):
    p = MODEL.params(None, {"alpha": alpha})
    x = np.concatenate([amplitude * np.sin(np.linspace(-math.pi / 2, math.pi / 2, 4001))])
    cycle = np.concatenate([x, x[-2::-1]])
    path = np.concatenate([np.tile(cycle[:-1], 40), cycle])  # 40 cycles forget the start
    y = simulate(p, path)[-cycle.size :, 1]
    limit = -BETA / alpha
    h = limit * math.tanh(alpha * amplitude)
    assert y.max() == pytest.approx(h, rel=1e-6)
    assert -y.min() == pytest.approx(h, rel=1e-6)
    closed = 2 * (limit * 2 * amplitude - (h + limit) * (1 - math.exp(-2 * alpha * amplitude)) / alpha)
    assert abs(np.trapezoid(y, cycle)) == pytest.approx(closed, rel=1e-5)
    if amplitude == A:
        assert h == pytest.approx(0.0907295, abs=5e-8)
        assert closed == pytest.approx(0.344136, abs=5e-7)


def test_output_runs_backwards_after_a_reversal_of_the_published_set():
    x = A - np.linspace(0, 0.2, 20001)
    y = simulate(PUBLISHED, np.concatenate([[-A], x]))[1:, 0]
    rise = math.degrees(y.max() - y[0])
    closed = (C * math.log(-2 * BETA / C) - (-2 * BETA - C)) / ALPHA
    assert math.degrees(closed) == pytest.approx(-1.2875, abs=5e-5)  # along the motion: against it
    assert rise == pytest.approx(1.2875, abs=1e-4)
    assert math.degrees(x[0] - x[y.argmax()]) == pytest.approx(3.435, abs=1e-3)
    mild = MODEL.params(None, {"beta": -0.5 * C})
    assert (np.diff(simulate(mild, np.concatenate([[-A], x]))[1:, 0]) <= 1e-16).all()


def test_splitting_a_segment_changes_nothing():
    rng = np.random.default_rng(60)
    turns = np.concatenate([[0.0], np.cumsum(rng.normal(size=30))])
    split = np.concatenate([np.linspace(a, b, 14)[:-1] for a, b in pairwise(turns)])
    split = np.append(split, turns[-1])
    assert simulate(PUBLISHED, split)[::13] == pytest.approx(simulate(PUBLISHED, turns), abs=1e-13)


def test_bounded_odd_and_contracting():
    rng = np.random.default_rng(11)
    path = np.cumsum(rng.normal(size=4000) * 0.2)
    for x_h_0 in (0.0, 0.37, -0.02):
        p = PUBLISHED._replace(x_h_0=x_h_0)
        y = simulate(p, path)
        assert np.abs(y[:, 1]).max() <= max(abs(x_h_0), -BETA / ALPHA)
        assert (simulate(p._replace(x_h_0=-x_h_0), -path) == -y).all()
    two = simulate(PUBLISHED._replace(x_h_0=0.05), [0, 0.3])[1, 1], simulate(PUBLISHED, [0, 0.3])[1, 1]
    assert two[0] - two[1] == pytest.approx(0.05 * math.exp(-ALPHA * 0.3), rel=1e-12)


def test_motion_starts_where_it_is_and_the_offset_only_shifts():
    p = PUBLISHED._replace(x_0=-1.2, x_h_0=0.013)
    y = simulate(p, [2.3, 2.3, 2.4])
    assert y[0] == pytest.approx([C * 2.3 + 0.013 - 1.2, 0.013], rel=1e-15)
    assert (y[1] == y[0]).all()
    assert y[:, 0] + 1.2 == pytest.approx(simulate(p._replace(x_0=0.0), [2.3, 2.3, 2.4])[:, 0], rel=1e-14)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"alpha": 0.0}, r"parameter alpha = 0.0 1/rad .* -- expected a value in \(0, inf\)"),
        ({"c": -1.1}, r"parameter c = -1.1 .* -- expected a value in \(0, inf\)"),
        ({"beta": 0.0}, r"parameter beta = 0.0 .* -- expected a value in \(-inf, 0\)"),
        ({"beta": -1.3}, r"beta = -1.3 with c = 1.00056 gives B = .* -- expected B > 0 .* -- raise beta above -c"),
    ],
)
@pytest.mark.parametrize("name", ["PairedTsmBacklash", "FeedforwardCompensator", "TendonDrive", "DistalEstimator"])
def test_parameters_without_a_hysteresis_loop_are_refused(name, values, expected):
    with pytest.raises(InputError, match=expected):
        kernel(name).params("published", values)
