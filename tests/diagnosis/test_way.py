"""Parts of the way to a model that predicts: folds, choices, weights, idle effects; and small parts of an answer."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.test_choice import made
from tsm_fmu.diagnosis.answer import shape
from tsm_fmu.diagnosis.answer.candidates import _nuisance_score, _range
from tsm_fmu.diagnosis.choice import baselines, path
from tsm_fmu.diagnosis.choice import stop as place
from tsm_fmu.diagnosis.choice.stop import Samples, Stop, judged, log_left
from tsm_fmu.diagnosis.criteria import PARAMETER_GAIN
from tsm_fmu.diagnosis.evidence import Dependence, ResidualShape
from tsm_fmu.models.contract import InputError


@dataclass(frozen=True)
class Task:
    runs: list[Any] = field(default_factory=list)
    channels: tuple[str, ...] = ("F",)
    weights: Any = None
    fixed: tuple[str, ...] = ()
    model: str = "LuGreFriction"
    values: dict[str, float] = field(default_factory=dict)
    limits: dict[str, Any] = field(default_factory=dict)
    plausible: bool = True

    def limited(self, limits: dict[str, Any]) -> Task:
        return replace(self, limits=limits)


@dataclass(frozen=True)
class Fit:
    task: Any = Task()
    effects: tuple[str, ...] = ()
    left: float = 0.0
    rmse: Any = field(default_factory=lambda: np.array([0.3]))
    spread: Any = field(default_factory=lambda: np.array([1.7]))
    values: dict[str, float] = field(default_factory=dict)
    per_run: dict[str, Any] = field(default_factory=dict)
    model: str = "LuGreFriction"

    @property
    def problem(self) -> Any:
        return SimpleNamespace(runs=self.task.runs, shared=tuple(range(5 + len(self.effects))))

    def at(self, runs: Any) -> Any:
        return SimpleNamespace(rmse=np.array([np.exp(self.left) * len(runs)]))


@pytest.mark.parametrize("count", [2, 5])
def test_each_run_is_judged_by_a_fit_to_runs_of_the_other_parts(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [SimpleNamespace(number=k) for k in range(count)]
    asked = []

    def refit(task: Task, effects: Any, values: Any, *, per_run_values: Any, steps: int) -> Any:
        kept = [r.number for r in task.runs]
        asked.append((kept, per_run_values["zero"].tolist(), effects, values))
        return SimpleNamespace(held_out_errors=lambda out: [np.full((3, 1), 10.0 * len(kept) + r.number) for r in out])

    monkeypatch.setattr(place, "refit", refit)
    fit: Any = Fit(Task(runs), ("wear",), values={"F_c": 0.7}, per_run={"zero": 0.1 * np.arange(count)})
    stop = judged("wear", fit, Samples((), (), [*runs, *runs]))  # pyright: ignore[reportArgumentType]
    parts = min(3, count)
    assert len(asked) == parts
    for part, (kept, zeros, effects, values) in enumerate(asked):
        assert kept == [k for k in range(count) if k % parts != part]
        assert zeros == pytest.approx([0.1 * k for k in kept])
        assert (effects, values) == (("wear",), {"F_c": 0.7})
    sizes = [count - len(range(k % parts, count, parts)) for k in range(count)]
    assert [float(x[0]) for x in stop.left_out] == [(10.0 * n + k) ** 2 for k, n in enumerate(sizes)]
    assert (stop.added, stop.fitted) == ("wear", fit)
    assert stop.whole.tolist() == [2.0 * count]  # of all samples


def test_choices_are_values_of_switches_that_are_not_held_and_were_not_had() -> None:
    def choices(*fits: Fit) -> list[tuple[str, int]]:
        return path._choices([Stop("", fit, (), np.ones(1)) for fit in fits])  # pyright: ignore[reportArgumentType]

    fit = Fit(model="DistalEstimator", values={"hold": 0.0})
    assert choices(fit) == [("hold", 1)]
    assert choices(replace(fit, values={"hold": 1.0})) == [("hold", 0)]
    assert choices(fit, replace(fit, values={"hold": 1.0})) == []
    assert choices(replace(fit, task=Task(fixed=("hold",)))) == []
    three = Fit(model="ReferenceSignal", values={"kind": 2.0})
    assert choices(three) == [("kind", 1), ("kind", 3)]
    assert choices(three, replace(three, values={"kind": 3.0})) == [("kind", 1)]
    assert choices(Fit()) == []


def test_weights_are_the_inverse_of_what_is_left_of_each_channel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path, "refit", lambda task, *_, steps, **__: Fit(task, left=steps))
    monkeypatch.setattr(path, "_begun_anew", lambda *_: ())
    fit: Any = Fit(rmse=np.array([0.2, 0.0]), spread=np.array([1.7, 5.0]))
    found: Any = path._reweighted(fit, 17)
    weights, steps = found.task.weights, found.left
    assert weights == pytest.approx([5.0, 2e5])  # a millionth of the spread is as good as nothing
    assert steps == 17


@pytest.mark.parametrize("channels", [("F",), ("tau_in", "x_out")])
def test_a_refit_of_several_channels_weighs_them_by_what_a_first_one_leaves(
    channels: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def refit(task: Task, effects: Any, values: Any, *, per_run_values: Any = None) -> Fit:
        asked.append((task.weights, values, per_run_values))
        left = np.array([0.4, 0.0][: len(channels)])
        return Fit(task, values={"k": 3.0}, rmse=left, spread=np.array([1.0, 2.0][: len(channels)]), per_run={"z": 1})

    monkeypatch.setattr(baselines, "refit", refit)
    task: Any = Task(channels=channels, values={"F_c": 0.7})
    found: Any = baselines.refitted_model(task, ())
    assert asked[0] == (None, {}, None)
    assert len(asked) == len(channels)
    if len(channels) == 2:
        assert asked[1][0] == pytest.approx([2.5, 5e5])
        assert asked[1][1:] == ({"k": 3.0}, {"z": 1})
        assert found.task.weights is asked[1][0]


def stop(added: str, effects: tuple[str, ...], left_out: float, left: float = 0.0) -> Stop:
    fit: Any = Fit(effects=effects, left=left)
    noise = (0.99, 1.0, 1.01, 1.0)
    return Stop(added, fit, tuple(np.array([left_out * n]) for n in noise), np.array([np.exp(left)]))


@pytest.mark.parametrize(("alone", "dropped"), [(0.501, True), (0.7, False), (np.nan, False), (np.inf, False)])
def test_at_the_end_an_effect_that_later_ones_made_idle_is_left_out(
    alone: float, dropped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    way = [stop("", (), 1.0), stop("wear", ("wear",), 0.8), stop("inertia", ("wear", "inertia"), 0.5, left=2.0)]
    asked = []

    def refit(_: Any, effects: Any, *__: Any, **___: Any) -> Any:
        asked.append(tuple(effects))
        return Fit(effects=tuple(effects), left=3.0)

    monkeypatch.setattr(path, "refit", refit)
    monkeypatch.setattr(path, "judged", lambda name, fit, _: replace(stop(name, fit.effects, alone, 3.0), fitted=fit))
    monkeypatch.setattr(path, "_reweighted", lambda fit, _: replace(fit, left=fit.left - 1.0, model="again"))
    same: Any = SimpleNamespace(searched=lambda fit: fit, refined=lambda fit: fit, whole=[0])
    found = path._without_idle(way, same, lambda _: None)
    assert asked == [("inertia",)]  # the last one is not idle, and the first model had none
    assert [s.added for s in found] == ["", "wear", "inertia", *(["without wear"] if dropped else [])]
    assert found[-1].fitted.effects == (("inertia",) if dropped else ("wear", "inertia"))
    assert found[-1].fitted.model == "again"  # refitted once more, which left less
    assert path._without_idle(way[:1], same, lambda _: None) == way[:1]


def way_with(rival: Stop) -> list[Stop]:
    """A way whose first step was close, and whose second one left half."""
    first = replace(stop("wear", ("wear",), 0.8), next_best=rival)
    return [stop("", (), 1.0), first, stop("inertia", ("wear", "inertia"), 0.5)]


@pytest.mark.parametrize(("alone", "taken"), [(0.45, True), (0.5, False), (np.nan, False)])
def test_what_was_second_best_takes_the_place_of_what_was_best_where_it_is_worth_more(
    alone: float, taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = []

    def refit(task: Any, effects: Any, values: Any, **_: Any) -> Any:
        begun.append((tuple(effects), values, task.limits))
        return Fit(effects=tuple(effects))

    monkeypatch.setattr(path, "refit", refit)
    monkeypatch.setattr(path, "_reweighted", lambda fit, _: fit)
    monkeypatch.setattr(path, "judged", lambda name, fit, _: stop(name, fit.effects, alone))
    same: Any = SimpleNamespace(searched=lambda fit: fit, refined=lambda fit: fit)
    values, task = {"thermal.d": 0.3, "F_c": 9.0}, Task(limits={"thermal.d": (0, 1), "F_c": (0, 9)})
    rival: Any = replace(stop("thermal", ("thermal",), 0.85), fitted=Fit(task, ("thermal",), values=values))
    way = way_with(rival)
    last: Any = replace(way[-1].fitted, values={"F_c": 0.7}, task=Task(limits={"F_c": (0, 1)}))  # pyright: ignore
    found = path._exchanged([*way[:-1], replace(way[-1], fitted=last)], same)
    limits = {"thermal.d": (0, 1), "F_c": (0, 1)}
    assert begun == [(("inertia", "thermal"), {"thermal.d": 0.3, "F_c": 0.7}, limits)]
    assert (found is not None) == taken
    if found:
        assert (found.added, found.fitted.effects) == ("thermal and without wear", ("inertia", "thermal"))


@pytest.mark.parametrize(("alone", "taken"), [(0.495, True), (0.505, False)])
def test_a_choice_in_place_of_an_effect_is_taken_where_it_is_worth_as_much_with_fewer_parameters(
    alone: float, taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refit(_: Any, effects: Any, values: Any, **__: Any) -> Any:
        assert values["hold"] == 1.0
        return Fit(effects=tuple(effects), values=values)

    monkeypatch.setattr(path, "refit", refit)
    monkeypatch.setattr(path, "_reweighted", lambda fit, _: fit)
    monkeypatch.setattr(path, "judged", lambda name, fit, _: stop(name, fit.effects, alone))
    same: Any = SimpleNamespace(searched=lambda fit: fit, refined=lambda fit: fit)
    held: Any = Fit(values={"hold": 1.0})
    way = way_with(replace(stop("hold = 1", (), 0.85), fitted=held))
    found = path._exchanged(way, same)
    assert (found.added if found else "") == ("hold = 1 and without wear" if taken else "")
    chosen: Any = Fit(effects=("wear", "inertia"), values={"hold": 1.0})
    assert path._exchanged([*way[:-1], replace(way[-1], fitted=chosen)], same) is None, "it has been chosen since"


def steps_of(gains: dict[str, tuple[str, float, str, float]]) -> Any:
    """`path._next` from a table: after which stop comes which, leaving what, and which is second best, leaving what."""

    def following(_: Any, way: Any, __: Any) -> Any:
        at = way[-1]
        if at.added not in gains:
            return None
        best, left, second, more = gains[at.added]
        effects = at.fitted.effects
        rival = stop(second, (*effects, second), more) if second else None
        return replace(stop(best, (*effects, best), left), next_best=rival)

    return following


@pytest.mark.parametrize(
    ("gains", "expected"),
    [
        ({"": ("wear", 0.5, "creep", 0.6), "creep": ("inertia", 0.3, "", 0.0)}, ["", "creep", "inertia"]),
        ({"": ("wear", 0.5, "creep", 0.6), "creep": ("inertia", 0.55, "", 0.0)}, ["", "wear"]),
        (
            {"": ("wear", 0.7, "creep", 0.8), "wear": ("inertia", 0.5, "", 0.0), "creep": ("thermal", 0.3, "", 0.0)},
            ["", "creep", "thermal"],
        ),
        ({"": ("wear", 0.5, "creep", 1.0), "creep": ("inertia", 0.3, "", 0.0)}, ["", "wear"]),
        (  # it wins, and its own last step but one has the first way's turn as second best: that has been gone
            {"": ("wear", 0.5, "creep", 0.6), "creep": ("inertia", 0.3, "", 0.0), "wear": ("inertia", 0.49, "", 0.0)},
            ["", "creep", "inertia"],
        ),
        ({}, [""]),
    ],
    ids=["leads on", "ends before", "at the step before the last", "no gain by itself", "gone before", "no step"],
)
def test_where_no_step_is_worth_more_the_second_best_of_the_last_ones_has_its_turn(
    gains: Any, expected: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, following = [], steps_of(gains)

    def asking(model: Any, way: Any, samples: Any) -> Any:
        asked.append(tuple(s.added for s in way))
        return following(model, way, samples)

    monkeypatch.setattr(path, "_next", asking)
    monkeypatch.setattr(path, "_exchanged", lambda *_: None)
    monkeypatch.setattr(path, "_first", lambda *_: stop("", (), 1.0))
    monkeypatch.setattr(path, "_without_idle", lambda way, *_: way)
    monkeypatch.setattr(path.Samples, "of", lambda *_: None)
    runs: Any = SimpleNamespace(model=None, measured=(), effects=())
    found = path.way_to_a_better_model(runs, Task())  # pyright: ignore[reportArgumentType]
    assert [s.added for s in found] == expected
    assert len(asked) == len(set(asked)), "no way is gone twice"


def test_values_that_a_model_may_not_have_together_are_no_exchange(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: Any, **__: Any) -> Any:
        raise InputError("beta = -0.9 with c = 0.8")

    monkeypatch.setattr(path, "refit", refused)
    same: Any = SimpleNamespace(searched=lambda fit: fit)
    assert path._exchanged(way_with(stop("thermal", ("thermal",), 0.85)), same) is None


def test_a_step_must_be_worth_its_parameters_and_more_than_its_error() -> None:
    before, one = stop("", (), 1.0), PARAMETER_GAIN
    assert stop("wear", ("wear",), np.exp(-1.01 * one)).is_worth_more_than(before)
    assert not stop("wear", ("wear",), np.exp(-0.99 * one)).is_worth_more_than(before)
    assert not stop("wear", ("wear", "inertia"), np.exp(-1.99 * one)).is_worth_more_than(before)
    assert stop("wear", ("wear", "inertia"), np.exp(-2.01 * one)).is_worth_more_than(before)
    assert not stop("", (), np.exp(-0.9 * one)).is_worth_more_than(before)  # as many parameters: still one step's worth


@pytest.mark.parametrize(("left", "as_good"), [(0.9, True), (np.exp(0.99 * PARAMETER_GAIN), True),
                                               (np.exp(1.01 * PARAMETER_GAIN), False), (np.nan, False)])  # fmt: skip
def test_what_is_simpler_may_leave_more_by_what_its_parameters_must_gain(left: float, as_good: bool) -> None:
    more = stop("wear", ("wear",), 1.0)
    assert stop("", (), left).is_simpler_and_as_good_as(more, PARAMETER_GAIN) is as_good
    assert stop("", (), left).is_simpler_and_as_good_as(more) == (left < 1.0)
    assert not stop("creep", ("creep",), left).is_simpler_and_as_good_as(more, PARAMETER_GAIN), "no simpler"


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("where", ["left_out", "whole"])
def test_a_model_that_stops_is_worth_less_than_any_that_runs(where: str, bad: float) -> None:
    runs = stop("", (), 3.7)
    short = np.array([bad])
    stops = replace(runs, left_out=(*runs.left_out[:-1], short)) if where == "left_out" else replace(runs, whole=short)
    assert runs.is_worth_more_than(stops)
    assert not stops.is_worth_more_than(runs)
    assert not stops.is_worth_more_than(stops)


def test_what_stops_leaves_more_than_anything() -> None:
    assert log_left(Fit(rmse=np.array([np.nan]))) == np.inf  # pyright: ignore[reportArgumentType]


def test_the_law_over_the_position_is_drawn_of_its_channel_where_it_is_not_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    x, v = (Dependence(name, "rad", "", *(np.zeros(2),) * 4) for name in ("x", "v"))
    given = []
    monkeypatch.setattr(shape, "coordinate_units", lambda _: ("rad", "N.m"))
    monkeypatch.setattr(shape, "places_of", lambda _: "places")
    monkeypatch.setattr(shape, "dependence", lambda parts, *rest: [given.append((parts, *rest)) or x])
    problem = SimpleNamespace(kernel=None, channels=("tau_in", "x_out"))
    residuals = [np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[5.0, 6.0]])]
    fit: Any = SimpleNamespace(problem=problem, residuals=residuals)
    found = (ResidualShape("tau_in", "N.m", (v,)), ResidualShape("x_out", "rad", (v,)))
    torque, angle = shape.with_position_law(found, fit, "x_out", 11)
    assert torque is found[0]
    assert angle.dependences == (x, v)
    ((parts, *rest),) = given
    assert [p.tolist() for p in parts] == [[2.0, 4.0], [6.0]]
    assert rest == ["places", "x", "rad", "N.m", 11]
    known = (ResidualShape("x_out", "rad", (v, x)),)
    assert shape.with_position_law(known, fit, "x_out", 11) == known


def test_a_closure_is_a_range_where_both_floors_are_below_the_gap() -> None:
    assert _range(4.0, 1.0, 0.5, 1.0) == pytest.approx((3.0 / 3.75, 1.0))
    assert _range(4.0, 1.0, 0.5, 2.5) is None  # below the full floor there is no gap to close
    assert _range(4.0, 1.0, 2.5, 0.5) is None


def test_the_score_of_a_nuisance_effect_counts_what_is_left_without_it_alone() -> None:
    one = made("", 0.02, 0.9, nuisance_specs={"sensor_lag@F": 0.1})
    without: Any = SimpleNamespace(rmse=np.array([0.11 * 3.7]))
    one = replace(one, nuisance_tests=lambda: {"sensor_lag@F": (0.1, without)})
    expected = 10.0 * np.log10((0.11**2 + 0.003**2) / (0.02**2 + 0.003**2))
    assert _nuisance_score("sensor_lag@F", one) == pytest.approx(expected)
