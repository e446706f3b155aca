"""The way from a plain model to one that predicts: what is planted comes in, noise does not, zeros have their size."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu.diagnosis import workflow
from tsm_fmu.diagnosis.answer.improvement import improvement_of
from tsm_fmu.diagnosis.choice import path
from tsm_fmu.diagnosis.choice.path import Stop, way_to_a_better_model
from tsm_fmu.diagnosis.criteria import PARAMETER_GAIN, SURE_GAIN_RATIO
from tsm_fmu.diagnosis.fits.refit import as_given, refit
from tsm_fmu.diagnosis.improved import ImprovedModel
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.diagnosis.runs.prepared import PreparedRuns, prepared
from tsm_fmu.diagnosis.workflow import task_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.models.contract import InputError

MODEL = kernel("PairedTsmBacklash")
TRUE = {"c": 0.9137, "beta": -0.3871, "alpha": 13.7}
ZEROS = (-1.2731, -1.1837, -1.2419, -1.2077)


def rig_run(name: str, seed: int, zero: float, cubic: float) -> Record:
    """The model with a law of the position that it lacks, white noise and an encoder."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 13.0, 0.01)
    x = 0.41 * np.sin(rng.uniform(1.3, 1.9) * t) + 0.17 * np.sin(rng.uniform(3.8, 5.7) * t + rng.uniform(0, 6))
    y = MODEL.simulate(MODEL.params(None, {**TRUE, "x_0": zero}), t, x[:, None])[:, 0]
    y = y + cubic * x**3 + 6e-4 * rng.standard_normal(t.size)
    return Record(name, t, {"x_in": x, "x_out": np.round(y / 0.0007) * 0.0007}, {"x_in": "rad", "x_out": "rad"})


def runs_of(cubic: float) -> PreparedRuns:
    records = [rig_run(f"run {k}", 41 + k, zero, cubic) for k, zero in enumerate(ZEROS)]
    return prepared(MODEL, records, [], [rig_run("held out", 57, -1.2263, cubic)], None)


@cache
def way_of(cubic: float) -> tuple[list[Stop], ImprovedModel]:
    runs = runs_of(cubic)
    way = way_to_a_better_model(runs, task_of(runs, {}, None, ()))
    return way, improvement_of(way, runs, (), (), "", 0)


def test_law_that_is_lacking_comes_in_and_zeros_have_their_size() -> None:
    way, improved = way_of(0.31)
    assert "stiffness_hardening@x_out" in improved.effects
    errors = [stop.left_out_rms[0] for stop in way]
    assert all(np.diff(errors) < 0.0)
    assert improved.steps[-1].holdout["x_out"] < 1.5e-3 < 4e-3 < improved.steps[0].holdout["x_out"]
    (zeros,) = improved.zeros
    assert zeros.scatter == pytest.approx(np.std(ZEROS, ddof=1), rel=0.1)
    assert zeros.holdout_own is not None
    assert zeros.holdout_common is not None
    off = -1.2263 - np.mean(ZEROS)
    assert zeros.holdout_common == pytest.approx(np.hypot(off, zeros.holdout_own), rel=0.2)
    assert "useful, not named" in improved.text.lower()


def test_way_goes_on_from_an_answer_that_leaves_less_and_drops_what_is_idle_in_it() -> None:
    runs = runs_of(0.31)
    task = task_of(runs, {}, None, ())
    plain = as_given(task, ())
    answer = refit(task, ("stiffness_hardening@x_out", "sensor_lag@x_out"), plain.values)
    way = way_to_a_better_model(runs, task, answer=answer)
    assert way[1].added == "stiffness_hardening@x_out and sensor_lag@x_out"
    assert way[-1].fitted.effects == way_of(0.31)[0][-1].fitted.effects
    assert way[-1].left_out_rms == pytest.approx(way_of(0.31)[0][-1].left_out_rms, rel=0.02)


def test_every_effect_that_is_taken_out_again_is_a_step_of_its_own() -> None:
    runs = runs_of(0.31)
    task = task_of(runs, {}, None, ())
    begun = ("stiffness_hardening@x_out", "sensor_lag@x_out", "delay@x_out")
    way = way_to_a_better_model(runs, task, answer=refit(task, begun, as_given(task, ()).values))
    steps = [name for stop in way for name in stop.added.split(" and ") if name]
    out = {name.removeprefix("without ") for name in steps if name.startswith("without ")}
    assert out == {"sensor_lag@x_out", "delay@x_out"}  # the rig has neither
    assert {name for name in steps if not name.startswith("without ")} - out == set(way[-1].fitted.effects)


