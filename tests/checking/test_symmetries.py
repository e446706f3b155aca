"""What a check finds depends on no unit, no sense and no direction of time; its numbers follow closed forms."""

import numpy as np
import pytest

from tsm_fmu.checking import check_record
from tsm_fmu.checking.coverage import _frequencies
from tsm_fmu.checking.power import check_power
from tsm_fmu.checking.run_check import _turning
from tsm_fmu.checking.sensor import Positions, check_clipping, check_quantisation, check_stuck
from tsm_fmu.logs.record import Record

N, RATE = 3001, 250.0
TIME = np.arange(N) / RATE
UNITS = {"x_in": "rad", "tau_in": "N.m"}


def record(**columns):
    return Record("r", TIME[: len(next(iter(columns.values())))], columns, {n: UNITS.get(n, "rad") for n in columns})


def cut_at_the_top(seed):
    """A smooth motion of several strokes that runs into a stop at different speeds on either side; the same noisy."""
    noise = np.random.default_rng(seed)
    x = np.sin(2 * np.pi * 0.61 * TIME + 0.3) + 0.37 * np.sin(2 * np.pi * 1.83 * TIME + noise.uniform(0, 6))
    return x, x + 0.02 * noise.standard_normal(N)


@pytest.mark.parametrize("seed", [0, 1, 3])
@pytest.mark.parametrize("noisy", [False, True])
def test_clipping_is_the_same_in_any_unit_sense_and_direction_of_time(seed, noisy):
    x = np.minimum(cut_at_the_top(seed)[noisy], 0.6)

    def clipped(values):
        found = check_clipping(record(x_in=values), "x_in", 0.0, 25)
        return [(f.text.split(" for ")[1], "upper" in f.text, f.rows) for f in found]

    (expected,) = clipped(x)
    for factor in (1e-3, 57.3):
        assert clipped(factor * x) == [expected]
    samples, upper, (first, last) = expected
    assert upper
    assert clipped(-x) == [(samples, False, (first, last))]
    assert clipped(x[::-1]) == [(samples, True, (N + 3 - last, N + 3 - first))]  # row 2 is the first sample
    assert clipped(cut_at_the_top(seed)[noisy]) == []


@pytest.mark.parametrize(("into", "out_of", "found"), [(1, 1, 1), (4, 1, 0), (1, 4, 0)])
def test_a_limit_is_a_stop_where_it_is_run_into_and_left_at_speed(into, out_of, found):
    """A position that creeps to its end, or away from it, with a power of the time left, rests there by itself."""
    k = np.arange(500.0)
    x = -np.where(k < 250.0, np.maximum(0.0, 200.0 - k) ** into / 200.0**into, 0.0)
    x -= np.where(k > 300.0, (k - 300.0) ** out_of / 200.0**out_of, 0.0)
    findings = check_clipping(record(x_in=np.tile(x, 6)), "x_in", 0.0, 25)
    assert len([f for f in findings if "upper" in f.text]) == found


def test_a_dead_channel_is_named_with_all_its_rows():
    run = record(x_in=np.sin(TIME), tau_in=np.full(N, 0.37))
    (found,) = check_stuck(run, "tau_in", Positions.of(run))
    assert found.rows == (2, N + 1)
    assert "0.37" in found.text


@pytest.mark.parametrize(("levels", "found"), [(49, 1), (50, 0)])
def test_fifty_steps_are_enough(levels, found):
    x = np.linspace(0.0, 1.0, N)
    assert len(check_quantisation(record(x_in=x), "x_in", 1.0 / levels)) == found


@pytest.mark.parametrize("phase", [0.0, 0.9, 2.2, 4.0, 5.5])
@pytest.mark.parametrize("strokes", [0.7, 1.6, 3.4])
def test_power_over_whole_strokes_leaves_out_what_a_spring_gives_back(strokes, phase):
    """Motion x = A sin(w t + p) against k x + d dx/dt: d (A w)^2 / 2 over whole periods, else the integral."""
    amplitude, omega, k, d = 0.41, 2 * np.pi * strokes / TIME[-1], 3.7, 0.013
    x = amplitude * np.sin(omega * TIME + phase)
    run = record(x_in=x, tau_in=k * x + d * amplitude * omega * np.cos(omega * TIME + phase))
    (power,), _ = check_power(run)
    up = np.flatnonzero((x[1:] > (x.max() + x.min()) / 2) & (x[:-1] <= (x.max() + x.min()) / 2))
    if up.size > 1:
        assert power.mean == pytest.approx(d * (amplitude * omega) ** 2 / 2, rel=0.02)
    else:
        angles = omega * TIME[[0, -1]] + phase
        spring = k * amplitude**2 * float(np.diff(np.sin(angles) ** 2)[0]) / 2
        lost = d * amplitude**2 * omega * float(np.diff(angles / 2 + np.sin(2 * angles) / 4)[0])
        assert power.mean == pytest.approx((spring + lost) / TIME[-1], rel=1e-3)


@pytest.mark.parametrize("frequency", [0.413, 0.76, 1.7777, 9.031])
def test_a_frequency_is_found_between_the_lines_of_the_spectrum(frequency):
    x = 3.1 + 0.2 * np.sin(2 * np.pi * frequency * TIME + 0.7)
    (found, *_) = _frequencies(record(x_in=x), "x_in")
    assert found == pytest.approx(frequency, abs=0.05 / TIME[-1])


def test_turning_lasts_until_a_tenth_of_the_range_is_left_behind():
    """A trapezoid: rests at -2 and 3, a ramp between; the range is 5, so a tenth of it is half a unit."""
    x = np.interp(np.arange(1000.0), [0, 200, 450, 700, 1000], [-2.0, -2.0, 3.0, 3.0, -3.0 + 1.0])
    v = np.gradient(x)
    marked = np.flatnonzero(np.diff(_turning(x, v, 10).astype(int), prepend=0, append=0))
    ramp_up = 0.5 / (5.0 / 250.0)
    ramp_down = 0.5 / (5.0 / 300.0)
    assert marked == pytest.approx([0, 200 + ramp_up + 10, 450 - 10, 700 + ramp_down + 10], abs=2.0)


def test_a_check_is_the_same_in_any_unit_and_sense():
    x = np.minimum(cut_at_the_top(5)[1], 0.6)
    kinds = [(f.kind, f.rows) for f in check_record(record(x_in=x)).findings]
    for factor in (-1.0, 1e-3, 57.3):
        assert [(f.kind, f.rows) for f in check_record(record(x_in=factor * x)).findings] == kinds
