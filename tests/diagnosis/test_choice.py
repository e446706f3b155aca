"""Which hypothesis is supported, on hypotheses made up of numbers: what they leave, and with how many parameters."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice.form import beside
from tsm_fmu.diagnosis.choice.hypotheses import Hypothesis
from tsm_fmu.diagnosis.choice.refits import _near_the_best, interleaved, shortlist
from tsm_fmu.diagnosis.choice.selection import _imitates
from tsm_fmu.diagnosis.choice.supported import Choice, choice_of, dominated, indistinguishable, leading, log_residual
from tsm_fmu.diagnosis.fits.refit import Task
from tsm_fmu.effects import effect_of

CLEAN_EFFECT_SPREAD_SHARE, FURTHER_EFFECT_SPREAD_SHARE, FIT_SPREAD_SHARE = 0.006, 0.025, 0.003
LAW_FORM_SHARE, DIFFERENCE_DEVIANCE, CONVERGED_SHARE, SHAPE_SPREAD_SHARE = 0.03, 8.0, 0.002, 0.045
"""As docs/diagnosis.md lists them: numbers of this test, not of the code under test."""
SPREAD = 3.7
MANY = 1e5


def made(
    added: str, rmse: float, held: float | None = None, *, parameters: int = 5, effective: float = MANY,
    nuisance_specs: dict[str, float] | None = None, unit: float = SPREAD, discrepancy: float = 0.0,
    steps: float = 0.0,
    referenced: bool = False, gap: float = 0.0, share: float = 0.1,
) -> Hypothesis:  # fmt: skip
    """What leaves ``rmse`` (of the spread) on one channel; ``added`` are ids with blanks between, each of a size."""
    fitted: Any = SimpleNamespace(
        model="LuGreFriction",
        spread=np.array([unit]), rmse=np.array([rmse * unit]), effects=(*added.split(), *(nuisance_specs or ())),
        problem=SimpleNamespace(shared=tuple(range(parameters)), per_run=(), declared={}, runs=[None]),
        task=Task(
            "", (), (), {}, discrepancy=np.array([discrepancy * unit]), gap=np.array([gap * unit]),
            reference_removal={"delay@F": np.zeros(1)} if referenced else {}, steps=np.array([steps * unit]),
        ),
        share_of=lambda spec: np.array([share]), residuals=[np.zeros((9, 1))],
    )  # fmt: skip
    square = (None if held is None else np.array([(held * unit) ** 2]), np.array([effective]), np.array([effective]))
    nuisance_tests: Any = {spec: (removed, fitted) for spec, removed in (nuisance_specs or {}).items()}
    measured = np.array([(rmse * unit) ** 2])
    return Hypothesis(
        tuple(added.split()), fitted, tuple(nuisance_tests), measured, *square, nuisance_tests=lambda: nuisance_tests
    )


def refit_without(gain: float, before: float = 0.05) -> float:
    """RMSE after something of RMS ``gain`` is gone."""
    return float(np.sqrt(before**2 - gain**2))


def names(choice: Choice) -> list[tuple[str, ...]]:
    return [h.effects for h in choice.supported]


@pytest.mark.parametrize(
    ("gain", "before", "named"),
    [(0.0054, 0.007, False), (0.0066, 0.007, True), (0.0258, 0.05, False), (0.0276, 0.05, True)],
)
def test_an_effect_removes_some_of_the_spread_and_much_of_what_is_left(gain: float, before: float, named: bool) -> None:
    """0.6 % of the spread, and 0.4 times the mean square that is left with it."""
    plain = made("", before)
    choice = choice_of([plain, made("inertia", refit_without(gain, before))], plain)
    assert names(choice) == [("inertia",) if named else ()]
    assert choice.best.added == ("inertia",)


@pytest.mark.parametrize(
    ("effect", "gain", "before", "named"),
    [
        ("nonlocal_memory", 0.8 * SHAPE_SPREAD_SHARE, 0.05, False),
        ("nonlocal_memory", 1.2 * SHAPE_SPREAD_SHARE, 0.08, True),
        ("nonlocal_memory", 0.0399, 0.04, True),  # it leaves next to nothing
        ("wear", 0.8 * SHAPE_SPREAD_SHARE, 0.05, True),
    ],
)
def test_what_follows_a_reversal_is_missing_beyond_what_rigs_differ_in(
    effect: str, gain: float, before: float, named: bool
) -> None:
    plain = made("", before)
    one = beside(plain, effect, made(effect, refit_without(gain, before)))
    assert one.effects == ((effect,) if named else ())
    assert names(choice_of([plain, one], plain)) == [(effect,) if named else ()]


@pytest.mark.parametrize(
    ("before", "gain", "at_work", "supported"),
    [
        (0.0019, 0.0013, True, {("sensor_lag@F",)}),
        (0.0019, 0.0013, False, {("thermal",), ("sensor_lag@F",)}),  # in its place
        (0.0066, 0.95 * CLEAN_EFFECT_SPREAD_SHARE, True, {("sensor_lag@F",)}),
        (0.0066, 1.05 * CLEAN_EFFECT_SPREAD_SHARE, True, {("thermal",)}),
    ],
)
def test_beside_a_nuisance_effect_that_is_missing_another_one_removes_what_any_must(
    before: float, gain: float, at_work: bool, supported: set[tuple[str, ...]]
) -> None:
    """A small lag that explains nearly all would be the form of whatever law is put beside it, and that be the name."""
    plain = made("", before, 0.0018, nuisance_specs={"sensor_lag@F": 0.0103}, gap=0.0123)
    left = {"sensor_lag@F": 0.006} if at_work else {}
    one = made("thermal", refit_without(gain, before), 0.0018, nuisance_specs=left)
    assert set(names(choice_of([plain, one], made("", 0.0123, 0.0123)))) == supported


@pytest.mark.parametrize(("left", "named"), [({"presliding_shape": 0.3}, False), ({}, True)])
def test_what_takes_the_place_of_another_effect_is_no_correction(left: dict[str, float], named: bool) -> None:
    """It removes little more than the shape after a reversal did, which does nothing any more beside it."""
    plain = made("", 0.2, nuisance_specs={"presliding_shape": 0.3})
    gain = 0.8 * SHAPE_SPREAD_SHARE
    made_so = made("nonlocal_memory", refit_without(gain, 0.2), nuisance_specs=left)
    one = beside(plain, "nonlocal_memory", made_so)
    assert ("nonlocal_memory" in one.effects) is named


@pytest.mark.parametrize("referenced", [False, True])
@pytest.mark.parametrize(("part", "named"), [(0.96, False), (1.04, True)])
def test_a_further_effect_must_remove_more_than_one_alone(part: float, named: bool, referenced: bool) -> None:
    """What the first law lacks of the rig's own looks like a second effect; reference runs do not show it."""
    plain, one = (made(a, left, gap=0.08, referenced=referenced) for a, left in (("", 0.08), ("inertia", 0.03)))
    left = refit_without(part * FURTHER_EFFECT_SPREAD_SHARE, 0.03)
    both = made("inertia stribeck", left, gap=0.08, referenced=referenced)
    assert names(choice_of([plain, one, both], plain)) == [("inertia", "stribeck") if named else ("inertia",)]


