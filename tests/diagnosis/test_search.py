"""The way of the search through sets of effects, whose fits are numbers of a table here; and which places it tries."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice import search as module
from tsm_fmu.diagnosis.choice.hypotheses import Hypothesis
from tsm_fmu.diagnosis.choice.search import Search, _promises, candidate_places
from tsm_fmu.diagnosis.choice.supported import leading, log_residual
from tsm_fmu.diagnosis.fits.placing import least_stroke, possible
from tsm_fmu.diagnosis.fits.refit import Task
from tsm_fmu.effects import EFFECTS, about
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import kernel

SETS = {
    "": 0.9, "wear": 0.5, "creep": 0.6, "delay": 0.7, "thermal": 0.8, "wear creep": 0.4, "wear delay": 0.45,
    "wear thermal": 0.49, "creep delay": 0.1, "creep thermal": 0.3,
}  # fmt: skip
"""What is left with each set; with any other, what the best of its subsets leaves less a hundredth."""


def left(added: tuple[str, ...]) -> float:
    known = {frozenset(name.split()): rmse for name, rmse in SETS.items()}
    return known.get(frozenset(added)) or min(r for s, r in known.items() if s <= set(added)) - 0.01


def made(added: tuple[str, ...], parameters: int = 5) -> Hypothesis:
    rmse = left(added)
    fitted: Any = SimpleNamespace(
        spread=np.ones(1), rmse=np.array([rmse]), cost=rmse**2, effects=added, has=lambda _: False,
        problem=SimpleNamespace(shared=tuple(range(parameters)), per_run=(), declared={}, runs=[]),
        share_of=lambda _: np.full(1, 0.1),
        task=Task("", (), (), {}),
    )  # fmt: skip
    one = Hypothesis(added, fitted, (), np.array([rmse**2]), None, np.full(1, 1e5), np.ones(1), (), lambda: {})
    one.__dict__["disguised"] = False
    return one


def _candidate(spec: str) -> Any:
    return SimpleNamespace(attached=SimpleNamespace(spec=spec))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[tuple[str, ...]]]:
    """The search with fits of the table: what was built upon, and in which sets it looked for an end."""
    seen: dict[str, list[tuple[str, ...]]] = {"upon": [], "reference": [], "enough": []}

    def refitted(base: Hypothesis, screened: Any, holdout: Any, reference: Any = None, *_: Any, **__: Any) -> list:
        seen["upon"].append(base.added)
        seen["reference"] += [base.added] if reference is not None else []
        return [made((*base.added, s.attached.spec)) for s in screened if s.attached.spec not in base.added]

    def screened(self: Search, base: Hypothesis) -> tuple[list, dict]:
        specs = [name for name in SETS if name and " " not in name and name not in base.added]
        return [_candidate(name) for name in specs], {}

    monkeypatch.setattr(module, "refit_candidates", refitted)
    monkeypatch.setattr(module, "refit_rivals", lambda found, _: list(found))
    monkeypatch.setattr(module, "with_fewer", lambda best, found, *_: list(found))
    monkeypatch.setattr(Search, "_screened", screened)
    monkeypatch.setattr(Search, "_screened_alone", lambda self, base, spec: [_candidate(spec)])
    monkeypatch.setattr(Search, "_enough", lambda self, found, base: bool(seen["enough"].append(base.added)))
    return seen


def searched(reference: Any = None) -> list[Hypothesis]:
    start: Any = made(())
    baselines: Any = SimpleNamespace(with_nuisances=start, refitted=start, reference=reference, joint=None)
    return Search(kernel("LuGreFriction"), baselines, (), lambda _: None).hypotheses()


def test_the_best_pair_need_not_hold_the_best_single_effect(asked: dict[str, list]) -> None:
    found = searched("the same on reference runs")
    sets = [frozenset(h.added) for h in found]
    assert frozenset({"creep", "delay"}) in sets
    assert min(found, key=log_residual).added[:2] in {("delay", "creep"), ("creep", "delay")}
    assert asked["upon"][:3] == [(), ("wear",), ("creep",)]  # the best pair, wear and creep, from its other side too
    # creep is there; delay and creep leave less than wear and creep, and are begun from their other side as well
    assert asked["upon"][3:-1] == [("delay",), ("creep",), ("thermal",)]
    assert set(asked["upon"][-1]) == {"creep", "delay"}
    assert asked["reference"] == [()]  # beside others the form is known
    assert asked["enough"][0] == ("wear",)
    assert found[0].added == ()
    assert {len(s) for s in sets} == {0, 1, 2, 3}


def test_what_hides_behind_a_nuisance_effect_that_would_be_named_takes_its_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At its channel, from the fit without it, and without it among the nuisance effects."""
    nuisances = ("presliding_shape", "sensor_lag@F", "offset_drift@F")
    without, asked = made(()).fitted, []
    start = replace(made(()), nuisances=nuisances, nuisance_tests=lambda: {"sensor_lag@F": (0.4, without)})

    def screened(fitted: Any, places: Any, *_: Any) -> list:
        return [SimpleNamespace(attached=one, starts=[{}]) for one in places]

    def refitted(base: Hypothesis, candidates: Any, *_: Any, **given: Any) -> list[Hypothesis]:
        specs = [s.attached.spec for s in candidates]
        asked.append((base.added, base.nuisances, base.fitted, specs, set(given["starts"])))
        return [made((spec,)) for spec in specs]

    for name, stub in (("screen", screened), ("refit_candidates", refitted), ("choice_of", lambda *_: one)):
        monkeypatch.setattr(module, name, stub)
    monkeypatch.setattr(module, "candidate_places", lambda *_: possible("LuGreFriction", ("F",), ()))
    baselines: Any = SimpleNamespace(with_nuisances=start, refitted=start, reference=None, joint=None)
    search = Search(kernel("LuGreFriction"), baselines, (), lambda _: None)
    one = SimpleNamespace(supported=(start,))
    assert [h.added for h in search._in_place_of_nuisances([start])] == [("delay@F",)]
    assert asked == [((), ("presliding_shape", "offset_drift@F"), without, ["delay@F"], {"delay@F"})]
    one = SimpleNamespace(supported=(replace(start, nuisance_tests=lambda: {}),))
    assert search._in_place_of_nuisances([start]) == []
    # named beside it all the same: with both a refit ends between them
    one = SimpleNamespace(supported=(replace(made(("delay@F",)), nuisance_tests=lambda: {}),))
    assert [h.added for h in search._in_place_of_nuisances([start])] == [("delay@F",)]
    assert asked[1] == asked[0]
    one = SimpleNamespace(supported=(replace(made(("inertia",)), nuisance_tests=lambda: {}),))
    assert search._in_place_of_nuisances([start]) == []


