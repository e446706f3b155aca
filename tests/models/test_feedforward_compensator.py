"""FeedforwardCompensator, kernel to kernel with PairedTsmBacklash: the numbers of MSSP 2015 and the exact inverse."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.special import lambertw

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.models.laws.lambert_w import lambert_w0

PLANT = kernel("PairedTsmBacklash")
LAW = kernel("FeedforwardCompensator")
C, BETA, ALPHA = 1.00056, -0.91693, 10.1062
PUBLISHED: dict[str, float] = {}
A = math.pi / 3
T = np.arange(20001) * 1e-3
SCORED = T >= 10.0
PERIODIC = A * np.sin(0.4 * math.pi * T)
MIXED = math.pi / 6 * (np.sin(0.4 * math.pi * T) + np.sin(0.5 * math.pi * math.sqrt(3) * T))


def drive(x_ff, plant, time=T):
    return PLANT.simulate(PLANT.params(None, plant), time, x_ff)[:, 0]


def command(x_r, parameters, law, time=T):
    return LAW.simulate(LAW.params(None, {**parameters, "law": law}), time, x_r[:, None])


def slope(b, alpha):
    return {"beta": b - C, "alpha": alpha}


def error(x_r, plant, compensator, law):
    return np.degrees(drive(command(x_r, compensator, law), plant) - x_r)[SCORED]


def test_uncompensated_error_is_the_loop_width():
    e = np.degrees(drive(PERIODIC[:, None], PUBLISHED) - PERIODIC)[SCORED]
    closed = math.degrees(-2 * BETA / ALPHA * math.tanh(ALPHA * A))
    assert closed == pytest.approx(10.397, abs=5e-4)
    assert np.ptp(e) == pytest.approx(10.406, abs=1e-3)  # c - 1 included


def test_printed_law_leaves_the_closed_form_error_with_perfect_parameters():
    e = error(PERIODIC, PUBLISHED, PUBLISHED, law=1)
    y = np.linspace(0, 1, 200001)
    closed = math.degrees(-2 * BETA / ALPHA * (y * (1 - np.exp(2 * BETA / C * (1 - y)))).max())
    assert closed == pytest.approx(3.2415, abs=5e-5)
    assert np.abs(e).max() == pytest.approx(closed, abs=2e-3)
    assert np.ptp(e) == pytest.approx(6.481, abs=1e-3)
    assert e.std() == pytest.approx(1.017, abs=1e-3)
    assert 1.24 <= error(MIXED, PUBLISHED, PUBLISHED, law=1).std() <= 1.28


@pytest.mark.parametrize(
    ("plant", "own", "published"),
    [(slope(0.65, 3.864), (3.09, 0.640), (2.51, 0.491)), (slope(0.70, 3.31), (2.70, 0.586), (3.62, 0.748))],
)
def test_printed_law_on_plants_of_a_milder_slope(plant, own, published):
    for compensator, (peak_to_peak, std) in ((plant, own), (PUBLISHED, published)):
        e = error(PERIODIC, plant, compensator, law=1)
        assert np.ptp(e) == pytest.approx(peak_to_peak, abs=0.0051)
        assert e.std() == pytest.approx(std, abs=5.1e-4)


@pytest.mark.parametrize("b", [0.003, 0.08363, 0.31, 0.4999, 0.50028, 0.5003, 0.65, 0.70, 0.997])
@pytest.mark.parametrize("x_r", [PERIODIC, MIXED], ids=["periodic", "mixed"])
def test_exact_law_composes_with_the_plant_to_identity(x_r, b):
    for alpha in (0.37, ALPHA, 93.0):
        both = slope(b, alpha) | {"x_h_0": 0.21 * (b - C) / alpha, "x_0": -0.13}
        e = np.degrees(drive(command(x_r, both, law=2), both) - x_r)
        assert np.abs(e).max() < 1e-12


def test_exact_law_bears_holds_and_tiny_moves():
    rng = np.random.default_rng(404)
    time = np.arange(3001.0)
    for _ in range(40):
        b, alpha = C * rng.uniform(0.002, 0.998), 10 ** rng.uniform(-1, 2)
        moves = rng.normal(size=time.size) * 10.0 ** rng.uniform(-14, -1, size=time.size)
        moves[rng.random(time.size) < 0.3] = 0.0
        x_r = np.cumsum(moves)
        x_r *= min(1.0, A / np.abs(x_r).max())
        x_ff = command(x_r, slope(b, alpha), 2, time)
        assert np.abs(np.degrees(drive(x_ff, slope(b, alpha), time) - x_r)).max() < 1e-12
        held = np.diff(x_r) == 0.0
        assert (np.diff(x_ff[:, 0])[held] == 0.0).all()


@pytest.mark.parametrize("b", [0.08363, 0.50028, 0.65])
def test_exact_law_does_not_depend_on_how_a_segment_is_split(b):
    turns = np.array([0.0, 0.7, -0.2, -0.19, -0.6, 1.1])
    split = np.concatenate([np.linspace(p, q, 101)[:-1] for p, q in pairwise(turns)])
    split = np.append(split, turns[-1])
    whole = command(turns, slope(b, ALPHA), 2, np.arange(turns.size) * 1.0)
    parts = command(split, slope(b, ALPHA), 2, np.arange(split.size) * 1.0)
    assert parts[::100] == pytest.approx(whole, abs=1e-12)


def test_exact_law_is_the_lambert_closed_form():
    """The formula in its literal form, scipy's W0, one monotone segment after a full reversal."""
    b, x_h0 = 0.65, 0.09
    alpha, beta = 3.864, 0.65 - C
    y = 0.31
    g = x_h0 - beta / alpha
    d = (y + g) / C + lambertw(-(alpha * g / C) * math.exp(-alpha * (y + g) / C)).real / alpha
    x_ff = command(np.array([0.2, 0.2 + y]), slope(b, alpha) | {"x_h_0": x_h0}, 2, np.arange(2.0))
    assert x_ff[1, 0] - x_ff[0, 0] == pytest.approx(d, abs=1e-14)