@pytest.mark.parametrize(("part", "named"), [(0.96, False), (1.04, True)])
def test_a_further_effect_is_seen_on_held_out_runs_too(part: float, named: bool) -> None:
    """What the first law lacks differs from motion to motion; on the measured runs it removes enough."""
    plain, one = (made(a, left, left, gap=0.08) for a, left in (("", 0.08), ("inertia", 0.03)))
    shown, carried = (refit_without(k * FURTHER_EFFECT_SPREAD_SHARE, 0.03) for k in (1.04, part))
    both = made("inertia stribeck", shown, carried, gap=0.08)
    assert names(choice_of([plain, one, both], plain)) == [("inertia", "stribeck") if named else ("inertia",)]
    alone, other = made("inertia", shown, carried, gap=0.03), made("", 0.03, 0.03, gap=0.03)  # of no other law
    assert names(choice_of([other, alone], other)) == [("inertia",)]


@pytest.mark.parametrize(("gap", "held", "named"), [(0.45, 0.0086, True), (0.45, 0.0101, False), (0.09, 0.0086, False)])
def test_where_held_out_runs_show_the_first_too_much_a_further_effect_halves_what_is_left_on_all(
    gap: float, held: float, named: bool
) -> None:
    """Of 45 % of the spread the law of the first may lack 8 % there, more than the second removes anywhere."""
    plain, one = made("", 0.0705, gap, gap=0.0705), made("inertia", 0.0326, 0.0127, gap=0.0705)
    both = made("inertia viscous", 0.0099, held, gap=0.0705)
    assert names(choice_of([plain, one, both], plain)) == [("inertia", "viscous") if named else ("inertia",)]


@pytest.mark.parametrize(("part", "named"), [(0.96, False), (1.04, True)])
def test_a_further_effect_removes_more_than_a_right_law_may_leave(part: float, named: bool) -> None:
    """The first one removes 62 % of the spread: its law, right but not quite the rig's, may leave 11 %."""
    plain, one = made("", 0.64, gap=0.64), made("inertia", 0.16, gap=0.64)
    may_leave = float(np.sqrt(LAW_FORM_SHARE / (1.0 + LAW_FORM_SHARE * part**2) * (0.64**2 - 0.16**2)))
    both = made("inertia stribeck", refit_without(part * may_leave, 0.16), gap=0.64)
    assert names(choice_of([plain, one, both], plain)) == [("inertia", "stribeck") if named else ("inertia",)]


def test_two_that_together_remove_little_do_not_hide_the_one_that_is_there() -> None:
    """The larger threshold is for the second: nothing at all is not as good as a pair that removes less than that."""
    left = {"": 0.02, "inertia": 0.006, "inertia stribeck": 0.003}
    plain, one, both = (made(added, rmse, gap=0.02) for added, rmse in left.items())
    assert names(choice_of([plain, one, both], plain)) == [("inertia",)]


@pytest.mark.parametrize("refitted", [0.02, 0.03])
def test_where_no_effect_acts_yet_a_further_one_is_as_one_alone(refitted: float) -> None:
    """The law of the first lacks nothing in a channel that it does not change: 0.6 % of the spread is enough there.

    Nor where other values of the model have closed some of the gap.
    """

    def two(added: str, first: float, second: float) -> Hypothesis:
        one = made(added, first)
        fitted: Any = one.fitted
        task = replace(fitted.task, gap=np.array([0.08, refitted]) * SPREAD, discrepancy=np.zeros(2), steps=np.zeros(2))
        vars(fitted).update(task=task, spread=np.full(2, SPREAD), rmse=np.array([first, second]) * SPREAD)
        fitted.share_of = lambda spec: np.array([0.1, 0.001] if spec == "inertia" else [0.1, 0.1])
        return replace(one, measured=fitted.rmse**2, effective=np.full(2, MANY), effective_held_out=np.full(2, MANY))

    plain, one = two("", 0.08, 0.02), two("inertia", 0.01, 0.02)
    elsewhere, there = two("inertia stribeck", 0.01, 0.012), two("inertia stribeck", 0.004, 0.02)
    assert names(choice_of([plain, one, elsewhere], plain)) == [("inertia", "stribeck")]
    assert names(choice_of([plain, one, there], plain)) == [("inertia",)]


