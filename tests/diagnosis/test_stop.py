"""Places of the way to a better model: what few samples leave open is not carried to many."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice import path
from tsm_fmu.diagnosis.choice.stop import UNSEEN_CHANGE, Samples, with_usual_values
from tsm_fmu.diagnosis.fits.refit import Fitted, refit
from tsm_fmu.diagnosis.runs.prepared import PreparedRuns, prepared
from tsm_fmu.diagnosis.workflow import task_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

MODEL = kernel("TendonDrive")
TRUE = {"sigma0": 431.7, "tau_c": 0.0413, "tau_s": 0.0413, "sigma2": 0.0, "ratio": 1.07}


def drive_run(name: str, seed: int, count: int = 13000) -> Record:
    """Friction of a constant size against the motion, which turns within a travel that few samples jump over."""
    rng = np.random.default_rng(seed)
    t = np.arange(count, dtype=np.float64) * 1e-3
    x = 0.53 * np.sin(rng.uniform(2.1, 3.3) * t) + 0.21 * np.sin(rng.uniform(5.3, 6.7) * t)
    load = -0.081 + 0.013 * np.sin(1.7 * t)
    torque = 1.07 * load + 0.0413 * np.sign(np.gradient(x)) + 7e-4 * rng.standard_normal(count)
    units = {"x_in": "rad", "tau_out": "N.m", "tau_in": "N.m"}
    return Record(name, t, {"x_in": x, "tau_out": load, "tau_in": torque}, units)


def seen_in_steps(record: Record, step: float) -> Record:
    """The same with an encoder [rad]."""
    return replace(record, columns={**record.columns, "x_in": step * np.round(record.columns["x_in"] / step)})


def runs_of(*records: Record) -> PreparedRuns:
    return prepared(MODEL, records, [], [], None)


def fitted_with(damping: float, given: dict[str, float]) -> tuple[Fitted, PreparedRuns]:
    """A refit on few samples from a damping of the bristles that does nothing there."""
    runs = runs_of(drive_run("a", 3), drive_run("b", 5))
    task = replace(task_of(runs, given, None, ()), plausible=False)
    start = {**TRUE, "sigma0": 2.3e4, "sigma1": damping}
    return refit(task, (), start, fixed=("sigma0", "sigma1")), runs


@pytest.mark.parametrize("given", [{}, {"sigma1": 0.0127}])
def test_a_parameter_that_changes_nothing_has_the_value_given_or_the_usual_one(given: dict[str, float]) -> None:
    wild, _ = fitted_with(5.7e3, given)
    assert wild.values["sigma1"] == 5.7e3
    tame = with_usual_values(wild)
    assert tame.values["sigma1"] == {"sigma1": 0.021025, **given}["sigma1"]
    assert tame.cost < (1.0 + UNSEEN_CHANGE) * wild.cost
    seen = {name: tame.values[name] for name in ("tau_c", "ratio")}
    assert seen == {name: wild.values[name] for name in seen}


def test_what_few_samples_jump_over_is_not_all_that_is_seen_on_many() -> None:
    """A damping of the bristles out of all bounds acts within a reversal alone: few samples see nothing of it."""
    wild, runs = fitted_with(5.7e3, {})
    samples = Samples.of(MODEL, wild.task, runs.measured)
    few, more, whole = (sum(r.time.size for r in one) for one in (samples.few, samples.more, samples.whole))
    assert few < more <= whole
    friction = TRUE["tau_c"]
    assert wild.rmse[0] < 0.1 * friction < friction < wild.at(samples.whole).rmse[0]
    assert with_usual_values(wild).at(samples.whole).rmse[0] < 0.2 * friction
    assert samples.refined(wild).at(samples.whole).rmse[0] < 0.2 * friction


def test_a_value_that_no_model_may_have_with_the_others_is_not_set() -> None:
    """The usual beta is below -c of a rig with a small gain: it stays, though nothing measured depends on it."""
    runs = runs_of(drive_run("a", 7))
    task = task_of(runs, {}, None, ())
    fitted = refit(task, (), {**TRUE, "c": 0.87, "beta": -0.31})
    assert "beta" not in fitted.problem.shared, "x_out is not measured"
    fixed = replace(fitted, task=replace(task, values={**task.values, "c": 0.87}))
    assert with_usual_values(fixed).values["beta"] == -0.31


def test_runs_that_are_held_out_set_no_bound_of_a_fit() -> None:
    seen, loud = drive_run("seen", 11), drive_run("loud", 13)
    loud = replace(loud, columns={**loud.columns, "tau_in": 7.3 * loud.columns["tau_in"]})
    alone, beside = (task_of(prepared(MODEL, [seen], [], out, None), {}, None, ()) for out in ([], [loud]))
    assert alone.limits == beside.limits


def test_a_choice_of_the_model_is_judged_once_however_far_a_few_steps_bring_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """An encoder that tells of a reversal late: what holds the load until then leaves less of it."""
    model = kernel("DistalEstimator")
    records = [seen_in_steps(drive_run(name, seed), 0.037) for name, seed in (("a", 17), ("b", 19), ("c", 23))]
    runs = prepared(model, records, [], [], None)
    task = replace(task_of(runs, {}, None, ()), plausible=False)
    samples = Samples.of(model, task, runs.measured)
    monkeypatch.setattr(path, "screen", lambda *_: [])
    first = path._first(task, (), samples)
    found = path._next(model, [first], samples)
    assert found is not None
    assert found.added == "hold = 1"
    assert found.is_worth_more_than(first)
    assert path._next(model, [first, found], samples) is None, "back is no step on"