@pytest.mark.parametrize(("left", "goes_on"), [(0.3, True), (0.5, False)])
def test_where_that_leaves_less_the_search_goes_on_from_there(
    asked: dict[str, list], monkeypatch: pytest.MonkeyPatch, left: float, goes_on: bool
) -> None:
    monkeypatch.setitem(SETS, "friction_lag", left)  # tried in the place of a nuisance effect alone
    monkeypatch.setattr(Search, "_enough", lambda self, found, base: True)
    monkeypatch.setattr(Search, "_in_place_of_nuisances", lambda self, found: [made(("friction_lag",))])
    monkeypatch.setattr(Search, "_screened", lambda self, base: ([_candidate("wear"), _candidate("creep")], {}))
    sets = [h.added for h in searched("the same on reference runs")]
    further = [("friction_lag", "wear"), ("friction_lag", "creep")] if goes_on else []
    assert sets == [(), ("wear",), ("creep",), ("friction_lag",), *further]
    assert asked["reference"] == [()]


def test_the_search_ends_where_one_more_helps_no_more(asked: dict[str, list], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SETS, "", 0.4)  # no effect leaves less
    found = searched()
    assert [h.added for h in found] == [(), ("wear",), ("creep",), ("delay",), ("thermal",)]
    assert asked["enough"] == []
    monkeypatch.setitem(SETS, "", 0.5)  # nor does one that leaves as much
    searched()
    assert asked["enough"] == []
    monkeypatch.setitem(SETS, "", 0.9)
    monkeypatch.setattr(Search, "_enough", lambda self, found, base: True)
    assert max(len(h.added) for h in searched()) == 1


def test_only_so_many_first_effects_are_tried_again(asked: dict[str, list], monkeypatch: pytest.MonkeyPatch) -> None:
    for k, name in enumerate(("slack", "inertia", "stribeck", "viscous", "friction_lag", "coulomb")):
        monkeypatch.setitem(SETS, name, 0.71 + 0.01 * k)
    searched()
    again = [one for one in asked["upon"][3:-1] if one != ("creep",)]
    assert again == [("delay",), ("slack",), ("inertia",)]  # the four best of the others, but creep itself