@pytest.mark.parametrize(("left", "held", "named"), [(0.0083, 0.0090, False), (0.0070, 0.0075, True)])
def test_what_takes_the_place_of_the_best_by_its_few_parameters_is_told_from_none(
    left: float, held: float, named: bool
) -> None:
    """0.4 % of the spread is no effect, whatever twenty parameters more remove."""
    few = {"effective": 45.0}
    plain, best = made("", 0.0094, 0.0103, **few), made("thermal", 0.0070, 0.0074, parameters=25, **few)
    one = made("viscous", left, held, **few)
    found = choice_of([plain, best, one], plain)
    assert found.best.added == ("thermal",)
    assert names(found) == [("viscous",) if named else ()]


@pytest.mark.parametrize(
    ("left", "held", "pair"), [(0.0126, 0.0124, True), (0.0126, 0.0080, False), (0.0085, 0.0124, False)]
)
def test_two_effects_that_leave_half_of_what_another_one_does_on_all_runs(left: float, held: float, pair: bool) -> None:
    """Neither is what the law of that one lacks: it is not among them."""
    plain, another = made("", 0.0369, 0.0306, gap=0.0369), made("stribeck", left, held, gap=0.0369)
    one, both = made("inertia", 0.03, 0.03, gap=0.0369), made("inertia viscous", 0.0065, 0.0060, gap=0.0369)
    assert names(choice_of([plain, another, one, both], plain)) == [("inertia", "viscous") if pair else ("stribeck",)]


def test_what_leaves_little_more_than_reference_runs_has_nothing_to_explain() -> None:
    """Within 1.3 times what the model leaves there, a law may bend to the form of the model."""
    for left, named in ((0.0255, False), (0.0265, True)):
        plain = made("", left, discrepancy=0.02, referenced=True)
        one = made("breakaway_ageing", 0.016, discrepancy=0.02, referenced=True)
        assert names(choice_of([plain, one], plain)) == [("breakaway_ageing",) if named else ()]


@pytest.mark.parametrize(
    ("left", "held", "named"),
    [
        (0.0141, 0.0141, True), (0.0143, 0.0141, False), (0.0141, 0.0143, False),
        (0.0143, None, False), (0.0141, None, False),
    ],
)  # fmt: skip
def test_what_leaves_half_of_that_on_all_runs_is_there_whatever_reference_runs_leave(left, held, named) -> None:
    """Their motions may show more of the form of the model than those of the others do."""
    plain = made("", 0.02, 0.02 if held else None, discrepancy=0.02, referenced=True)
    one = made("breakaway_ageing", left, held, discrepancy=0.02, referenced=True)
    assert names(choice_of([plain, one], plain)) == [("breakaway_ageing",) if named else ()]
    plain, one = replace(plain, folded=True), replace(one, folded=True)  # the measured runs again, left out in turn
    assert names(choice_of([plain, one], plain)) == [()]


@pytest.mark.parametrize(("left", "named"), [(0.0369, True), (0.0425, False)])
@pytest.mark.parametrize("there", [0.0, 0.003])
def test_beside_steps_of_a_converter_an_effect_must_remove_more_than_these_make(left, there, named) -> None:
    """1.3 times as much: 0.1^2 - 0.04^2 = (1.3 * 0.07)^2."""
    plain = made("", 0.1, discrepancy=there, referenced=bool(there), steps=0.07)
    one = made("inertia", left, discrepancy=there, referenced=bool(there), steps=0.07)
    assert names(choice_of([plain, one], plain)) == [("inertia",) if named else ()]


@pytest.mark.parametrize(("held", "named"), [(0.0094, True), (0.0096, False)])
def test_a_value_for_each_run_that_predicts_nearly_all_of_other_runs_is_a_law(held: float, named: bool) -> None:
    """Nine tenths of their mean square, where it gains too little on the measured ones to be told from chance."""
    plain, one = made("", 0.012, 0.03, effective=30.0), made("wear", 0.01, held, effective=30.0)
    fitted: Any = one.fitted
    fitted.problem.per_run = ("wear__X_0",)
    fitted.problem.declared["wear__X_0"] = SimpleNamespace(name="wear.X_0")
    assert names(choice_of([plain, one], plain)) == [("wear",) if named else ()]


def test_what_removes_enough_on_held_out_runs_alone_is_not_named() -> None:
    plain = made("", 0.006, 0.009)
    assert names(choice_of([plain, made("stiffness_hardening", 0.001, 0.001)], plain)) == [()]
    plain = made("", 0.007, 0.009)
    assert names(choice_of([plain, made("stiffness_hardening", 0.001, 0.001)], plain)) == [("stiffness_hardening",)]


@pytest.mark.parametrize(
    ("before", "after", "held_before", "held_after", "named"),
    [
        (0.0031, 0.002, 0.025, 0.0021, True),
        (0.0031, 0.002, 0.025, 0.0081, False),  # something else is left of held-out runs
        (0.0031, 0.0027, 0.025, 0.0021, False),  # nothing that counts is gone on the measured ones
        (0.0031, 0.002, 0.0118, 0.001, False),  # within the form of any friction model
    ],
)
def test_what_the_measured_runs_show_little_of_is_named_where_it_is_nearly_all_that_others_show(
    before: float, after: float, held_before: float, held_after: float, named: bool
) -> None:
    """Below the size that an effect must have on the runs that it is fitted to, which another motion shows largely."""
    plain, one = made("", before, held_before), made("friction_lag", after, held_after)
    assert names(choice_of([plain, one], plain)) == [("friction_lag",) if named else ()]
    folded = [replace(h, folded=True) for h in (plain, one)]  # measured runs left out in turn are no other motion
    assert names(choice_of(folded, folded[0])) == [()]


