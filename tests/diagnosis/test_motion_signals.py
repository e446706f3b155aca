"""Coordinates of a run, means over them and what chance makes of a residual, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import sawtooth
from scipy.stats import norm

from tsm_fmu.diagnosis.residual.dependence import BINS, dependence
from tsm_fmu.diagnosis.residual.surrogates import SMALLEST, background, surrogates, tail
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates, coordinate_units, coordinates_of, position_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

BACKLASH, FRICTION = kernel("PairedTsmBacklash"), kernel("LuGreFriction")
DT = 0.004


def at(x: np.ndarray) -> Coordinates:
    t = 2.3 + DT * np.arange(x.size)
    return coordinates_of(BACKLASH, FitRun("r", t, x[:, None], x[:, None]), None)


def test_travel_since_a_reversal_begins_at_each_turn() -> None:
    """A triangle of 0.8 rad: after a turn at 0.9 the travel is 0.9 - x; before the first, the whole stroke."""
    t = DT * np.arange(3001)
    x = 0.5 + 0.4 * sawtooth(2.0 * math.pi * t / 4.0 + 1.0, 0.5)
    found = at(x + 3e-4 * np.sin(260.0 * t))  # wobble below a five-hundredth of the stroke is no turn
    turns = np.flatnonzero(np.diff(np.sign(np.diff(x))) != 0) + 1
    assert len(turns) == 6
    assert found.since_reversal[: turns[0] - 3] == pytest.approx(np.ptp(x), rel=0.01)
    for begin, end in zip(turns, [*turns[1:], x.size], strict=True):
        inside = slice(begin + 12, end - 12)
        assert found.since_reversal[inside] == pytest.approx(np.abs(x[inside] - x[begin]), abs=3e-3)


def test_a_stand_still_is_remembered_until_the_next() -> None:
    """It rests for 0.7 s and 2.0 s between strokes."""
    speeds, seconds = (0.4, 0.0, -0.4, 0.0, 0.4), (3.0, 0.7, 3.0, 2.0, 3.0)
    x = np.cumsum(np.repeat(speeds, [round(s / DT) for s in seconds])) * DT
    found, ends = at(x).dwell, np.cumsum(seconds)
    t = DT * np.arange(x.size)
    expected = ((0.2, ends[0], 0.0), (ends[1], ends[2], 0.7), (ends[3], ends[4], 2.0))
    for begin, end, dwell in expected:
        assert found[(t > begin + 0.1) & (t < end - 0.1)] == pytest.approx(dwell, abs=0.1)
    resting = (t > ends[2] + 0.3) & (t < ends[3] - 0.1)
    assert np.diff(found[resting]) == pytest.approx(DT)  # as long as it lasts, it grows


def test_the_position_of_a_speed_is_its_travel() -> None:
    t = 1.1 + np.cumsum(np.random.default_rng(4).uniform(0.5, 1.5, 400)) * DT
    v = np.full(400, -0.37)
    assert position_of(FRICTION, t, v[:, None]) == pytest.approx(-0.37 * (t - t[0]), abs=1e-12)
    run = FitRun("r", t, v[:, None], v[:, None])
    found = coordinates_of(FRICTION, run, None)
    assert found.v.tolist() == v.tolist()
    assert coordinate_units(FRICTION) == ("m", "1")
    assert coordinate_units(kernel("TendonDrive")) == ("rad", "N.m")


def test_signals_follow_a_slow_sine() -> None:
    t = DT * np.arange(4000)
    x = 0.7 * np.sin(1.3 * t)
    found, inner = at(x), slice(400, None)
    assert found.v[inner] == pytest.approx(0.7 * 1.3 * np.cos(1.3 * t[inner]), abs=0.03)
    assert found.a[inner] == pytest.approx(-0.7 * 1.69 * np.sin(1.3 * t[inner]), abs=0.06)
    assert found.x_pre == pytest.approx(0.02 * 1.4, rel=1e-3)
    fast = np.abs(np.cos(1.3 * t)) > 0.1
    assert found.s[fast & (t > 1.0)] == pytest.approx(np.sign(np.cos(1.3 * t[fast & (t > 1.0)])), abs=1e-6)
    late = coordinates_of(BACKLASH, FitRun("r", t, x[:, None], x[:, None]).compared_from(700), None)
    assert late.x.tolist() == x[700:].tolist()
    assert late.since_reversal.tolist() == found.since_reversal[700:].tolist()  # of the whole run


def test_means_over_a_coordinate_are_those_of_the_law_on_either_side() -> None:
    """R = 0.3 x + 0.2 sgn(v) with white noise: the curves are those lines, the bands the quantiles of means."""
    rng, t = np.random.default_rng(8), DT * np.arange(9000)
    x = 0.7 * np.sin(1.3 * t) + 0.1 * np.sin(4.7 * t)
    where = at(x)
    noise = 0.05 * rng.normal(size=x.size)
    sides = {d.direction: d for d in dependence([0.3 * x + 0.2 * where.s + noise], [where], "x", "rad", "1")}
    assert set(sides) == {"forth", "back"}
    for side, sign in (("forth", 1.0), ("back", -1.0)):
        found = sides[side]
        assert (found.coordinate, found.unit) == ("x", "rad")
        assert len(found.at) == BINS
        assert found.mean == pytest.approx(0.3 * np.asarray(found.at) + 0.2 * sign, abs=0.015)
        each = np.count_nonzero(where.s * sign > 0.0) / BINS
        width = 2.0 * norm.ppf(0.95) * math.hypot(0.05, 0.0) / math.sqrt(each)
        assert 0.5 * width < np.median(np.asarray(found.high) - np.asarray(found.low)) < 2.0 * width
        assert (np.asarray(found.low) <= np.asarray(found.mean) + 1e-12).all()
    (whole,) = dependence([0.4 * where.v + noise], [where], "v", "rad", "1")
    assert whole.direction == ""
    assert whole.mean == pytest.approx(0.4 * np.asarray(whole.at), abs=0.015)


def test_surrogates_keep_noise_and_lose_lines() -> None:
    rng, n = np.random.default_rng(2), 4096
    noise = rng.normal(size=n)
    line = 1.7 * np.cos(2.0 * math.pi * 0.0371 * np.arange(n))
    for series in (noise, noise + line + 5.0):
        made = surrogates(series, 40, rng)
        assert made.shape == (n, 40)
        assert made.mean(axis=0) == pytest.approx(series.mean(), abs=1e-9)
        assert made.std() == pytest.approx(1.0, rel=0.1)
        assert np.abs(np.corrcoef(made[:, 0], line)[0, 1]) < 0.1
    assert background(np.full(300, 3.0)) == pytest.approx(
        np.append(np.full(3, 3.0), np.full(297, 3.0 / 0.4549)), rel=1e-3
    )


def test_a_tail_is_the_probability_of_a_normal_statistic() -> None:
    drawn = 3.0 + 0.2 * np.random.default_rng(1).normal(size=20_000)
    for z in (0.0, 1.0, 1.5, 2.5):
        assert tail(3.0 + 0.2 * z, drawn) == pytest.approx(norm.sf(z), rel=0.15)
    assert 0.5 < tail(3.8, drawn) / norm.sf(4.0) < 2.0  # beyond what was drawn
    assert tail(30.0, drawn) == SMALLEST
    few = drawn[:99]
    assert tail(few.min() - 1.0, few) == 1.0
    assert tail(1.0, np.full(99, 1.0)) == 1.0  # nothing is spread: as much every time
    assert tail(1.1, np.full(99, 1.0)) == 0.01


def test_a_speed_that_is_derived_is_late_by_two_samples_and_its_acceleration_by_four() -> None:
    """From rest into a ramp: filters of the first order, each exact for a signal that holds from sample to sample."""
    t = DT * np.arange(400)
    x = np.where(t < 0.4, 0.0, 0.7 * (t - 0.4))
    after = t > 0.4 + 0.5 * DT
    gone = t[after] - 0.4
    found = at(x)
    assert found.v[after] == pytest.approx(0.7 * (1.0 - np.exp(-gone / (2.0 * DT))), abs=1e-6)
    assert not found.v[~after].any()
    assert found.a.max() == pytest.approx(0.7 / (4.0 * DT), rel=0.5)
    assert np.sum(found.a) * DT == pytest.approx(0.7, rel=1e-6)  # the speed that it has gained
    still = found.a[t > 0.5]
    assert np.abs(still).max() < 1e-2 * found.a.max()
    late = np.sum(DT * (0.7 - np.cumsum(found.a) * DT)[after]) / 0.7
    assert late == pytest.approx((2.0 + 4.0) * DT, abs=1.1 * DT)


def test_the_presliding_distance_is_a_fiftieth_of_the_stroke_unless_it_is_known() -> None:
    t = DT * np.arange(1000)
    x = 0.3 + 0.9 * t
    found = at(x)
    assert found.x_pre == pytest.approx(np.full(1000, 0.02 * np.ptp(x)))
    assert found.z == pytest.approx(1.0 - np.exp(-(x - x[0]) / (0.02 * np.ptp(x))), abs=1e-9)
    known = coordinates_of(BACKLASH, FitRun("r", t, x[:, None], x[:, None]), None, 0.31)
    assert known.z == pytest.approx(1.0 - np.exp(-(x - x[0]) / 0.31), abs=1e-9)
    assert at(np.full(50, 0.3)).x_pre == pytest.approx(np.full(50, 0.02))  # of one, where nothing moves
