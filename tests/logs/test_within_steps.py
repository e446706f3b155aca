"""The smoothest motion within an encoder's steps: against closed forms, and what it must keep to."""

import numpy as np
import pytest

from tsm_fmu.logs.within_steps import smoothest_within_steps

STEP = 0.0137


def rms(y):
    return float(np.sqrt(np.mean(np.square(y))))


def read(x):
    return STEP * np.round(x / STEP)


def slope(y, time):
    return np.gradient(y, time)


@pytest.mark.parametrize("rate", [61.0, 400.0, 1300.0])
@pytest.mark.parametrize("amplitude", [0.31, 1.7, 23.0])
def test_speed_and_acceleration_of_a_motion_of_slow_and_fast_parts(rate, amplitude):
    time = np.arange(int(9.0 * rate)) / rate
    phase = 2.0 * np.pi * (0.21 * time + 0.06 * time**2)  # 0.2 to 1.3 Hz
    x = amplitude * np.sin(phase) / (1.0 + 0.2 * time)
    found = smoothest_within_steps(time, read(x), STEP)
    assert np.abs(found - read(x)).max() <= STEP
    inner = slice(5, -5)
    by_steps = rms((slope(read(x), time) - slope(x, time))[inner])
    assert rms((slope(found, time) - slope(x, time))[inner]) < 0.35 * by_steps
    a, late = slope(slope(x, time), time), slope(slope(found, time), time)
    assert rms((late - a)[inner]) < 0.35 * rms(a)
    assert rms(found - x) < 0.7 * rms(read(x) - x)


def test_a_steady_motion_is_one_speed():
    time = np.arange(3000) / 250.0
    found = smoothest_within_steps(time, read(0.911 * time), STEP)
    assert slope(found, time)[20:-20] == pytest.approx(0.911, rel=0.01)


def test_nothing_moves_at_a_rest_and_what_follows_begins_there():
    time = np.arange(2600) / 250.0
    going = np.clip(time - 1.3, 0.0, 2.0) + np.clip(time - 6.1, 0.0, 2.0)
    x = 0.47 * (1.0 - np.cos(np.pi * going))
    found = smoothest_within_steps(time, read(x), STEP)
    for first, end in ((0.05, 1.1), (3.5, 5.9), (8.3, 10.3)):
        assert np.ptp(found[(time > first) & (time < end)]) == 0.0
    assert np.abs(np.diff(found)).max() < 1.3 * np.abs(np.diff(x)).max()  # without a jump at either end
    assert np.abs(found - read(x)).max() <= 1.0001 * STEP


def test_a_slow_reversal_is_no_rest():
    time = np.arange(4000) / 250.0
    x = 1.3 * np.cos(0.17 * 2.0 * np.pi * (time - 3.1))
    found = smoothest_within_steps(time, read(x), STEP)
    still = np.count_nonzero(np.diff(found) == 0.0)
    assert still == 0
    assert rms(found - x) < 0.4 * rms(read(x) - x)


def test_units_an_offset_and_stamps_that_jitter():
    rng = np.random.default_rng(71)
    time = np.sort((np.arange(1900) + 0.3 * rng.uniform(-1.0, 1.0, 1900)) / 230.0)
    x = 0.83 * np.sin(2.1 * time) + 0.1 * np.sin(9.7 * time)
    found = smoothest_within_steps(time, read(x), STEP)
    assert rms(found - x) < 0.5 * rms(read(x) - x)
    other = smoothest_within_steps(1e3 * time, 57.3 * read(x) + 1e4, 57.3 * STEP)
    assert (other - 1e4) / 57.3 == pytest.approx(found, abs=1e-6 * STEP * 1e3)


@pytest.mark.parametrize("samples", [1, 2, 11, 12, 13, 40])
def test_few_samples(samples):
    time = np.arange(samples) / 100.0
    x = read(np.sin(2.0 * time))
    found = smoothest_within_steps(time, x, STEP)
    assert found.shape == x.shape
    assert np.abs(found - x).max() <= STEP