@pytest.mark.parametrize("spec", ["nonlocal_memory", "backlash", "smooth_backlash", "presliding_shape"])
def test_beside_another_effect_what_follows_a_reversal_is_form(spec: str) -> None:
    """Even where next to nothing is left with it: what the law of the other lacks shows after reversals as well."""
    other = made("inertia", 0.03)
    little, much = (made(f"inertia {spec}", refit_without(part * SHAPE_SPREAD_SHARE, 0.05)) for part in (0.9, 1.05))
    base = made("inertia", 0.05)
    assert beside(base, spec, little).effects == ("inertia",)
    assert beside(base, spec, much).effects == ("inertia", spec)
    assert beside(other, spec, made(f"inertia {spec}", 0.001)).effects == ("inertia",)
    assert beside(other, "stribeck", made("inertia stribeck", 0.001)).effects == ("inertia", "stribeck")


def on_two(spec_elsewhere: str, one: Hypothesis) -> Hypothesis:
    """The same beside a second channel, which this effect alone changes."""
    fitted: Any = one.fitted
    fitted.spread, fitted.rmse = np.full(2, SPREAD), np.append(fitted.rmse, 0.01 * SPREAD)
    fitted.share_of = lambda spec: np.array([0.0, 0.1] if spec == spec_elsewhere else [0.1, 0.0])
    none = np.zeros(2)
    fitted.task = replace(fitted.task, model="LuGreFriction", gap=none, discrepancy=none, steps=none)
    return replace(one, measured=np.append(one.measured, (0.01 * SPREAD) ** 2))


def test_beside_an_effect_on_another_channel_what_follows_a_reversal_may_be_all_that_is_missing() -> None:
    """What the law of that effect lacks does not show there."""
    spec = "backlash"
    base, there, elsewhere = made("inertia", 0.03), made(f"inertia {spec}", 0.001), made(f"inertia {spec}", 0.001)
    assert beside(on_two("", base), spec, on_two("", there)).effects == ("inertia",)
    assert beside(on_two("inertia", base), spec, on_two("inertia", elsewhere)).effects == ("inertia", spec)


@pytest.mark.parametrize(("parameters", "left", "expected"), [(14, 0.02, 1), (5, 0.02, 2), (14, 0.013, 2)])
def test_a_form_that_takes_more_laws_and_parameters_says_no_less(parameters: int, left: float, expected: int) -> None:
    """One law and a nuisance effect that is one of its own, or another law that needs a correction of the form."""
    plain, few = (
        made(added, rmse, nuisance_specs={"presliding_shape": 0.046})
        for added, rmse in (("", 0.09), ("direction_asymmetry", 0.02))
    )
    many = replace(made("stribeck nonlocal_memory", left, parameters=parameters), form_corrections=("nonlocal_memory",))
    found = choice_of([plain, few, many], plain)
    assert len(found.winner.added) == expected


def test_a_law_with_a_value_for_each_run_must_be_better_on_all_of_them() -> None:
    """Elsewhere such a value may stand for whatever differs between runs: loads, say."""

    def wearing(rmse: float, held: float) -> Hypothesis:
        one = made("wear", rmse, held)
        one.fitted.problem.per_run = ("wear__X_0",)
        one.fitted.problem.declared["wear__X_0"] = SimpleNamespace(name="wear.X_0")
        return one

    plain, load = made("", 0.05, 0.05), made("load_dependence", 0.012, 0.015)
    load.__dict__["disguised"] = False
    assert wearing(0.01, 0.01).values_of_runs == 1
    assert names(choice_of([plain, load, wearing(0.0118, 0.006)], plain))[0] == ("wear",)
    assert len(choice_of([plain, load, wearing(0.0118, 0.006)], plain).supported) == 2
    assert names(choice_of([plain, load, wearing(0.006, 0.006)], plain)) == [("wear",)]
    free = made("inertia", 0.0118, 0.006)  # without such a value better on held-out runs is better
    assert names(choice_of([plain, load, free], plain)) == [("inertia",)]


@pytest.mark.parametrize(
    ("measured", "held", "told_apart"), [(0.01, 0.03, False), (0.03, 0.01, False), (0.03, 0.03, True)]
)
def test_of_two_that_hide_behind_each_other_both_with_a_value_for_each_run(
    measured: float, held: float, told_apart: bool
) -> None:
    """Of a run that was not fitted the first seconds say it: what that makes of its error is neither's."""
    plain, one, other = made("", 0.1, 0.1), made("wear", 0.01, 0.01), made("thermal", measured, held)
    for spec, state, hypothesis in (("wear", "X_0", one), ("thermal", "h_0", other)):
        hypothesis.fitted.problem.per_run = (f"{spec}__{state}",)
        hypothesis.fitted.problem.declared[f"{spec}__{state}"] = SimpleNamespace(name=f"{spec}.{state}")
    found = names(choice_of([plain, one, other], plain))
    assert found == ([("wear",)] if told_apart else [("wear",), ("thermal",)])


def test_measured_and_held_out_runs_that_say_the_opposite_tell_nothing_apart() -> None:
    plain, one, other = made("", 0.05, 0.05), made("creep", 0.018, 0.009), made("inertia", 0.01, 0.017)
    assert set(names(choice_of([plain, one, other], plain))) == {("creep",), ("inertia",)}
    better = made("inertia", 0.01, 0.008)
    assert names(choice_of([plain, one, better], plain)) == [("inertia",)]


