"""Speeds that move as a measured position does: against closed forms, and where they are not taken."""

import numpy as np
import pytest

from tsm_fmu.diagnosis.runs.displacement import between_steps, with_position_between_steps, with_speeds_of_position
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.differentiate import differentiate
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.problem import FitRun

RATE = 173.0
LUGRE = kernel("LuGreFriction")


def strokes(time):
    """Strokes with short reversals, and a rest of 1.6 s; with their speed."""
    w, moving = 2.0 * np.pi * 0.83, time - np.clip(time - 6.1, 0.0, 1.6)
    x = 0.0173 * np.tanh(2.3 * np.sin(w * moving))
    v = 0.0173 * 2.3 * w * np.cos(w * moving) / np.cosh(2.3 * np.sin(w * moving)) ** 2
    return x, np.where((time > 6.1) & (time < 7.7), 0.0, v)


def dahl(x, x_0):
    """Presliding state along a position, exact for each step."""
    z, found = 0.0, np.zeros(x.size)
    for k in range(1, x.size):
        dx = x[k] - x[k - 1]
        s = np.sign(dx)
        z = s + (z - s) * np.exp(-abs(dx) / x_0) if dx else z
        found[k] = z
    return found


def rms(y):
    return float(np.sqrt(np.mean(np.square(y))))


def speed_in(record):
    (found,), _ = with_speeds_of_position(LUGRE, [record], None)
    return found.columns["v"]


@pytest.mark.parametrize("step", [0.0, 7.1e-6, 4.7e-5])
def test_a_step_is_what_the_encoder_has_moved(step):
    time = np.arange(int(11.0 * RATE)) / RATE
    x, v = strokes(time)
    read = x if step == 0.0 else step * np.round(x / step)
    speed = speed_in(record(time, {"x": read, "F": x}))
    way = np.append(0.0, np.cumsum(speed[1:] * np.diff(time)))
    assert np.ptp((way - x)[5:-5]) < 2.0 * step + 1e-12
    assert rms(speed[1:] - 0.5 * (v[1:] + v[:-1])) < 0.03 * rms(v)
    assert speed[0] == 0.0
    # what a presliding state makes of it, of a differentiator's speed, and of what was read
    truth, late = dahl(x, 6e-4), time > 1.0
    smooth = differentiate(time, read).values
    derived = np.append(0.0, np.cumsum(smooth[1:] * np.diff(time)))
    mine, theirs, as_read = (rms((dahl(path, 6e-4) - truth)[late]) for path in (way, derived, read))
    assert mine < 0.15 * theirs
    assert mine <= (0.7 * as_read if step else 1e-9)


def test_stamps_that_jitter_are_in_the_speed():
    rng = np.random.default_rng(4127)
    time = np.sort((np.arange(1500) + 0.3 * rng.uniform(-1.0, 1.0, 1500)) / RATE)
    x, v = strokes(time)
    for step in (0.0, 1.3e-5):
        read = x if step == 0.0 else step * np.round(x / step)
        speed = speed_in(record(time, {"x": read, "F": x}))
        assert rms(speed[1:] - 0.5 * (v[1:] + v[:-1])) < 0.03 * rms(v)


def record(time, columns):
    units = {"x": "m", "v": "m/s", "F": "N"}
    return Record("r", time, columns, {name: units[name] for name in columns})


def test_a_log_with_both_has_the_speed_of_its_position():
    time = np.arange(2200) / RATE
    x, v = strokes(time)
    rng = np.random.default_rng(88)
    read, noisy = 1.3e-5 * np.round(x / 1.3e-5), v + 0.03 * rms(v) * rng.standard_normal(v.size)
    for columns in ({"x": read, "F": x}, {"x": read, "v": noisy, "F": x}):
        (found,), said = with_speeds_of_position(LUGRE, [record(time, columns)], None)
        expected = np.diff(between_steps(time, read)) / np.diff(time)
        np.testing.assert_array_equal(found.columns["v"], np.append(0.0, expected))
        assert found.units["v"] == "m/s"
        np.testing.assert_array_equal(found.columns["x"], read)
        assert said == ("v is what x has moved in each sample: reversals are not rounded off",)


def test_a_position_with_noise_a_cutoff_and_a_model_of_positions_keep_what_they_have():
    time = np.arange(2200) / RATE
    x, v = strokes(time)
    noise = 3e-5 * np.random.default_rng(5).standard_normal(x.size)
    for columns in ({"x": x + noise, "F": x}, {"v": v, "F": x}, {"x": x[::-1].copy(), "v": v, "F": x}):
        runs = [record(time, columns)]
        assert with_speeds_of_position(LUGRE, runs, None) == (runs, ())
    runs = [record(time, {"x": x, "F": x})]
    assert with_speeds_of_position(LUGRE, runs, 11.0) == (runs, ())
    assert with_speeds_of_position(kernel("PairedTsmBacklash"), runs, None) == (runs, ())


def test_the_position_that_drives_a_model_is_freed_from_its_steps():
    time = np.arange(2200) / RATE
    x = 0.0173 * np.sin(4.1 * time) * np.cos(1.3 * time)
    read = 1.3e-5 * np.round(x / 1.3e-5)
    paired = kernel("PairedTsmBacklash")
    found = with_position_between_steps(paired, FitRun("r", time, read[:, None], read[:, None]))
    assert rms(found.inputs[:, 0] - x) < 0.6 * rms(read - x)
    np.testing.assert_array_equal(found.targets[:, 0], read)  # what is compared stays what was measured
    noisy = read + 3e-5 * np.random.default_rng(8).standard_normal(x.size)
    for motion, model in ((noisy, paired), (x, paired), (read, LUGRE)):
        run = FitRun("r", time, motion[:, None], read[:, None])
        np.testing.assert_array_equal(with_position_between_steps(model, run).inputs, run.inputs)
    few = FitRun("r", time[:3], read[:3, None], read[:3, None])
    assert with_position_between_steps(paired, few) is few


def test_a_model_that_takes_the_acceleration_has_that_of_the_position():
    time = np.arange(2200) / RATE
    x, _ = strokes(time)
    read = 1.3e-5 * np.round(x / 1.3e-5)
    model = kernel("SingleTsmDahl")
    (found,), _ = with_speeds_of_position(model, [record(time, {"x": read, "F": x})], None)
    truth = np.gradient(np.gradient(x, time), time)
    smooth = np.abs(truth) < 20.0 * rms(truth[:800])  # not where the rest begins and ends at full speed
    mine, theirs = (rms((a - truth)[smooth]) for a in (found.columns["a"], differentiate(time, read, 2).values))
    assert mine < theirs
    (found,), _ = with_speeds_of_position(model, [record(time, {"x": x, "F": x})], None)
    np.testing.assert_array_equal(found.columns["a"], differentiate(time, x, 2).values)
    given = Record("r", time, {"x": read, "F": x, "a": 0.0 * x}, {"x": "m", "F": "N", "a": "m/s2"})
    (found,), _ = with_speeds_of_position(model, [given], None)
    assert not found.columns["a"].any()
