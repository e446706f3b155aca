"""What the rig did before a run is not in its log: the beginning is simulated and not compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.fits.refit import Task, refit
from tsm_fmu.diagnosis.runs.beginning import (
    beginning_note,
    compared_after_gaps,
    compared_after_start,
    friction_channels,
)
from tsm_fmu.diagnosis.runs.motion_signals import coordinates_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.specification import per_run_fields, search_space

DT = 0.0087
STROKE = 0.9


def stroked(hold: float, seconds: float = 13.0) -> FitRun:
    """A hold, then sines of the position with full strokes of `STROKE`, for ``TendonDrive``."""
    t = np.arange(int((hold + seconds) / DT)) * DT
    x = 0.5 * STROKE * np.sin(1.31 * np.maximum(t - hold, 0.0))
    return FitRun("a", t, np.column_stack([x, 0.0 * x]), 0.97 * x[:, None])


@pytest.mark.parametrize("hold", [0.0, 1.7])
def test_a_run_is_compared_once_the_drive_has_moved_by_a_tenth_of_its_stroke(hold: float) -> None:
    run = compared_after_start(kernel("TendonDrive"), stroked(hold), ("x_out", "tau_in"))
    moved = np.arcsin(0.2) / 1.31  # the stroke is that of nearly all samples, a little less
    assert hold + 0.85 * moved < run.time[0] <= hold + moved + DT
    assert run.lead_time[0] == 0.0
    assert run.time.size + run.lead_time.size == stroked(hold).time.size
    assert run.targets.shape == (run.time.size, 1)


def test_half_of_a_run_is_compared_whatever_it_does() -> None:
    run = stroked(29.0)
    assert compared_after_start(kernel("TendonDrive"), run, ("tau_in",)).time.size == run.time.size - run.time.size // 2


def test_a_speed_counts_by_its_travel_and_a_model_without_motion_has_no_beginning() -> None:
    t = np.arange(900) * DT
    v = np.where(t > 1.1, 0.37, 0.0)
    run = compared_after_start(kernel("LuGreFriction"), FitRun("a", t, v[:, None], v[:, None]), ("F",))
    span = 0.9 * 0.37 * (t[-1] - 1.1)
    assert run.time[0] == pytest.approx(1.1 + 0.1 * span / 0.37, abs=0.1)
    still = FitRun("b", t, np.zeros((900, 1)), v[:, None])
    assert compared_after_start(kernel("LuGreFriction"), still, ("F",)).lead_time.size == 0
    wound = FitRun("c", t, np.column_stack([t, t]), np.column_stack([t]))
    assert compared_after_start(kernel("LebusWinding"), wound, ("F_w",)) is wound


def test_where_no_friction_is_measured_its_past_does_not_matter() -> None:
    whole = stroked(0.4)
    assert compared_after_start(kernel("TendonDrive"), whole, ("x_out",)) is whole
    assert friction_channels(kernel("TendonDrive")) == {"tau_in"}
    assert friction_channels(kernel("PairedTsmBacklash")) == set()
    assert friction_channels(kernel("SingleTsmDahl")) >= {"F", "T_out", "T_drive"}


def test_what_is_compared_is_the_end_of_the_whole_simulation() -> None:
    model, whole = kernel("TendonDrive"), stroked(0.4)
    cut = compared_after_start(model, whole, ("tau_in",))
    parameters = search_space(model, None, {"x_h_0": 0.031})
    one, two = (Problem(model, [run], ("x_out",), parameters) for run in (whole, cut))
    full, part = one.outputs(0, one.start()[0]), two.outputs(0, two.start()[0])
    assert np.array_equal(part, full[cut.lead_time.size :])
    assert np.array_equal(two.outputs_with_lead(0, two.start()[0])[:, two.columns], full)
    coarse = cut.every(3)
    assert np.array_equal(np.append(coarse.lead_time, coarse.time)[[0, -1]], [0.0, cut.time[::3][-1]])
    there, here = coordinates_of(model, whole, None, 0.017), coordinates_of(model, cut, None, 0.017)
    for name in ("x", "v", "z", "s", "dwell", "time"):
        assert np.array_equal(getattr(here, name), getattr(there, name)[cut.lead_time.size :]), name


@pytest.mark.parametrize(("beginning", "fitted"), [(compared_after_start, False), (lambda _, run, __: run, True)])
def test_a_state_that_is_forgotten_is_not_fitted(beginning: Callable[..., FitRun], fitted: bool) -> None:
    """Friction of 3.1 N, with Dahl's presliding over 0.2 mm from 0.7 of it, held for a second at the start."""
    t = np.arange(1500) * DT
    v = np.where(t < 1.0, 0.0, 0.043 * np.sin(2.3 * (t - 1.0)) + 0.02 * np.sin(0.7 * (t - 1.0)))
    z = np.empty(t.size)
    z[0] = 0.7
    for k in range(1, t.size):
        s, travel = np.sign(v[k]), abs(v[k]) * DT / 0.0002
        z[k] = s + (z[k - 1] - s) * np.exp(-travel)
    tension = np.full(t.size, 11.3)
    columns = {"v": v, "a": np.gradient(v, DT), "T_in": tension + 3.1 * z, "T_load": tension}
    model = kernel("SingleTsmDahl")
    inputs = np.column_stack([columns[i.name] for i in model.inputs])
    run = beginning(model, FitRun("a", t, inputs, 3.1 * z[:, None]), ("F",))
    start = {"rho1": 3.0, "rho2": 3.0, "mu1": 0.0, "mu2": 0.0, "mu3": 0.0, "sigma": 15000.0, "zeta_0": 1e-5}
    kept = [n for n in ("mu1", "mu2", "mu3", *(f"kappa{k}" for k in range(1, 6)))]
    found = refit(Task(model.name, [run], ("F",), start, None, tuple(kept)), (), {})
    assert per_run_fields(model) == ("zeta_0",)
    assert (found.problem.per_run == ("zeta_0",)) is fitted
    expected = 0.7 * 3.1 / found.values["sigma"] if fitted else 1e-5
    assert found.values["zeta_0"] == pytest.approx(expected, rel=0.03)
    assert found.values["rho1"] == pytest.approx(3.1, rel=0.01)