def of_two_channels(added: str, rmse: tuple[float, float], held: tuple[float, float]) -> Hypothesis:
    """The same on two channels."""
    one, two = (made(added, *errors) for errors in zip(rmse, held, strict=True))
    assert one.held_out is not None
    assert two.held_out is not None
    one.fitted.spread = one.fitted.spread.repeat(2)
    one.fitted.share_of = lambda spec: np.array([0.1, 0.1])
    both = np.concatenate([one.measured, two.measured]), np.concatenate([one.held_out, two.held_out])
    return replace(
        one, measured=both[0], held_out=both[1], effective=one.effective.repeat(2),
        effective_held_out=one.effective_held_out.repeat(2),
    )  # fmt: skip


def test_channels_that_say_the_opposite_tell_two_that_leave_as_much_not_apart() -> None:
    plain = of_two_channels("", (0.05, 0.08), (0.05, 0.08))
    one = of_two_channels("creep", (0.011, 0.024), (0.012, 0.025))
    other = of_two_channels("inertia", (0.021, 0.012), (0.020, 0.013))
    assert set(names(choice_of([plain, one, other], plain))) == {("creep",), ("inertia",)}
    assert names(choice_of([plain, one, of_two_channels("inertia", (0.012, 0.012), (0.013, 0.013))], plain)) == [
        ("inertia",)
    ]
    far_less = of_two_channels("inertia", (0.021, 0.003), (0.020, 0.003))
    assert names(choice_of([plain, one, far_less], plain)) == [("inertia",)]


@pytest.mark.parametrize(
    ("within", "named"), [(0.3, {"temperature_dependence"}), (0.7, {"temperature_dependence", "thermal"})]
)
def test_warmth_that_a_thermometer_follows_within_runs_is_told_apart_by_no_value_of_runs(
    within: float, named: set[str]
) -> None:
    """A temperature that is constant in each run warmth could always make; one that rises with the work is its own."""
    plain = made("", 0.05, 0.05)
    follows, warms = made("temperature_dependence", 0.012, 0.0118), made("thermal", 0.0115, 0.0121, parameters=7)
    t = np.linspace(-np.sqrt(3.0), np.sqrt(3.0), 500)
    runs = [SimpleNamespace(inputs=(300.0 + level + within * t)[:, None]) for level in (-1.0, 1.0)]
    for one in (follows, warms):
        one.fitted.problem.kernel = SimpleNamespace(inputs=[SimpleNamespace(name="temperature")])
        one.fitted.problem.runs = runs
        one.__dict__["disguised"] = False
    warms.fitted.problem.per_run = ("thermal__h_0",)
    warms.fitted.problem.declared["thermal__h_0"] = SimpleNamespace(name="thermal.h_0")
    assert {name for effects in names(choice_of([plain, follows, warms], plain)) for name in effects} == named


def test_a_small_effect_is_named_where_it_removes_nearly_all_of_the_gap() -> None:
    plain = made("", 1.5 * CLEAN_EFFECT_SPREAD_SHARE, 1.5 * CLEAN_EFFECT_SPREAD_SHARE)
    everywhere = made("inertia", 0.2 * CLEAN_EFFECT_SPREAD_SHARE, 0.2 * CLEAN_EFFECT_SPREAD_SHARE)
    assert names(choice_of([plain, everywhere], plain)) == [("inertia",)]
    only_measured = made("inertia", 0.2 * CLEAN_EFFECT_SPREAD_SHARE, 2.0 * CLEAN_EFFECT_SPREAD_SHARE)
    assert names(choice_of([plain, only_measured], plain)) == [()]


@pytest.mark.parametrize(("part", "named"), [(0.95, False), (1.1, True)])
def test_eight_of_deviance_tell_two_hypotheses_apart(part: float, named: bool) -> None:
    """With 60 independent samples chance makes 8/60 of what the better one leaves, beyond the limit of an effect."""
    better = 0.01
    gap = CLEAN_EFFECT_SPREAD_SHARE**2 + DIFFERENCE_DEVIANCE * better**2 / 60.0
    removed = part * gap / (1.0 - part * LAW_FORM_SHARE)  # and the form of a law
    plain = made("", float(np.sqrt(better**2 + removed)), effective=60.0)
    assert bool(choice_of([plain, made("inertia", better, effective=60.0)], plain).winner.effects) is named


@pytest.mark.parametrize(("effective", "named"), [(12.0, False), (2000.0, True)])
def test_few_independent_samples_make_a_difference_of_noise(effective: float, named: bool) -> None:
    plain = made("", 0.05, effective=effective)
    found = choice_of([plain, made("inertia", refit_without(0.03), effective=effective)], plain)
    assert bool(found.winner.effects) is named


def test_a_right_law_may_leave_a_little_of_what_the_best_removes() -> None:
    plain, best = made("", 0.31), made("viscous", 0.03)
    removed = 0.31**2 - 0.03**2
    allowed = FIT_SPREAD_SHARE**2 + LAW_FORM_SHARE * removed + DIFFERENCE_DEVIANCE * 0.03**2 / MANY
    near = made("stribeck", np.sqrt(0.03**2 + 0.98 * allowed))
    far = made("inertia", np.sqrt(0.03**2 + 1.02 * allowed))
    assert indistinguishable(near, best, plain)
    assert not indistinguishable(far, best, plain)
    assert names(choice_of([plain, far, near, best], plain)) == [("viscous",), ("stribeck",)]


def test_rivals_that_differ_on_held_out_runs_are_told_apart() -> None:
    plain = made("", 0.31, 0.29)
    one, other = made("viscous", 0.03, 0.028), made("stribeck", 0.031, 0.17)
    assert names(choice_of([plain, other, one], plain)) == [("viscous",)]


