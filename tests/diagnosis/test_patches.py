"""Where something is left that is no noise, what removes less than that is no effect; the shape of friction is form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice import patches as module
from tsm_fmu.diagnosis.choice.hypotheses import Hypothesis, hypothesis
from tsm_fmu.diagnosis.choice.patches import without_patches
from tsm_fmu.diagnosis.choice.supported import Choice
from tsm_fmu.diagnosis.criteria import SHAPE_SPREAD_SHARE
from tsm_fmu.diagnosis.fits.nuisance import nuisance_specs, with_nuisances
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.fits.significance import RemovedOnReference
from tsm_fmu.regression.problem import FitRun

Rig = Callable[..., FitRun]
Shape = Callable[[np.ndarray], np.ndarray]
ONE = np.ones(1)


def made(added: Sequence[str], left: Sequence[float], material: dict[str, float] | None = None) -> Hypothesis:
    """A hypothesis that leaves these mean squares, of channels that spread by 1."""

    class Left:
        task = Task("LuGreFriction", [], ("F",), {})
        effects = (*added, *(material or ()))
        spread = np.ones(len(left))
        rmse = np.sqrt(left)

    fitted = cast("Fitted", Left())
    nuisance_tests = {spec: (removed, fitted) for spec, removed in (material or {}).items()}
    square = (np.array(left), None, 50.0 * ONE, ONE)
    return Hypothesis(tuple(added), fitted, ("sensor_lag@F",), *square, nuisance_tests=lambda: nuisance_tests)


def test_an_effect_that_removes_less_than_is_left_is_a_patch() -> None:
    alone, other = made(["inertia"], [0.0031]), made(["creep"], [0.0057])
    both = made(["inertia", "creep"], [0.0019])
    choice = without_patches(Choice(both, (both,)), [alone, other, both], np.array([True]), [])
    assert choice is not None
    assert choice.winner.effects == ("inertia",)
    assert choice.winner.fitted is alone.fitted


def test_two_effects_that_both_remove_more_than_is_left_stay() -> None:
    both = made(["inertia", "creep"], [0.0009])
    every = [made(["inertia"], [0.0031]), made(["creep"], [0.0057]), both]
    choice = without_patches(Choice(both, (both,)), every, np.array([True]), [])
    assert choice is not None
    assert choice.winner is both


def test_of_three_laws_none_is_believed_where_something_is_left_though_one_only_corrects_the_form() -> None:
    form = ("wear",)
    three = replace(made(["inertia", "creep", "wear"], [0.0008]), form_corrections=form)
    every = [made(["inertia", "wear"], [0.0031]), made(["creep", "wear"], [0.0057]), three]
    assert three.effects == ("inertia", "creep")
    assert without_patches(Choice(three, (three,)), every, np.array([True]), []) is None
    fewer = made(["inertia", "viscous"], [0.0009])  # what is not told from it does not become sure by that
    every += [made(["inertia"], [0.0031]), made(["viscous"], [0.0057]), fewer]
    assert without_patches(Choice(three, (three, fewer)), every, np.array([True]), []) is None
    assert without_patches(Choice(fewer, (fewer,)), every, np.array([True]), []) is not None
    two = replace(made(["inertia", "wear"], [0.0008]), form_corrections=form)
    choice = without_patches(Choice(two, (two,)), [made(["wear"], [0.0057]), two], np.array([True]), [])
    assert choice is not None
    assert choice.winner is two
    large = replace(made(["inertia", "wear"], [0.0008], {"sensor_lag@F": 0.1}), form_corrections=form)  # three with it
    assert without_patches(Choice(large, (large,)), [made(["wear"], [0.0057]), large], np.array([True]), []) is None


def test_what_acts_on_a_channel_where_nothing_is_left_stays() -> None:
    both = made(["inertia", "backlash@x_out"], [0.0019, 0.0002])
    every = [made(["inertia"], [0.0019, 0.0017]), made(["backlash@x_out"], [0.0091, 0.0002]), both]
    choice = without_patches(Choice(both, (both,)), every, np.array([True, False]), [])
    assert choice is not None
    assert choice.winner is both


def test_where_no_effect_removes_more_than_is_left_none_is_named() -> None:
    one = made(["creep"], [0.0031], {"sensor_lag@F": 0.03})
    assert without_patches(Choice(one, (one,)), [made([], [0.0043]), one], np.array([True]), []) is None
    strong = made(["creep"], [0.0031], {"sensor_lag@F": 0.03})
    choice = without_patches(Choice(strong, (strong,)), [made([], [0.0049]), strong], np.array([True]), [])
    assert choice is not None
    assert choice.winner.effects == ("creep",)  # half of what is left is enough for the one that removes most


def test_what_is_left_of_several_answers_is_said_once_and_with_the_fewest() -> None:
    """Two pairs whose second effect is a patch of the same first are one answer; a longer one beside it is none."""
    alone = made(["inertia"], [0.0031])
    pairs = [made(["inertia", other], [0.0019]) for other in ("creep", "delay")]
    singles = [made(["creep"], [0.0057]), made(["delay"], [0.0061])]
    every = [alone, *singles, *pairs]
    choice = without_patches(Choice(pairs[0], tuple(pairs)), every, np.array([True]), [])
    assert choice is not None
    assert [h.effects for h in choice.supported] == [("inertia",)]
    two = made(["backlash@F", "viscous"], [0.0009])
    every += [made(["backlash@F"], [0.0051]), made(["viscous"], [0.0044]), two]
    choice = without_patches(Choice(pairs[0], (pairs[0], two)), every, np.array([True]), [])
    assert choice is not None
    assert [h.effects for h in choice.supported] == [("inertia",)]


@pytest.mark.parametrize(("removed", "named"), [(0.013, True), (0.011, False)])
def test_an_effect_below_the_form_of_any_model_is_none_however_little_is_left(removed: float, named: bool) -> None:
    one = made(["creep"], [1e-6])
    choice = without_patches(Choice(one, (one,)), [made([], [1e-6 + removed**2]), one], np.array([True]), [])
    assert (choice is not None) is named


def test_what_nobody_fitted_is_refitted_without_each_patch(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[str] = []

    def without(fitted: Fitted, spec: str, nuisances: Sequence[str]) -> Fitted:
        taken.append(spec)
        return fitted

    monkeypatch.setattr(module, "refit_without", without)
    monkeypatch.setattr(module, "hypothesis", lambda added, fitted, *_: made(added, [0.0033]))
    one = made(["inertia", "creep", "delay"], [0.0019])
    known = [made(["inertia", "delay"], [0.0020]), made(["inertia", "creep"], [0.0021]),
             made(["creep", "delay"], [0.0119])]  # fmt: skip
    choice = without_patches(Choice(one, (one,)), [*known, one], np.array([True]), [])
    assert choice is not None
    assert choice.winner.added == ("inertia",)
    assert taken == ["creep", "delay"]


def test_a_freedom_that_is_a_patch_is_form() -> None:
    one = made(["inertia"], [0.0031], {"sensor_lag@F": 0.03})
    choice = without_patches(Choice(one, (one,)), [made([], [0.0099]), one], np.array([True]), [])
    assert choice is not None
    assert choice.winner.form_corrections == ("sensor_lag@F",)


def test_what_stands_in_place_of_a_freedom_is_not_judged_by_what_that_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    """A delay leaves little less than the sensor's lag does, in whose place it is, and far less than none does."""
    lag, delay = made([], [0.0037], {"sensor_lag@F": 0.05}), replace(made(["delay@F"], [0.0028]), nuisances=())
    neither = made([], [0.021]).fitted
    monkeypatch.setattr(module, "refit_without", lambda fitted, spec, nuisances: neither)
    choice = without_patches(Choice(delay, (delay,)), [lag, delay], np.array([True]), [])
    assert choice is not None
    assert choice.winner is delay


