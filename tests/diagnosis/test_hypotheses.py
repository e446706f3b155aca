"""Hypotheses that compete: rivals refitted from the best one's baseline, and what candidates gain on reference runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice import hypotheses as module
from tsm_fmu.diagnosis.choice import refits
from tsm_fmu.diagnosis.choice.hypotheses import Hypothesis, find_significant_nuisances, hypothesis, with_fit
from tsm_fmu.diagnosis.choice.refits import probe, refit_candidates, refit_rivals, with_the_simplest
from tsm_fmu.diagnosis.choice.supported import with_fewer
from tsm_fmu.diagnosis.criteria import RIVAL_COST_RATIO
from tsm_fmu.diagnosis.fits import refit as refit_module
from tsm_fmu.diagnosis.fits.carried import carried_over
from tsm_fmu.diagnosis.fits.nuisance import again_from, best_refit
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.fits.screening import Screened, screen
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

MASS = 0.053

Rig = Callable[..., FitRun]


@pytest.fixture(scope="module")
def task(rig: Rig, known: dict[str, float]) -> Task:
    return Task("LuGreFriction", [rig(71, inertia=MASS), rig(72, inertia=MASS)], ("F",), known)


@pytest.fixture(scope="module")
def best(task: Task) -> Hypothesis:
    return hypothesis(("inertia",), refit(task, ("inertia",), {"inertia.m": 0.02}), (), [])


def stuck(task: Task, best: Hypothesis, factor: float) -> Hypothesis:
    """A fit with the same effect that ended in another valley of the baseline: one parameter would not move."""
    fitted = best.fitted
    values = {**fitted.values, "sigma2": factor * fitted.values["sigma2"]}
    return hypothesis(("inertia",), refit(task, ("inertia",), values, fixed=["sigma2"]), (), [])


def test_a_close_rival_is_refitted_from_the_baseline_of_the_best(task: Task, best: Hypothesis) -> None:
    one = stuck(task, best, 1.03)
    assert 1.01 * best.fitted.cost < one.fitted.cost < RIVAL_COST_RATIO * best.fitted.cost
    first, again = refit_rivals([best, one], [])
    assert first.added == best.added
    assert first.fitted.cost <= best.fitted.cost
    assert again.added == one.added
    assert again.fitted.cost < 1.001 * best.fitted.cost
    assert again.measured == pytest.approx(again.fitted.rmse**2)


@pytest.fixture(scope="module")
def more(task: Task, best: Hypothesis) -> Hypothesis:
    return hypothesis(("inertia", "wear"), refit(task, ("inertia", "wear"), best.fitted.values), (), [])


def test_one_effect_less_is_refitted_from_the_values_of_the_best(
    task: Task, best: Hypothesis, more: Hypothesis
) -> None:
    one = stuck(task, best, 1.4)
    none = hypothesis((), refit(task, (), {}), (), [])
    first, again, same = with_fewer(more, [none, one, more], none, [])
    assert first is none  # two effects less
    assert same is more
    assert again.added == ("inertia",)
    assert again.fitted.cost < 1.001 * best.fitted.cost < 0.9 * one.fitted.cost


def test_one_effect_less_is_looked_at_that_was_not_and_again_one_less(
    task: Task, best: Hypothesis, more: Hypothesis
) -> None:
    """Of three effects of which two do nothing the way leads down to the one."""
    specs = ("inertia", "wear", "creep")
    three = hypothesis(specs, refit(task, specs, more.fitted.values), (), [])
    none = hypothesis((), refit(task, (), {}), (), [])
    found = {h.added: h for h in with_fewer(three, [none, three], none, [])}
    assert {("inertia", "wear"), ("inertia", "creep"), ("inertia",)} <= found.keys()
    assert ("wear", "creep") not in found  # leaves what the mass removes
    assert found["inertia",].fitted.cost < 1.001 * best.fitted.cost
    assert found[()] is none


def test_what_is_better_is_left_as_it_is_and_a_lower_fit_kept_though_no_rival(
    task: Task, best: Hypothesis, more: Hypothesis
) -> None:
    exact = replace(best, fitted=replace(best.fitted))
    exact.fitted.__dict__["cost"] = 0.0
    none = hypothesis((), refit(task, (), {}), (), [])
    assert with_fewer(more, [exact], none, []) == [exact]
    worse = hypothesis((), refit(task, (), {"sigma2": 3.0}, fixed=["sigma2"]), (), [])
    (lower,) = with_fewer(best, [worse], none, [])  # another valley of the same model: not what the mass removes
    assert lower.added == ()
    assert best.fitted.cost < lower.fitted.cost < worse.fitted.cost
    found = {h.added: h for h in with_fewer(more, [worse], none, [])}
    assert found[()].fitted.cost < worse.fitted.cost
    assert ("wear",) not in found  # what is not known must be as good
    with_nuisances = replace(best, added=(), nuisances=("inertia",))
    assert (
        with_fewer(replace(best, nuisances=("inertia",)), [with_nuisances], none, [])[0] is with_nuisances
    )  # there in both


def test_a_drift_that_was_let_go_is_held_again_from_its_values(task: Task, best: Hypothesis) -> None:
    drift = ("offset_drift@F",)
    worse = hypothesis((), refit(task, drift, {"sigma2": 3.0}, fixed=["sigma2"]), drift, [])
    loose = best_refit(best.fitted, drift, [(best.fitted.values, {})], drift, drift)
    assert loose.released == drift
    (held,) = with_fewer(hypothesis(drift, loose, drift, []), [worse], worse, [])
    assert held.added == held.fitted.released == ()
    assert held.fitted.effects == drift  # the offset stays
    assert held.fitted.values["F.offset_drift.c"] == 0.0
    assert loose.cost <= held.fitted.cost < worse.fitted.cost


def test_what_a_freedom_removes_is_found_once(task: Task, best: Hypothesis, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[str]] = []
    real = module.significant_nuisances

    def counted(fitted: Fitted, specs: list[str], *given: Any) -> dict[str, tuple[float, Fitted]]:
        asked.append(list(specs))
        return real(fitted, specs, *given)

    monkeypatch.setattr(module, "significant_nuisances", counted)
    one = replace(hypothesis((), best.fitted, ("inertia",), []), form_corrections=())
    idle = hypothesis((), refit(task, ("wear",), {}, fixed=["wear.d", "wear.L"]), ("wear",), [])
    find_significant_nuisances([one, idle])
    assert one.effects == ("inertia",)
    assert idle.effects == ()
    judged = replace(one, held_out=one.measured, effective_held_out=one.effective, nuisance_tests=lambda: one.tested)
    assert (judged.effects, judged.has_large_nuisance) == (("inertia",), True)
    assert replace(one, form_corrections=("inertia",), nuisance_tests=lambda: one.tested).effects == ()
    assert sorted(asked) == [["inertia"], ["wear"]]


def test_a_rival_far_behind_is_left_as_it_is(task: Task, best: Hypothesis) -> None:
    one = stuck(task, best, 1.4)
    assert one.fitted.cost > RIVAL_COST_RATIO * best.fitted.cost
    assert refit_rivals([one, best], [])[0] is one


def test_a_rival_keeps_what_it_gained_on_reference_runs(task: Task, best: Hypothesis) -> None:
    one = stuck(task, best, 1.03)
    one = replace(one, measured=one.measured + 0.0007)
    again = refit_rivals([one, best], [])[0]
    assert again.fitted.cost < one.fitted.cost
    assert again.measured - again.fitted.rmse**2 == pytest.approx(0.0007)


def screened(fitted: Fitted) -> list[Screened]:
    return screen(fitted, [attach(kernel("LuGreFriction"), "inertia")])


def test_what_a_candidate_gains_on_reference_runs_is_put_back(rig: Rig, known: dict[str, float], task: Task) -> None:
    base = hypothesis((), refit(task, (), {}), (), [])
    quiet = refit(replace(task, runs=[rig(73), rig(74)]), (), {})
    (alone,) = refit_candidates(base, screened(base.fitted), [], quiet)
    assert alone.reference_gain == pytest.approx(0.0, abs=0.02 * alone.fitted.rmse[0] ** 2)
    same = refit(replace(task, runs=[rig(75, inertia=MASS), rig(76, inertia=MASS)]), (), {})
    (nothing,) = refit_candidates(base, screened(base.fitted), [], same)
    assert nothing.fitted.rmse[0] < 0.5 * base.fitted.rmse[0]
    assert nothing.measured == pytest.approx(base.measured, rel=0.1)  # the reference runs lack it as much


@pytest.mark.parametrize(("there", "to_the_end"), [(0.0, False), (MASS, True)])
def test_what_a_candidate_gains_on_reference_runs_begins_where_it_is_on_the_measured_ones(
    rig: Rig, task: Task, there: float, to_the_end: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is refitted to the end there where it gains something."""
    base = hypothesis((), refit(task, (), {}), (), [])
    reference = refit(replace(task, runs=[rig(80, inertia=there), rig(81, inertia=there)]), (), {})
    begun, ended = list[Screened](), list[Fitted]()
    first, last = refits.begun_with, refits.refit_with

    def counted(fitted: Fitted, one: Screened, *given: Any, **options: Any) -> Fitted:
        begun.extend([one] if fitted is reference else [])
        return first(fitted, one, *given, **options)

    def to_end(fitted: Fitted, *given: Any, **options: Any) -> Fitted:
        ended.append(fitted)
        return last(fitted, *given, **options)

    monkeypatch.setattr(refits, "begun_with", counted)
    monkeypatch.setattr(refits, "refit_with", to_end)
    (found,) = refit_candidates(base, screened(base.fitted), [], reference)
    assert found.fitted.values["inertia.m"] == pytest.approx(MASS, rel=0.05)
    assert [one.starts for one in begun] == [[({"inertia.m": found.fitted.values["inertia.m"]}, {})]]
    assert (reference in ended) is to_the_end