@pytest.mark.parametrize(("behind", "alike"), [(0.029, True), (0.032, False)])
def test_what_a_second_effect_does_is_no_allowance_among_single_ones(behind: float, alike: bool) -> None:
    """Either leaves little more than the pair does, less than a second effect must remove; but one leaves less."""
    plain, pair = made("", 0.05, gap=0.05), made("inertia stribeck", 0.02, gap=0.05)
    one, other = made("inertia", 0.028, gap=0.05), made("viscous", behind, gap=0.05)
    found = names(choice_of([plain, one, other, pair], plain))
    assert found == [("inertia",), *([("viscous",)] if alike else [])]


def test_two_effects_only_where_one_leaves_clearly_more() -> None:
    plain, one = made("", 0.31), made("inertia", 0.04)
    slightly, clearly = made("inertia stribeck", 0.0399), made("inertia stribeck", 0.011)
    assert names(choice_of([plain, one, slightly], plain)) == [("inertia",)]
    assert names(choice_of([plain, one, clearly], plain)) == [("inertia", "stribeck")]


@pytest.mark.parametrize(
    ("held", "expected"), [(0.05, ("inertia", "viscous")), (0.0602, ("inertia", "viscous")), (0.07, ("inertia",))]
)
def test_an_effect_with_which_held_out_runs_are_predicted_worse_is_none(held: float, expected: tuple[str, ...]) -> None:
    """Whatever it takes from the measured ones; within what an effect may correct it is no worse."""
    plain, one = made("", 0.2, 0.2), made("inertia", 0.06, 0.06, share=0.0)  # that acts on another channel
    both = made("inertia viscous", 0.02, held)
    assert names(choice_of([plain, one, both], plain)) == [expected]
    several = made("inertia viscous", 0.02, 0.07, effective=20.0)  # chance makes as much of so few samples
    few = [made("", 0.2, 0.2, effective=20.0), made("inertia", 0.06, 0.06, effective=20.0), several]
    assert choice_of(few, few[0]).best is several
    elsewhere = made("inertia viscous", 0.02, held, share=0.005)  # this channel is none of those that it changes
    assert choice_of([plain, one, elsewhere], plain).best is elsewhere


def test_the_allowance_of_a_second_effect_is_for_what_the_second_removes() -> None:
    plain, one = made("", 0.9), made("inertia", 0.1)
    best, rival = made("inertia stribeck", 0.031), made("inertia delay", 0.045)
    assert names(choice_of([plain, one, best, rival], plain)) == [("inertia", "stribeck")]
    assert indistinguishable(rival, best, plain)  # beside the whole gap the difference would be nothing


@pytest.mark.parametrize(("left", "rivals"), [(0.09, 2), (0.12, 1)])
def test_a_right_law_may_leave_something_but_no_wrong_one_then_leaves_next_to_nothing(left: float, rivals: int) -> None:
    plain = made("", 0.9)
    assert len(choice_of([plain, made("inertia", 0.03), made("creep", left)], plain).supported) == rivals


@pytest.mark.parametrize(("left", "expected"), [(0.05, ("thermal",)), (0.02, ("thermal", "wear"))])
def test_what_hides_behind_a_named_effect_must_leave_next_to_nothing(left: float, expected: tuple) -> None:
    plain, one, both = made("", 0.4), made("thermal", 0.1), made("thermal wear", left)
    assert names(choice_of([plain, one, both], plain)) == [expected]
    other = made("thermal inertia", left)  # does not hide behind it
    assert names(choice_of([plain, one, other], plain)) == [("thermal", "inertia")]


@pytest.mark.parametrize(("left_on_reference_runs", "alike"), [(0.08, True), (0.06, False)])
def test_of_two_that_leave_less_than_reference_runs_neither_is_the_better_one(
    left_on_reference_runs: float, alike: bool
) -> None:
    plain = made("", 0.14)
    best = made("inertia", 0.05, discrepancy=left_on_reference_runs, referenced=True)
    rival = made("viscous", 0.065, discrepancy=left_on_reference_runs, referenced=True)
    far = made("delay", 0.15, discrepancy=left_on_reference_runs, referenced=True)
    assert names(choice_of([plain, best, rival, far], plain)) == [("inertia",), *([("viscous",)] if alike else [])]


@pytest.mark.parametrize(("more", "alike"), [(1.2, True), (1.29, False)])
def test_each_parameter_more_must_pay(more: float, alike: bool) -> None:
    """Three of them 8 % each of the mean square that is left: a law that bends to the model's form is no better."""
    plain, best = made("", 0.035), made("acceleration_branches", 0.03, parameters=9)
    simple = made("inertia", 0.03 * np.sqrt(more), parameters=6)
    assert indistinguishable(simple, best, plain) is alike
    assert not indistinguishable(made("inertia", 0.03 * np.sqrt(1.2), parameters=9), best, plain)


def test_of_equals_the_one_that_needs_more_parameters_is_dropped() -> None:
    plain = made("", 0.31)
    few, many = made("inertia", 0.03, parameters=6), made("acceleration_branches", 0.03, parameters=9)
    assert dominated(many, few)
    assert not dominated(few, many)
    assert names(choice_of([plain, many, few], plain)) == [("inertia",)]
    hidden = made("creep", 0.03, parameters=9)
    assert not dominated(hidden, few)
    assert len(choice_of([plain, hidden, few], plain).supported) == 2  # a set: each hides behind the other
    much_less = made("inertia", 0.02, parameters=6)  # four ninths: alike or not, that is the one
    assert dominated(hidden, much_less)
    assert not dominated(hidden, made("inertia", 0.022, parameters=6))
    better = made("acceleration_branches", 0.0279, parameters=9)  # 15 % less, of which 12 may be its three parameters
    assert not dominated(better, few)
    assert len(choice_of([plain, better, few], plain).supported) == 2
    assert dominated(made("acceleration_branches", 0.0287, parameters=9), few)
    noisy = made("acceleration_branches", 0.0279, parameters=9, effective=120.0)
    assert dominated(noisy, made("inertia", 0.03, parameters=6, effective=120.0))  # six per cent more are noise