def shaped(rig: Rig, known: dict[str, float], hyperbola: Shape, reference: bool) -> Hypothesis:
    """Friction whose shape after a reversal is another one than the model's, with or without reference runs."""
    runs = [rig(seed, presliding=hyperbola, pace=0.05, rows=2600) for seed in (61, 62)]
    base = refit(Task("LuGreFriction", runs, ("F",), known), (), {})
    nuisances = nuisance_specs("LuGreFriction", ("F",), ())
    if reference:
        reference_fit = [rig(seed, presliding=hyperbola, pace=0.05, rows=2600) for seed in (63, 64)]
        there = with_nuisances(refit(Task("LuGreFriction", reference_fit, ("F",), known), (), {}), nuisances)
        base = replace(
            base,
            task=replace(base.task, discrepancy=there.rmse, reference_removal=RemovedOnReference(there, nuisances)),
        )
    return hypothesis((), with_nuisances(base, nuisances), nuisances, [])


@pytest.mark.parametrize("reference", [False, True])
def test_the_shape_after_a_reversal_is_an_effect_only_if_it_is_much_and_reference_runs_have_it_not(
    rig: Rig, known: dict[str, float], hyperbola: Shape, reference: bool
) -> None:
    found = shaped(rig, known, hyperbola, reference)
    assert (found.significant.get("presliding_shape", 0.0) > SHAPE_SPREAD_SHARE) is not reference


def test_what_reference_runs_have_is_known_once_it_is_asked_for(rig: Rig, known: dict[str, float]) -> None:
    nuisances = nuisance_specs("LuGreFriction", ("F",), ())
    runs = [rig(seed, instrument=lambda y: y + 0.21) for seed in (65, 66)]
    there = with_nuisances(refit(Task("LuGreFriction", runs, ("F",), known), (), {}), nuisances)
    removed = RemovedOnReference(there, nuisances)
    assert (list(removed), len(removed)) == (list(nuisances), len(nuisances))
    assert 0.15 < removed["offset_drift@F"] < 0.22  # other parameters take a part
    assert removed["offset_drift@F"] is removed["offset_drift@F"]
    assert removed["sensor_lag@F"] < 0.01
    assert "inertia" not in removed
