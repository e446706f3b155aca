"""What a drive did before its log: compared is what a fitted model no longer tells by it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.fits.known import compared_where_known
from tsm_fmu.diagnosis.fits.refit import Task, as_given
from tsm_fmu.diagnosis.runs.displacement import with_speeds_of_position
from tsm_fmu.diagnosis.runs.drivers import drives_of
from tsm_fmu.diagnosis.runs.pasts import coming_from
from tsm_fmu.diagnosis.runs.prepared import PreparedRuns, prepared
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.problem import FitRun

LEVEL, RATE = 7.3, 310.0
"""Friction [N] and samples a second."""
STROKE = 2 * 1.83e-3
UNKNOWN = np.sqrt(12.0) * 0.02
"""Part of the spread by which a model may tell two pasts apart: 2 % RMS where all between them are as likely."""


def friction(x: np.ndarray, x_0: float, begin: float) -> np.ndarray:
    """Dahl's law along a path, in closed form from sample to sample."""
    found = np.empty(x.size)
    found[0] = z = begin
    for k, dx in enumerate(np.diff(x), start=1):
        side = np.sign(dx)
        z = side + (z - side) * np.exp(-abs(dx) / x_0) if dx else z
        found[k] = z
    return LEVEL * found


def runs_with(x_0: float, begin: float, rest: float = 0.0) -> tuple[PreparedRuns, np.ndarray, np.ndarray]:
    """Runs that forget over ``x_0`` [m] that they began with the part ``begin`` of the friction; time and travel."""
    time = np.arange(int((9.0 + rest) * RATE)) / RATE
    x = 0.5 * STROKE * np.sin(0.83 * np.maximum(time - rest, 0.0))
    model = kernel("LuGreFriction")
    record = Record("r", time, {"x": x, "F": friction(x, x_0, begin)}, {"x": "m", "F": "N"})
    (moved,), _ = with_speeds_of_position(model, [record], None)
    return prepared(model, [moved], [], [moved], None), time, np.append(0.0, np.cumsum(np.abs(np.diff(x))))


def fitted(runs: PreparedRuns, x_0: float) -> Any:
    values = {"sigma0": LEVEL / x_0, "sigma1": 0.0, "sigma2": 0.0, "F_c": LEVEL, "F_s": LEVEL, "v_s": 0.01}
    return as_given(Task("LuGreFriction", runs.measured, runs.channels, values, drives=drives_of(runs.model)), ())


@pytest.mark.parametrize("begin", [1.0, 0.4, -1.0])
@pytest.mark.parametrize(("x_0", "rest"), [(0.31e-3, 0.0), (0.42e-3, 1.3)])
def test_a_run_is_compared_from_where_its_model_has_forgotten_the_side_it_came_from(
    begin: float, x_0: float, rest: float
) -> None:
    """Of two pasts the difference is 2 F_c exp(-travel/x_0), whatever the way (Dahl's law is linear in its state)."""
    runs, time, travel = runs_with(x_0, begin, rest)
    fit = fitted(runs, x_0)
    found = compared_where_known(runs, fit)
    for run in (*found.measured, *found.holdout):
        apart = 2.0 * LEVEL * np.exp(-travel / x_0)
        expected = np.flatnonzero(apart > UNKNOWN * fit.spread[0])[-1] + 1
        assert run.lead_time[0] == 0.0
        assert run.time[0] == pytest.approx(time[expected], abs=2.0 / RATE)
        assert run.time[0] > runs.measured[0].time[0] + 0.05  # where nobody asks a model
        left = run.targets[:, 0] - fit.problem.with_runs([run]).outputs(0, fit.table[0])[:, 0]
        assert np.abs(left).max() < UNKNOWN * fit.spread[0]


def test_a_model_that_takes_friction_for_a_spring_does_not_hold_up_a_run_for_long() -> None:
    """It remembers for more than half of the stroke."""
    runs, time, travel = runs_with(1.7e-3, 1.0)
    (run,) = compared_where_known(runs, fitted(runs, 1.7e-3)).measured
    assert run.time[0] == pytest.approx(time[np.searchsorted(travel, 0.5 * STROKE)], abs=2.0 / RATE)


def test_what_is_forgotten_is_compared() -> None:
    runs, *_ = runs_with(0.021e-3, -1.0)
    assert compared_where_known(runs, fitted(runs, 0.021e-3)) == runs


def test_half_of_a_run_is_compared_whatever_the_model_remembers() -> None:
    runs, time, _ = runs_with(1.7e-3, 1.0, rest=6.0)
    (run,) = compared_where_known(runs, fitted(runs, 1.7e-3)).measured
    assert run.time.size == time.size - time.size // 2


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("name", ["LuGreFriction", "TendonDrive"])
def test_a_past_leads_to_the_first_sample_from_its_side(name: str, way: float) -> None:
    model = kernel(name)
    time = 0.4 + np.arange(900) / RATE
    x = 0.31 + 0.2 * np.sin(3.1 * time)
    motion = np.gradient(x, time) if model.motion == "v" else x
    inputs = np.column_stack([motion, *(np.full(time.size, 0.17 * k) for k in range(1, len(model.inputs)))])
    whole = FitRun("r", time, inputs, x[:, None])
    for run in (whole, whole.compared_from(37)):
        found = coming_from(model, run, way, 0.4)
        times, driven = found.with_lead
        past = times.size - time.size
        assert past > 100
        np.testing.assert_array_equal(times[past:], time)
        np.testing.assert_array_equal(driven[past:], inputs)
        assert (np.diff(times) > 0.0).all()
        np.testing.assert_array_equal(driven[:past, 1:], np.repeat(inputs[:1, 1:], past, axis=0))
        moved = driven[:past, 0] * np.diff(times)[:past] if model.motion == "v" else np.diff(driven[: past + 1, 0])
        assert (way * moved > 0.0).all()
        assert abs(moved.sum()) == pytest.approx(0.8)  # two strokes
        assert found.time is run.time
    standing = replace(whole, inputs=np.repeat(inputs[:1] * (model.motion != "v"), time.size, axis=0))
    assert coming_from(model, standing, way, 0.4) is standing