def test_a_refit_from_values_near_by_looks_for_no_scales(
    task: Task, best: Hypothesis, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where it ends it would without them too."""
    asked: list[list[str]] = []
    real = refit_module.sensitivity_scales

    def counted(problem: Any, known: Any = None) -> dict[str, float]:
        asked.append([name for name in problem.space.free if name not in (known or {})])
        return real(problem, known)

    monkeypatch.setattr(refit_module, "sensitivity_scales", counted)
    moved = replace(best.fitted, task=replace(task, runs=task.runs[:1]), table=1.01 * best.fitted.table)
    again = again_from(moved, ())
    assert asked == [[]]
    anew = best_refit(moved, moved.effects, [(moved.values, moved.per_run)], ())
    assert asked[1] != []
    assert again.cost == pytest.approx(anew.cost, rel=2e-3)
    assert again.scales.keys() == anew.scales.keys()


def test_candidates_are_judged_once_they_have_ended(task: Task, rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """The closest rivals are refitted before: what one leaves of held-out runs is that of its last fit."""
    held, seen = [rig(79, inertia=MASS)], list[Fitted]()
    real = module.carried_over

    def counted(fitted: Fitted, *given: Any) -> Any:
        seen.append(fitted)
        return real(fitted, *given)

    base = hypothesis((), refit(task, (), {}), (), held)
    monkeypatch.setattr(module, "carried_over", counted)
    listed = screen(base.fitted, [attach(kernel("LuGreFriction"), spec) for spec in ("viscous", "inertia", "wear")])
    found = refit_candidates(base, listed, held)
    assert len(found) == 3
    assert sorted(map(id, seen)) == sorted(id(h.fitted) for h in found)
    assert min(found, key=lambda h: h.fitted.cost).added == ("inertia",)


def test_what_is_held_out_is_a_mean_square_of_its_own(best: Hypothesis, rig: Rig) -> None:
    held = [rig(77, inertia=MASS), rig(78, inertia=0.0, rows=900)]
    one = hypothesis(("inertia",), best.fitted, ("wear",), held, 0.0003)
    assert one.held_out == pytest.approx(carried_over(best.fitted, held).mean_square + 0.0003)
    assert one.measured == pytest.approx(best.fitted.rmse**2 + 0.0003)
    assert one.reference_gain == pytest.approx([0.0003])
    assert (one.added, one.nuisances) == (("inertia",), ("wear",))
    again = with_fit(replace(one, form_corrections=("inertia",)), best.fitted, [])
    assert (again.held_out, again.form_corrections, again.added) == (None, ("inertia",), ("inertia",))
    assert again.measured == pytest.approx(one.measured)
    assert again.effective_held_out.tolist() == [1.0]


def test_a_probe_ranks_candidates_by_what_a_few_steps_of_a_refit_gain(task: Task) -> None:
    base = refit(task, (), {})
    listed = screen(base, [attach(kernel("LuGreFriction"), spec) for spec in ("coulomb", "inertia", "creep")])
    found = probe(base, listed, ())
    gains = [s.gain for s in found]
    assert gains == sorted(gains, reverse=True)
    assert found[0].attached.spec == "inertia"
    before = {s.attached.spec: s.gain for s in listed}
    assert all(s.gain >= before[s.attached.spec] for s in found)
    assert found[0].gain > before["inertia"] + 0.5  # the linear step saw a part of it
    assert len(probe(base, listed * 3, ())) == 8


@pytest.mark.parametrize(("held_out", "missing"), [(None, True), (0.1**2, True), (0.14**2, False)])
def test_what_reference_runs_do_without_is_missing_where_held_out_runs_are_as_good(
    best: Hypothesis, held_out: float | None, missing: bool
) -> None:
    """A curve after reversals that removes 2 % of the spread: below what rigs differ in."""
    spec, spread = "presliding_shape", best.fitted.spread
    task = replace(best.fitted.task, discrepancy=1.01 * best.fitted.rmse, reference_removal={spec: 0.003 * spread})
    fitted = replace(best.fitted, task=task)
    without: Any = SimpleNamespace(rmse=np.sqrt(fitted.rmse**2 + (0.02 * spread) ** 2))
    assert (without.rmse > 2.0 * task.discrepancy).all()
    one = replace(
        best, added=(), fitted=fitted, nuisances=(spec,), nuisance_tests=lambda: {spec: (0.02, without)},
        held_out=None if held_out is None else held_out * (fitted.rmse / 0.1) ** 2,
    )  # fmt: skip
    assert one.effects == ((spec,) if missing else ())


@pytest.mark.parametrize(
    ("last", "taken"), [(("wear", "inertia", "coulomb"), "inertia"), (("wear", "thermal"), "wear")]
)
def test_the_last_place_is_that_of_the_best_effect_of_one_parameter(last: tuple[str, ...], taken: str) -> None:
    """Where one is left: one linear step favours laws of many parameters."""
    specs = ("creep", "friction_lag", "stribeck", *last)
    gains = np.linspace(1.0, 0.1, len(specs)).tolist()
    listed = [Screened(attach(kernel("LuGreFriction"), s), g, [], {}) for s, g in zip(specs, gains, strict=True)]
    found = [s.attached.spec for s in with_the_simplest(listed, 4, "LuGreFriction")]
    assert found == ["creep", "friction_lag", "stribeck", taken]
    assert with_the_simplest(listed, len(listed), "LuGreFriction") == listed
    idle = [replace(s, gain=0.0) for s in listed]
    assert with_the_simplest(idle, 4, "LuGreFriction") == []


def test_plays_before_the_friction_take_no_place_of_others() -> None:
    specs = ("backlash@v", "creep", "smooth_backlash@v", "friction_lag", "stribeck", "wear")
    gains = np.linspace(1.0, 0.1, len(specs)).tolist()
    listed = [Screened(attach(kernel("LuGreFriction"), s), g, [], {}) for s, g in zip(specs, gains, strict=True)]
    found = [s.attached.spec for s in with_the_simplest(listed, 3, "LuGreFriction")]
    assert found == ["backlash@v", "creep", "smooth_backlash@v", "friction_lag", "stribeck"]


@pytest.mark.parametrize(("spec", "says"), [("backlash@v", False), ("inertia", True)])
def test_play_that_only_corrects_the_form_of_a_friction_says_nothing(best: Hypothesis, spec: str, says: bool) -> None:
    assert not best.disguised
    assert replace(best, form_corrections=(spec,)).disguised is not says