def test_exact_law_from_a_start_far_outside_the_loop():
    time = np.arange(2.0)
    for x_h_0 in (400.0, -400.0):
        both = slope(0.65, 3.864) | {"x_h_0": x_h_0}
        x_r = np.array([0.0, 0.3])
        assert drive(command(x_r, both, 2, time), both, time) == pytest.approx(x_r, abs=1e-10)


def test_exact_law_jumps_at_reversals_below_half_slope_and_says_so():
    jumps = {}
    for b in (0.08363, 0.51):
        x_ff = command(PERIODIC, slope(b, ALPHA), 2)[:, 0]
        jumps[b] = math.degrees(np.abs(np.diff(x_ff) - np.diff(PERIODIC) / C).max())
    assert jumps[0.08363] == pytest.approx(7.736, abs=1e-3)
    assert jumps[0.51] < 0.5
    (text,) = LAW.warnings(LAW.params(None, {"law": 2}))
    assert "B = c + beta = 0.08363 is below c/2 = 0.50028 -- law 2 jumps by up to 7.736 deg" in text
    assert LAW.warnings(LAW.params(None, {"law": 1})) == ()
    assert LAW.warnings(LAW.params(None, {"law": 2, **slope(0.51, ALPHA)})) == ()


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (3, r"parameter law = 3 \(1 as in the paper, .*\) -- expected 1 \(paper\) or 2 \(exact_inverse\)"),
        (1.5, r"parameter law = 1.5 -- expected an integer"),
    ],
)
def test_unknown_law_is_refused(value, expected):
    with pytest.raises(InputError, match=expected):
        LAW.params(None, {"law": value})


def test_lambert_w_against_scipy():
    x = np.concatenate([-np.exp(-1) * (1 - np.logspace(-12, -0.01, 60)), np.logspace(-300, 300, 121)])
    for argument in x:
        ours = lambert_w0(argument)
        near_branch = 1 + math.e * argument
        tolerance = 1e-14 + (2e-16 / math.sqrt(near_branch) if near_branch > 0 else 0)
        assert ours == pytest.approx(lambertw(argument).real, rel=2 * tolerance)
    assert lambert_w0(0.0) == 0.0
    assert lambert_w0(-math.exp(-1)) == pytest.approx(-1.0, abs=3e-8)