@pytest.mark.parametrize(("more", "as_little"), [(0.9, True), (1.1, False)])
@pytest.mark.parametrize("where", ["measured", "held out"])
def test_what_leaves_as_little_with_fewer_parameters_does_so_on_held_out_runs_too(
    more: float, as_little: bool, where: str
) -> None:
    """Refits end 0.2 % apart in mean square, noise makes 8 over the independent samples, each parameter bends 4 %."""
    rest = float(np.sqrt(1.0 + more * (CONVERGED_SHARE + DIFFERENCE_DEVIANCE / 5000.0 + 3 * 0.04)))
    measured, held = (rest, 1.0) if where == "measured" else (1.0, rest)
    many = made("acceleration_branches", 0.03, 0.04, parameters=9, effective=5000.0)
    few = made("inertia", 0.03 * measured, 0.04 * held, parameters=6, effective=5000.0)
    assert dominated(many, few) is as_little
    assert not dominated(few, many)


def test_a_delay_in_place_of_a_lag_is_not_the_lag_with_one_effect_more() -> None:
    """It predicts held-out runs worse than the lag does, and is told by the measured ones."""
    lag = replace(made("", 0.03, 0.03, nuisance_specs={"sensor_lag@F": 0.1}), nuisances=("sensor_lag@F",))
    delay = made("delay@F", 0.02, 0.035)
    plain = made("", 0.104, 0.104)
    assert set(names(choice_of([lag, delay], plain))) == {("sensor_lag@F",), ("delay@F",)}
    beside_it = replace(delay, nuisances=("sensor_lag@F",))
    assert names(choice_of([lag, beside_it], plain)) == [("sensor_lag@F",)]


@pytest.mark.parametrize(("left", "imitated"), [(0.9, True), (1.2, False)])
def test_what_an_answer_does_not_change_says_nothing_of_what_imitates_it(left: float, imitated: bool) -> None:
    """In the other channel the law that has lost its signature leaves twice as much: values of the model moved."""
    plain = made("", 0.05, 0.05)
    one = made("winding_crossover", 0.03, 0.04, parameters=9)
    other = made("stiffness_hardening", 0.03 * left, 0.04 * left, parameters=6)

    def both(h: Hypothesis, second: float) -> Hypothesis:
        def pair(x: Any) -> Any:
            return np.array([x[0], second * x[0]])

        fitted: Any = SimpleNamespace(**{**vars(h.fitted), "share_of": lambda _: np.array([0.1, 0.0])})
        more = {k: pair(getattr(h, k)) for k in ("measured", "held_out", "effective", "effective_held_out")}
        return replace(h, fitted=fitted, **more)

    one, other = both(one, 1.0), both(other, 2.0)
    other.__dict__["disguised"], one.__dict__["disguised"] = True, False
    assert not dominated(one, other)
    assert _imitates(one, [one, other], plain) is imitated
    other.__dict__["disguised"] = False
    assert not _imitates(one, [one, other], plain)
    same = replace(other, added=one.added)
    same.__dict__["disguised"] = True
    assert not _imitates(one, [one, same], plain), "it says that the same is missing"


@pytest.mark.parametrize(
    ("measured", "held_out", "imitated"),
    [(0.8, 0.8, True), (0.8, None, False), (0.8, 0.96, False), (0.96, 0.8, False), (1.1, 0.8, False)],
)
def test_what_a_law_of_another_kind_leaves_clearly_less_of_has_no_name(
    measured: float, held_out: float | None, imitated: bool
) -> None:
    """A law that has lost its signature, with three parameters more: 24 % of the mean square may be theirs."""
    held = None if held_out is None else 0.04 * held_out
    plain, one = made("", 0.05, 0.05), made("direction_asymmetry", 0.03, 0.04, parameters=6)
    other = made("drive_direction", 0.03 * measured, held, parameters=9)
    other.__dict__["disguised"] = True
    assert _imitates(one, [one, other], plain) is imitated
    other.__dict__["disguised"] = False
    assert not _imitates(one, [one, other], plain)


def test_a_correction_of_form_hides_behind_the_others_with_all_that_it_adds() -> None:
    """Wear hides behind thermal, inertia does not: the three are no correction of thermal alone."""
    plain, one = made("", 0.4), made("thermal", 0.1)
    three, two = made("thermal wear inertia", 0.05), made("thermal wear", 0.05)
    assert names(choice_of([plain, one, three], plain)) == [("thermal", "wear", "inertia")]
    assert names(choice_of([plain, one, two], plain)) == [("thermal",)]


@pytest.mark.parametrize(("lag", "alike"), [(0.3, True), (0.1, False)])
def test_what_a_freedom_removes_of_the_common_part_is_of_the_allowance(lag: float, alike: bool) -> None:
    """Both have inertia: what is left with it alone is 0.05, and what its lag removes, which neither of them has."""
    plain = made("", 0.9)
    common = made("inertia", 0.05, nuisance_specs={"sensor_lag@F": lag})
    best, rival = made("inertia stribeck", 0.031), made("inertia delay", float(np.sqrt(0.031**2 + 0.002)))
    removed = 0.05**2 + lag**2 - 0.031**2
    assert (0.002 < LAW_FORM_SHARE * removed + FIT_SPREAD_SHARE**2) is alike
    assert indistinguishable(rival, best, plain, [common]) is alike


