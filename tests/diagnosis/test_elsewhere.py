"""What the steps of an encoder leave open: where a model tells motions with the same readings apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.fits.known import compared_where_known
from tsm_fmu.diagnosis.fits.refit import Task, as_given
from tsm_fmu.diagnosis.runs.displacement import with_speeds_of_position
from tsm_fmu.diagnosis.runs.drivers import drives_of
from tsm_fmu.diagnosis.runs.elsewhere import elsewhere
from tsm_fmu.diagnosis.runs.prepared import PreparedRuns, prepared
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.problem import FitRun

FINE, RATE = 10, 220.0
LEVEL, PRESLIDING = 41.3, 3.3e-5
"""Friction [N], and the distance [m] over which it turns over."""


def motion(back: float, rest: float = 0.9) -> tuple[np.ndarray, np.ndarray]:
    """Strokes to and fro, a rest after each, at which the drive comes back by ``back`` [m]; time and position."""
    time = np.arange(int(19.0 * RATE) * FINE) / (RATE * FINE)
    x, sides = np.zeros(time.size), [2.1e-3, -1.3e-3, 1.7e-3, -2.3e-3, 0.9e-3, -1.9e-3]
    at = 0.0
    for k, way in enumerate(sides):
        begin = 0.37 + k * (1.7 + rest)
        part = np.clip((time - begin) / 1.7, 0.0, 1.0)
        settled = np.clip((time - begin - 1.7) / 0.19, 0.0, 1.0)
        x += (way - at) * part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
        x -= np.sign(way - at) * back * settled**2 * (3.0 - 2.0 * settled)
        at = way - np.sign(way - at) * back
    return time, x


def friction(x: np.ndarray) -> np.ndarray:
    """Dahl's law along a path, in closed form from sample to sample."""
    z, found = 0.0, np.zeros(x.size)
    for k in range(1, x.size):
        dx = x[k] - x[k - 1]
        if dx:
            s = np.sign(dx)
            z = s + (z - s) * np.exp(-abs(dx) / PRESLIDING)
        found[k] = LEVEL * z
    return found


def log(back: float, step: float) -> tuple[Record, np.ndarray]:
    """A run with readings of a position and its friction, and the position itself."""
    time, x = motion(back)
    kept = slice(FINE - 1, None, FINE)
    read = step * np.round((x[kept] - 0.31 * step) / step) if step else x[kept]
    noise = 0.05 * np.random.default_rng(607).standard_normal(read.size)
    columns = {"x": read, "F": friction(x)[kept] + noise}
    return Record("r", time[kept] - time[kept][0], columns, {"x": "m", "F": "N"}), x[kept]


def runs_of(record: Record) -> PreparedRuns:
    model = kernel("LuGreFriction")
    (moved,), _ = with_speeds_of_position(model, [record], None)
    return prepared(model, [moved], [], [], None)


def fitted(runs: PreparedRuns, stiffness: float = 1.0) -> Any:
    """The rig's own law, with another stiffness if wished."""
    values = {
        "sigma0": stiffness * LEVEL / PRESLIDING, "sigma1": 1.0, "sigma2": 0.0, "F_c": LEVEL, "F_s": LEVEL, "v_s": 0.01,
    }  # fmt: skip
    return as_given(Task("LuGreFriction", runs.measured, runs.channels, values, drives=drives_of(runs.model)), ())


def left_out(runs: PreparedRuns, stiffness: float = 1.0) -> np.ndarray:
    (run,) = compared_where_known(runs, fitted(runs, stiffness)).measured
    return run.unresolved[:, 0] if run.unresolved.size else np.zeros(run.time.size, bool)


@pytest.mark.parametrize("stiffness", [0.6, 1.0, 1.7])
def test_a_rest_after_a_small_way_back_is_not_compared(stiffness: float) -> None:
    """The way back is one and a half steps and a tenth of the presliding distance: what the model makes of the readings
    is wrong there by much, whatever its stiffness, and next to nowhere else.
    """
    record, _ = log(back=4.4e-6, step=2.9e-6)
    runs = runs_of(record)
    out, wrong = left_out(runs, stiffness), np.abs(fitted(runs).residuals[0][:, 0])
    assert 0.2 < out.mean() < 0.5
    assert wrong[out].mean() > 5.0 * wrong[~out].mean()
    assert (wrong[~out] > 0.1 * LEVEL).mean() < 0.03
    speeds = np.abs(np.gradient(record.columns["x"][-out.size :], record.time[-out.size :]))
    assert (speeds[out] < 0.05 * speeds.max()).mean() > 0.8


@pytest.mark.parametrize(("back", "step"), [(4.4e-6, 2e-8), (4.4e-6, 0.0), (0.0, 2.9e-7)])
def test_what_the_readings_tell_is_compared(back: float, step: float) -> None:
    assert left_out(runs_of(log(back, step)[0])).mean() < 0.01


def test_a_log_that_resolves_nothing_is_compared_as_it_is() -> None:
    runs = runs_of(log(back=4.4e-5, step=1.3e-4)[0])
    assert left_out(runs).mean() <= 0.5


def test_the_other_motions_keep_to_the_readings_and_hold_the_true_one_at_its_reversals() -> None:
    step = 0.0137
    t = np.arange(2600) / RATE
    true = 0.7 * np.sin(1.3 * t) + 0.23 * np.sin(4.7 * t + 0.4) + 0.011 * np.sin(23.0 * t)
    model = kernel("TendonDrive")
    read = FitRun("r", t, np.column_stack([step * np.round(true / step), 0.0 * t]), true[:, None])
    used = FitRun("r", t, np.column_stack([true, 0.0 * t]), true[:, None])
    other = elsewhere(model, read, used)
    assert other is not None
    late, early = other.late[:, 0], other.early[:, 0]
    for moved in (late, early):
        assert np.abs(moved - read.inputs[:, 0]).max() <= 1.5 * step
        np.testing.assert_array_equal((other.late if moved is late else other.early)[:, 1], 0.0)
    way = [np.abs(np.diff(x)).sum() for x in (early, true, late)]
    assert way[0] < way[1] < way[2]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(true)))) + 1
    large = [k for k in turns if np.ptp(true[max(0, k - 40) : k + 40]) > 3.0 * step]
    assert len(large) > 10
    for k in large:
        low, high = sorted((late[k], early[k]))
        assert low - 0.15 * step <= true[k] <= high + 0.15 * step


def test_without_steps_reversals_or_a_motion_there_is_no_other_motion() -> None:
    t = np.arange(900) / RATE
    model, one = kernel("TendonDrive"), np.zeros(900)

    def other(x: np.ndarray) -> Any:
        run = FitRun("r", t, np.column_stack([x, one]), x[:, None])
        return elsewhere(model, run, run)

    assert other(np.sin(t)) is None
    assert other(one) is None
    assert other(0.01 * np.round(np.sin(3.0 * t) / 0.01)) is not None
    still = FitRun("r", t, np.column_stack([t, t]), t[:, None])
    assert elsewhere(kernel("LebusWinding"), still, still) is None