def test_answer_that_leaves_no_less_is_not_begun_from() -> None:
    runs = runs_of(0.0)
    task = task_of(runs, {}, None, ())
    idle = refit(task, ("sensor_lag@x_out",), as_given(task, ()).values)
    assert [stop.added for stop in way_to_a_better_model(runs, task, answer=idle)] == [""]


def test_a_step_that_holds_on_the_samples_of_the_search_alone_is_none() -> None:
    """The effect that fits the samples of the search is not in the others: here the law ends where these begin."""
    runs = runs_of(0.31)
    whole = [replace(run, targets=run.targets - 0.31 * run.inputs[:, :1] ** 3) for run in runs.measured]
    way = way_to_a_better_model(replace(runs, measured=whole), task_of(runs, {}, None, ()))
    assert all(np.diff([stop.log_whole for stop in way]) < 0.0)
    assert "stiffness_hardening@x_out" not in way[-1].fitted.effects


def test_parameters_that_a_poor_model_made_idle_begin_anew() -> None:
    runs = runs_of(0.31)
    task = replace(task_of(runs, {}, None, ()), plausible=False)  # as on the way
    law, far = ("stiffness_hardening@x_out",), {**TRUE, "alpha": 1e9, "beta": -1e-40}
    lost = refit(task, law, far)
    assert "alpha" not in lost.problem.shared
    found = path._reweighted(lost, 60)
    assert found.values["alpha"] == pytest.approx(TRUE["alpha"], rel=0.01)
    assert found.rmse[0] < 1e-3 < 0.1 * lost.rmse[0]
    fixed = refit(replace(task, fixed=("alpha",)), law, far)
    assert path._reweighted(fixed, 15).values["alpha"] == 1e9


def test_way_of_a_model_that_lacks_nothing_ends_where_it_begins() -> None:
    way, improved = way_of(0.0)
    assert [stop.added for stop in way] == [""]
    assert improved.effects == ()
    assert "no effect makes runs that are left out" in improved.text


def test_one_run_is_refused_in_one_line() -> None:
    one = rig_run("only", 3, -1.2, 0.0)
    with pytest.raises(InputError, match=r"^--improve with 1 measured run -- .* -- give more with --measured$"):
        tsm.diagnose("PairedTsmBacklash", one, improve=True)


def test_interruption_on_the_way_keeps_the_diagnosis(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(workflow, "way_to_a_better_model", interrupted)
    runs = prepared(MODEL, [rig_run("a", 1, -1.2, 0.0), rig_run("b", 2, -1.2, 0.0)], [], [], None)
    task = task_of(runs, {}, None, ())
    met: Any = SimpleNamespace(runs=runs, task=task, verdict=SimpleNamespace(final=as_given(task, ())))
    found = workflow._improved(Diagnosis("unknown", answer="as before"), met, (), lambda _: None)
    assert found.answer == "as before"
    assert found.improved is None
    assert not found.complete
    assert any("interrupted" in note for note in found.notes)


def test_gain_of_a_step_counts_runs_that_were_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = {"": 3, "x": 4, "y": 40}
    monkeypatch.setattr(Stop, "parameters", property(lambda stop: counts[stop.added]))
    before = stop_that_left("", [(1.0, 4.0), (2.0, 4.0), (3.0, 4.0)])
    after = stop_that_left("x", [(0.5, 1.0), (1.0, 1.0), (1.5, 1.0)])
    gain, error = after.gain_over(before)
    assert gain == pytest.approx(np.log(2.0) + np.log(4.0))
    assert error == pytest.approx(0.0, abs=1e-12)
    assert after.is_worth_more_than(before)
    many = stop_that_left("y", [(0.9, 4.0), (1.8, 4.0), (2.7, 4.0)])
    assert not many.is_worth_more_than(before), "many parameters must gain more"
    one_run = stop_that_left("x", [(1.3, 4.0), (2.3, 4.0), (1.3, 4.0)])
    assert not one_run.is_worth_more_than(before), "a gain of one run alone is chance"
    gain, error = one_run.gain_over(before)
    assert error > gain > 0.0
    assert one_run.worth_over(before) == pytest.approx(gain - SURE_GAIN_RATIO * error - PARAMETER_GAIN)
    best = max((many, one_run, after), key=lambda s: s.worth_over(before))
    assert best is after


def stop_that_left(added: str, squares: list[tuple[float, float]]) -> Stop:
    return Stop(added, None, tuple(map(np.array, squares)), np.ones(2))  # pyright: ignore[reportArgumentType]