def test_a_freedom_that_does_much_is_an_effect_as_any_other() -> None:
    plain = made("", 0.31, nuisance_specs={"sensor_lag@F": 0.02})
    with_lag = made("inertia", 0.03, nuisance_specs={"sensor_lag@F": 0.027})
    alone = made("creep", 0.0301)
    assert with_lag.effects == ("inertia", "sensor_lag@F")
    assert names(choice_of([plain, with_lag, alone], plain)) == [("creep",)]
    only_lag = made("", 0.03, nuisance_specs={"sensor_lag@F": 0.29})
    assert names(choice_of([only_lag], plain)) == [("sensor_lag@F",)]


@pytest.mark.parametrize(("alone", "without", "named"), [(0.02, 0.04, True), (0.0, 0.04, False), (0.0, 0.1, True)])
def test_a_freedom_that_does_something_beside_an_effect_alone_corrects_its_law(
    alone: float, without: float, named: bool
) -> None:
    """A channel that comes late does so without that effect too; what leaves next to nothing corrects nothing."""
    plain = made("", 0.31, nuisance_specs={"sensor_lag@F": alone} if alone else {})
    one = made("inertia", 0.03, nuisance_specs={"sensor_lag@F": 0.027})
    tested: Any = {"sensor_lag@F": (0.027, SimpleNamespace(rmse=np.array([without * SPREAD])))}
    one = replace(one, nuisance_tests=lambda: tested)
    assert names(choice_of([plain, one], plain)) == [("inertia", *(["sensor_lag@F"] if named else []))]


def test_the_shape_after_a_reversal_is_form_unless_it_is_much_and_not_in_reference_runs() -> None:
    assert made("", 0.03, nuisance_specs={"presliding_shape": 0.044}).effects == ()
    much = made("", 0.03, nuisance_specs={"presliding_shape": 0.046})
    assert much.effects == ("presliding_shape",)
    much = made("", 0.03, nuisance_specs={"presliding_shape": 0.046})
    much.fitted.task.reference_removal["presliding_shape"] = np.array([0.084 * SPREAD])  # pyright: ignore[reportIndexIssue]
    assert much.effects == ()
    assert much.has_large_nuisance  # it may stand for another effect all the same


def test_the_choice_does_not_hang_on_the_unit() -> None:
    for unit in (1.0, 2.3e-4, 8.1e5):
        plain = made("", 0.31, 0.3, unit=unit)
        rows = [
            ("inertia", 0.04, 0.0499),
            ("creep", 0.043, 0.049),
            ("delay", 0.1, 0.09),
            ("inertia viscous", 0.0399, 0.04985),
        ]
        found = choice_of([plain, *(made(a, m, h, unit=unit) for a, m, h in rows)], plain)
        assert names(found) == [("inertia",), ("creep",)]
        assert log_residual(found.best) == pytest.approx(
            np.mean([np.log(x**2 + FIT_SPREAD_SHARE**2) for x in (0.0399, 0.04985)])
        )


def screened(spec: str, gain: float) -> Any:
    attached = SimpleNamespace(module=effect_of(spec), spec=spec, channel=spec.partition("@")[2])
    return SimpleNamespace(attached=attached, gain=gain)


def test_what_is_far_behind_is_not_asked_what_its_nuisance_effects_do() -> None:
    """That takes refits: of one that leaves far more no answer to it changes the choice."""
    asked: list[str] = []

    def asks(one: Hypothesis, name: str) -> Hypothesis:
        return replace(one, nuisance_tests=lambda: asked.append(name) or {})

    plain, best = made("", 0.2, 0.2, gap=0.2), made("inertia", 0.01, 0.01, gap=0.2, parameters=7)
    behind = asks(made("viscous", 0.15, 0.15, gap=0.2, parameters=5), "behind")
    near = asks(made("stribeck", 0.0101, 0.0101, gap=0.2, parameters=7), "near")
    every = [plain, best, behind, near]
    assert names(choice_of(every, plain)) == [("inertia",), ("stribeck",)]
    assert leading(every) is best
    assert not _imitates(best, [plain, behind], plain)
    assert set(asked) == {"near"}


def test_what_hides_behind_one_of_the_best_is_refitted_to_the_end_too() -> None:
    """The first steps leave a law with more shapes farther behind than its look-alike."""
    left = {"temperature_dependence": 0.02, "wear": 0.03, "thermal": 0.035, "viscous": 0.035, "creep": 0.02}
    tried = [(screened(spec, 1.0), made(spec, rmse).fitted) for spec, rmse in left.items()]
    tried.append((screened("load_dependence", 1.0), made("load_dependence", 0.05).fitted))
    near, behind = _near_the_best([*tried, None], 2.0)
    assert [s.attached.spec for s, _ in near] == ["temperature_dependence", "wear", "thermal", "creep"]
    assert [s.attached.spec for s, _ in behind] == ["viscous", "load_dependence"]


def test_shortlist_takes_an_effect_at_two_places_at_most() -> None:
    rows = [
        ("sensor_lag@a", 0.9), ("sensor_lag@b", 0.8), ("sensor_lag@c", 0.7), ("inertia", 0.6), ("creep", 0.3),
        ("delay", 0.0),
    ]  # fmt: skip
    ranked = [screened(*row) for row in rows]
    assert [s.attached.spec for s in shortlist(ranked)] == ["sensor_lag@a", "sensor_lag@b", "inertia", "creep"]
    assert [s.attached.spec for s in shortlist(ranked, most=3)] == ["sensor_lag@a", "sensor_lag@b", "inertia"]
    both = interleaved(ranked[:3], [ranked[2], ranked[0], ranked[1]])
    assert [s.attached.spec for s in both] == ["sensor_lag@a", "sensor_lag@c", "sensor_lag@b"]