def test_the_second_effect_is_tried_beside_others_also_where_the_best_pair_was_begun_from_it(
    asked: dict[str, list], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first effect beside others would be the pairs that are known."""
    whole, calls = Search._from_either_side, list[int]()

    def from_the_second(self: Search, pairs: Any, singles: Any, first: Hypothesis) -> list[Hypothesis]:
        found = whole(self, pairs, singles, first)
        calls.append(1)
        return found if len(calls) > 1 else [made((*h.added[::-1],)) for h in found]

    monkeypatch.setattr(Search, "_from_either_side", from_the_second)
    sets = [frozenset(h.added) for h in searched("the same on reference runs")]
    assert frozenset({"creep", "delay"}) in sets


@pytest.mark.parametrize(
    ("lower", "begun"), [({"wear"}, ["wear", "delay"]), ({"wear", "delay"}, ["wear", "delay", "x"])]
)
def test_a_pair_in_a_valley_that_its_first_effect_led_to_is_begun_from_its_second(
    monkeypatch: pytest.MonkeyPatch, lower: set[str], begun: list[str]
) -> None:
    """Best first, and no further than where that helps no more; a pair whose second effect was not alone stays."""

    def pair(*added: str, cost: float) -> Hypothesis:
        one = made(added)
        one.fitted.cost, one.measured[0] = cost, cost
        return one

    asked = list[str]()

    def refitted(base: Hypothesis, screened: Any, *_: Any, **__: Any) -> list[Hypothesis]:
        asked.append(base.added[-1])
        return [pair(*base.added, s.attached.spec, cost=0.1 if base.added[-1] in lower else 0.9) for s in screened]

    monkeypatch.setattr(module, "refit_candidates", refitted)
    monkeypatch.setattr(Search, "_screened_alone", lambda self, base, spec: [_candidate(spec)])
    first = made(("creep",))
    singles = [made((name,)) for name in ("creep", "wear", "delay", "thermal")]
    pairs = [
        pair("creep", name, cost=cost)
        for name, cost in (("delay", 0.3), ("slack", 0.25), ("wear", 0.2), ("thermal", 0.4))
    ]
    search = Search(kernel("LuGreFriction"), SimpleNamespace(), (), lambda _: None)  # pyright: ignore[reportArgumentType]
    found = {frozenset(h.added): h.added for h in search._from_either_side(pairs, singles, first)}
    assert set(found) == {frozenset(h.added) for h in pairs}
    assert asked == [name.replace("x", "thermal") for name in begun]
    assert {h[0] for h in found.values() if h[1] == "creep"} == lower


def test_the_simpler_of_two_that_leave_as_little_is_built_upon() -> None:
    few, many = made(("wear",), 5), made(("wear",), 9)
    assert leading([many, few]) is few
    assert leading([few, many]) is few
    longer = made(("wear", "slack", "inertia"), 4)
    short = made(("wear", "slack", "inertia"), 9)
    assert leading([short, longer]) is longer
    both, alone = made(("wear", "inertia"), 3), made(("wear",), 9)
    both.fitted.rmse[0], both.measured[0] = alone.fitted.rmse[0] * 1.0001, alone.measured[0] * 1.0002
    assert leading([alone, both]) is alone  # with more effects it is not simpler


@pytest.mark.parametrize("least", [0.006, 0.025])
@pytest.mark.parametrize(("part", "promises"), [(0.98, False), (1.02, True)])
def test_a_further_effect_must_promise_as_much_as_one_that_is_named(part: float, promises: bool, least: float) -> None:
    """Of 0.05 of the spread the gain takes the least times ``part``: what is left is the root of the difference."""
    after = np.sqrt(0.05**2 - (least * part) ** 2)
    fitted: Any = SimpleNamespace(rmse=np.array([0.001, 0.05]) * 3.7, spread=np.full(2, 3.7))
    assert _promises(float(-2.0 * np.log(after / 0.05)), fitted, np.array([0.006, least])) is promises


def test_every_effect_is_tried_where_it_is_not_yet_and_an_offset_until_it_drifts() -> None:
    model = chain("TendonDrive", ("inertia",))
    channels = ("x_out", "tau_in")

    def places(effects: tuple[str, ...], released: tuple[str, ...] = ()) -> set[str]:
        fitted: Any = SimpleNamespace(effects=effects, released=released, problem=SimpleNamespace(channels=channels))
        return {c.spec for c in candidate_places(model, fitted)}

    everywhere = {c.spec for c in possible("TendonDrive", channels, ("inertia",))}
    assert places(("inertia",)) == everywhere
    assert places(("inertia", "wear", "offset_drift@tau_in")) == everywhere - {"wear"}
    assert places((), ("offset_drift@tau_in",)) == everywhere
    there = ("offset_drift@tau_in",)
    assert places(there, there) == everywhere - set(there)


def test_a_drum_of_any_size_is_tried_and_its_turns_are_asked_of_the_log_alone() -> None:
    drums = {m.NAME: 2.0 * np.pi * about(m.NAME).turns for m in EFFECTS if about(m.NAME).turns}
    assert set(drums) == {"drum_periodic", "winding_crossover"}
    for m in EFFECTS:
        assert least_stroke(m) == pytest.approx(drums.get(m.NAME, 0.0))
    names = {c.module.NAME for c in possible("TendonDrive", ("x_out",), ())}
    assert {*drums, "creep"} <= names


@pytest.mark.parametrize(
    ("winner", "base", "form", "large", "open_", "enough"),
    [
        (1, 2, (), False, True, True),  # the last one did not help
        (1, 2, ("b",), False, True, False),  # it corrects the form: that is no effect
        (2, 2, (), False, True, False), (2, 2, (), False, False, True), (2, 2, (), True, False, False),
        (3, 2, (), False, True, False),
    ],
)  # fmt: skip
def test_it_is_enough_where_the_last_did_not_help_or_nothing_is_left(
    monkeypatch: pytest.MonkeyPatch, winner: int, base: int, form: tuple, large: bool, open_: bool, enough: bool
) -> None:
    best: Any = SimpleNamespace(effects=("a", "b", "c")[:winner], has_large_nuisance=large)
    monkeypatch.setattr(module, "choice_of", lambda found, refitted: SimpleNamespace(winner=best))
    monkeypatch.setattr(module, "least_of_further", lambda _: np.full(2, 0.006))
    monkeypatch.setattr(module, "open_channels", lambda *_, **__: np.array([False, open_]))
    start: Any = SimpleNamespace(fitted=None)
    baselines: Any = SimpleNamespace(refitted=start, reference=None, joint=None)
    added = ("a", "b", "c")[:base]
    one: Any = SimpleNamespace(added=added, missing=[s for s in added if s not in form])
    assert Search(kernel("LuGreFriction"), baselines, (), lambda _: None)._enough([], one) is enough


def test_effects_are_begun_from_values_of_reference_runs_too_and_kept_where_that_leaves_less(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of those near the best one there; not play before a friction; and none where the runs' own values serve both."""
    start, seen = made(()), dict[str, Any]()

    def leaving(added: str, rmse: float) -> Hypothesis:
        one = made((added,))
        return replace(one, measured=np.array([rmse**2]), fitted=SimpleNamespace(**{**vars(one.fitted), "left": rmse}))

    there = {"wear": 0.02, "creep": 0.025, "thermal": 0.024, "delay": 0.5}
    freed = {"wear": 0.01, "creep": 0.03, "thermal": 0.021}
    known = [start, leaving("wear", 0.05), leaving("creep", 0.03)]

    def screened(self: Search, base: Hypothesis) -> tuple[list, dict]:
        seen["from"] = (self.baselines, base)
        return [_candidate(spec) for spec in ("backlash@v", *there)], {}

    def refitted(base: Hypothesis, candidates: Any, holdout: Any, reference: Any, *_: Any) -> list[Hypothesis]:
        specs = [s.attached.spec for s in candidates]
        seen["asked"] = specs, holdout, reference
        return [leaving(spec, there[spec]) for spec in specs]

    monkeypatch.setattr(Search, "_screened", screened)
    monkeypatch.setattr(module, "refit_candidates", refitted)
    monkeypatch.setattr(module, "serving_own_runs_alone", lambda fitted, _: fitted)
    monkeypatch.setattr(module, "hypothesis", lambda added, *_: leaving(added[0], freed[added[0]]))
    start.fitted.model = "LuGreFriction"
    joint: Any = SimpleNamespace(with_nuisances=start, refitted=start, reference="there")
    baselines: Any = SimpleNamespace(with_nuisances=start, refitted=start, reference="there", joint=joint)
    search = Search(kernel("LuGreFriction"), baselines, ("held out",), lambda _: None)
    found = search._from_values_of_references(known)
    assert {h.added: float(np.sqrt(h.measured[0])) for h in found} == {("wear",): 0.01, ("thermal",): 0.021}
    assert seen["from"] == (joint, start)
    assert seen["asked"] == (list(there), (), "there")
    baselines.joint = None
    assert search._from_values_of_references(known) == []