def test_how_late_runs_are_compared_is_said_to_two_digits() -> None:
    t = 0.013 * np.arange(900)
    run = FitRun("a", t, t[:, None], t[:, None])
    begins = [run.compared_from(first) for first in (0, 41, 180)]
    said = "s after its start, once the drive has moved by 10 % of its stroke"
    assert beginning_note(begins[:1]) == ()
    assert beginning_note(begins[1:2])[0].startswith(f"each run is compared from 0.53 {said}")
    assert beginning_note(begins)[0].startswith(f"each run is compared from 0 to 2.3 {said}")
    assert beginning_note(begins[1:])[0].startswith(f"each run is compared from 0.53 to 2.3 {said}")
    assert len(beginning_note(begins)) == 1


@pytest.mark.parametrize("lost", [9, 31])
def test_after_a_gap_a_run_is_compared_once_the_drive_has_moved_as_far(lost: int) -> None:
    """Nine rows are a hiccup of the logger; in 31 the drive may have turned."""
    whole = stroked(0.0)
    kept = np.delete(np.arange(whole.time.size), slice(700, 700 + lost))
    run = FitRun("a", whole.time[kept], whole.inputs[kept], whole.targets[kept])
    found = compared_after_gaps(kernel("TendonDrive"), run)
    if lost == 9:
        assert found is run
        return
    (out,) = found.unresolved.T
    x = run.inputs[:, 0]
    (at,) = np.flatnonzero(np.diff(out.astype(int)) == 1)
    assert at == 699
    after = np.ptp(x[700 : 700 + out.sum()])
    assert 0.08 * STROKE < after < 0.1 * STROKE
    assert out.sum() == np.flatnonzero(out)[-1] - 699
    both = compared_after_gaps(kernel("TendonDrive"), replace(run, doubt=1.7 * (np.arange(x.size) == 3)[:, None]))
    assert both.doubt[3, 0] == 1.7
    assert np.isinf(both.doubt[both.doubt > 1.7]).all()
    assert both.unresolved.sum() == out.sum() + 1


def test_a_log_of_gaps_alone_is_compared_as_it_is() -> None:
    whole = stroked(0.0)
    kept = np.flatnonzero(np.arange(whole.time.size) % 60 < 14)
    run = FitRun("a", whole.time[kept], 1e-3 * whole.inputs[kept], whole.targets[kept])
    run.inputs[3, 0] = STROKE  # a stroke that is never passed again
    run.inputs[9:99, 0] = STROKE * np.linspace(0.0, 1.0, 90)
    assert not compared_after_gaps(kernel("TendonDrive"), run).unresolved.any()
