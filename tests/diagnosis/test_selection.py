"""Answers that no effect is named of, whatever it leaves: laws that mislead, and sums of laws of one coordinate."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.test_choice import SPREAD, made
from tsm_fmu.diagnosis.choice.near import hidden_near, rivals
from tsm_fmu.diagnosis.choice.selection import (
    _any_law_of_a_coordinate,
    _far_ahead,
    _misleads,
    _predicting,
    _without_any_laws,
)
from tsm_fmu.diagnosis.choice.supported import Choice
from tsm_fmu.effects import effect_of, starts_of

NOTHING, SOMETHING = np.array([False]), np.array([True])
"""Open of what is left."""


def leaves(
    held_out: list[float], effects: tuple[str, ...] = ("inertia",), acts: tuple[bool, bool] = (True, True)
) -> Any:
    errors = [np.tile(held_out, (7, 1)), -np.tile(held_out, (5, 1))]
    fitted = SimpleNamespace(spread=np.array([2.0, 0.3]), held_out_errors=lambda _: errors)
    return SimpleNamespace(effects=effects, fitted=fitted, acts=np.array(acts) & bool(effects))


@pytest.mark.parametrize(
    ("after", "misleads"),
    [
        ([0.2, 0.0105], False), ([0.129, 0.0105], False), ([0.131, 0.0105], True),
        ([0.1, 0.0131], True), ([0.1, 0.0129], False),
        ([0.02, 0.003], False),
    ],
)  # fmt: skip
def test_effects_with_which_held_out_runs_are_predicted_worse_mislead(after: list[float], misleads: bool) -> None:
    """By more than a ratio, in any channel they change, and by more than a gap: 1.2 % of the spread."""
    before = leaves([0.1 if after[0] != 0.2 else 0.19, 0.01], ())
    assert _misleads(leaves(after), before, [object()], 1.3) is misleads  # pyright: ignore[reportArgumentType]
    assert not _misleads(leaves(after, ()), before, [object()], 1.3)  # pyright: ignore[reportArgumentType]
    elsewhere = leaves(after, acts=(after[0] < 0.13, after[1] < 0.013))
    assert not _misleads(elsewhere, before, [object()], 1.3)  # pyright: ignore[reportArgumentType]


def test_a_small_error_that_doubles_misleads_nobody() -> None:
    assert not _misleads(leaves([0.023, 0.0035]), leaves([0.01, 0.001], ()), [object()], 1.1)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("whole", "left", "beside", "found"),
    [
        (0.109, 0.0301, 0.1, "same"), (0.111, 0.0301, 0.099, "beside"),  # by a tenth more than without the effect
        (0.31, 0.04, 0.099, "beside"), (0.31, 0.04, 0.101, ""),  # no more than without it
        (0.31, 0.042, 0.09, "beside"), (0.31, 0.044, 0.09, ""),  # twice the mean square of the measured runs
    ],
)  # fmt: skip
def test_an_effect_may_predict_beside_the_values_of_the_model_without_it(
    whole: float, left: float, beside: float, found: str
) -> None:
    plain, one, refitted = made("", 0.09, 0.09), made("inertia", 0.0301, 0.07), made("", 0.1, 0.1)
    vars(refitted.fitted)["held_out_errors"] = lambda _: [np.full((5, 1), 0.1 * SPREAD)]
    other: Any = SimpleNamespace(**vars(one.fitted), held_out_errors=lambda _: [np.full((5, 1), beside * SPREAD)])
    other.rmse = np.array([left * SPREAD])
    vars(one.fitted).update(
        held_out_errors=lambda _: [np.full((5, 1), whole * SPREAD)],
        lent_by=lambda fitted, effects: {(id(plain.fitted), ("inertia",)): other}[id(fitted), effects],
    )
    predicting = _predicting(one, plain, refitted, [object()])  # pyright: ignore[reportArgumentType]
    if found == "beside":
        assert predicting is not None
        assert (predicting.fitted, predicting.effects, predicting.held_out) == (other, one.effects, one.held_out)
        assert predicting.measured == pytest.approx(other.rmse**2)
    else:
        assert predicting is (one if found else None)


@pytest.mark.parametrize(("whole", "sound"), [(0.149, True), (0.151, False)])
def test_of_a_run_that_was_not_fitted_the_state_of_an_effect_is_not_known(whole: float, sound: bool) -> None:
    """Wear and warmth may leave by half more of held-out runs."""
    plain, one, refitted = made("", 0.09, 0.09), made("wear", 0.0301, 0.07), made("", 0.1, 0.1)
    (start,) = starts_of(effect_of("wear"))
    vars(one.fitted.problem).update(per_run=("start",), declared={"start": SimpleNamespace(name=f"wear.{start}")})
    for h, left in ((one, whole), (refitted, 0.1)):
        vars(h.fitted)["held_out_errors"] = lambda _, left=left: [np.full((5, 1), left * SPREAD)]
    vars(one.fitted)["lent_by"] = lambda *_: SimpleNamespace(rmse=np.array([9.0 * SPREAD]))
    predicting = _predicting(one, plain, refitted, [object()])  # pyright: ignore[reportArgumentType]
    assert predicting is (one if sound else None)


@pytest.mark.parametrize(
    ("effects", "any_law"),
    [
        (("stiffness_hardening", "drum_periodic"), True), (("thermal", "offset_drift"), True),
        (("stiffness_hardening@x_out", "drum_periodic"), False), (("thermal", "drum_periodic"), False),
        (("tendon_elasticity@x_out", "slack@x_out"), False), (("wear~x[m]",), False), ((), False),
        (("inertia", "wear~x[m]", "thermal"), True),
    ],
)  # fmt: skip
def test_two_laws_of_one_coordinate_at_one_place_are_any_law_of_it(effects: tuple[str, ...], any_law: bool) -> None:
    assert _any_law_of_a_coordinate(effects) is any_law


def test_a_sum_that_is_any_law_of_a_coordinate_stands_beside_no_other() -> None:
    one, other = made("drum_periodic inertia", 0.042), made("drum_periodic delay@F", 0.042)
    anything = made("drum_periodic stiffness_hardening", 0.039)
    assert _without_any_laws(Choice(anything, (anything, one, other))) == Choice(anything, (one, other))
    assert _without_any_laws(Choice(anything, (anything,))) == Choice(anything, (anything,))


@pytest.mark.parametrize(
    ("left", "held", "rivals", "ahead"),
    [
        (0.033, 0.085, (0.081, 0.117), True),
        (0.033, 0.085, (0.04, 0.097), False),  # the mean of the log mean squares is less than twice as much
        (0.0843, 0.06, (0.119, 0.119), True),  # of the measured runs' gap it leaves half
        (0.0855, 0.06, (0.119, 0.119), False),
        (0.033, 0.104, (0.119, 0.119), False),  # of other runs a third of what is left is removed
        (0.033, None, (0.119, 0.119), False),  # nothing to judge by
    ],
)
def test_an_effect_is_there_that_no_other_comes_near_though_something_is_left(
    left: float, held: float | None, rivals: tuple[float, float], ahead: bool
) -> None:
    plain, one, other = made("", 0.12, 0.12 if held else None), made("inertia", left, held), made("viscous", *rivals)
    both = made("inertia viscous", 0.9 * left, held)  # a rival must be one without it
    alike = made("creep", 1.01 * left, held)
    assert _far_ahead(Choice(one, (one,)), [plain, one, other, both], None, NOTHING).tolist() == [ahead]
    assert not _far_ahead(Choice(one, (one, other)), [plain, one, other], None, NOTHING).any()
    assert _far_ahead(Choice(one, (one, alike)), [plain, one, alike, other], None, NOTHING).tolist() == [ahead]  # a set
    near = made("creep", 1.3 * left, held)  # which is worse and hides behind it
    assert _far_ahead(Choice(one, (one,)), [plain, one, near, other], None, NOTHING).tolist() == [ahead]
    assert not _far_ahead(Choice(plain, (plain,)), [plain, one, other], None, NOTHING).any()
    assert not _far_ahead(Choice(both, (both,)), [plain, other, both], None, NOTHING).any()  # a sum of laws
    assert not _far_ahead(Choice(one, (one,)), [one, both], None, NOTHING).any()  # all have it: nothing shows its lead
    floor: Any = SimpleNamespace(rmse=one.fitted.spread * 0.05)  # on reference runs: no effect takes it
    assert _far_ahead(Choice(one, (one,)), [plain, one, other], floor, NOTHING).tolist() == [ahead or left == 0.0855]
    above: Any = SimpleNamespace(rmse=one.fitted.spread * 0.13)  # no gap there, that a name could close
    assert not _far_ahead(Choice(one, (one,)), [plain, one, other], above, NOTHING).any()
    aside = made("inertia", left, held, share=0.0059)  # it does not act on this channel
    assert not _far_ahead(Choice(aside, (aside,)), [plain, aside, other], None, NOTHING).any()


@pytest.mark.parametrize(
    ("left", "held", "rivals", "alike", "ahead"),
    [
        (0.111, 0.037, (0.119, 0.119), False, True),
        (0.111, 0.037, (0.111, 0.055), False, False),  # another one comes near
        (0.111, 0.037, (0.111, 0.055), True, True),  # which hides behind it
        (0.111, 0.055, (0.119, 0.119), False, False),  # of the gap of other runs more than a fifth is left
        (0.1199, 0.037, (0.119, 0.119), False, False),  # of that of the measured runs nothing is removed
    ],
)
def test_an_effect_is_there_that_alone_predicts_runs_it_was_not_fitted_to(
    left: float, held: float, rivals: tuple[float, float], alike: bool, ahead: bool
) -> None:
    plain, one = made("", 0.12, 0.12), made("wear", left, held)
    other = made("thermal" if alike else "inertia", *rivals)
    assert _far_ahead(Choice(one, (one,)), [plain, one, other], None, NOTHING).tolist() == [ahead]
    if alike:  # a set
        assert _far_ahead(Choice(one, (one, other)), [plain, one, other], None, NOTHING).tolist() == [True]


@pytest.mark.parametrize(
    ("second", "share", "ahead"),
    [
        ("thermal", 0.69, False),  # two laws of time, and much less is left: any law of it
        ("thermal", 0.72, True),  # not that much
        ("stribeck", 0.5, True),  # one of the speed beside it is no law of the same
    ],
)
def test_a_law_that_another_one_of_the_same_coordinate_mends_is_not_ahead(
    second: str, share: float, ahead: bool
) -> None:
    plain, one = made("", 0.12, 0.12), made("wear", 0.06, 0.07)
    both, other = made(f"wear {second}", 0.06 * share, 0.069), made("inertia", 0.119, 0.119)
    assert _far_ahead(Choice(one, (one,)), [plain, one, both, other], None, NOTHING).tolist() == [ahead]


@pytest.mark.parametrize(
    ("left", "held", "ahead"),
    [
        (0.022, 0.11, True),  # of other runs a fifth is removed: the rest may be the form of the model
        (0.022, 0.12, False),  # nothing
        (0.026, 0.11, False),  # what is left of the measured runs may be another effect
        (0.026, 0.1, True),  # of others a notable part is removed
    ],
)
def test_what_is_left_of_other_motions_takes_no_name_away_where_next_to_nothing_is_left_of_the_measured(
    left: float, held: float, ahead: bool
) -> None:
    plain, one, other = made("", 0.12, 0.12), made("inertia", left, held), made("viscous", 0.119, 0.12)
    assert _far_ahead(Choice(one, (one,)), [plain, one, other], None, NOTHING).tolist() == [ahead]


@pytest.mark.parametrize(
    ("left", "held", "ahead"), [(0.0211, 0.0631, True), (0.0211, 0.0635, False), (0.0151, 0.0525, True)]
)
def test_what_is_open_and_three_times_as_much_of_other_motions_takes_the_name_away(
    left: float, held: float, ahead: bool
) -> None:
    """Unless of the gap of those next to nothing is left."""
    plain, one, other = made("", 0.12, 0.12), made("inertia", left, held), made("viscous", 0.119, 0.119)
    assert _far_ahead(Choice(one, (one,)), [plain, one, other], None, NOTHING).tolist() == [True]
    assert _far_ahead(Choice(one, (one,)), [plain, one, other], None, SOMETHING).tolist() == [ahead]


@pytest.mark.parametrize(("gap", "ahead"), [(0.0152, True), (0.0148, False)])
def test_what_removes_less_than_a_gap_is_not_ahead_for_leaving_little(gap: float, ahead: bool) -> None:
    """By 1.2 % of the spread: sqrt(0.0152^2 - 0.009^2) is more, sqrt(0.0148^2 - 0.009^2) less."""
    plain, one, other = made("", gap, 0.05), made("inertia", 0.009, 0.049), made("viscous", gap, 0.05)
    assert _far_ahead(Choice(one, (one,)), [plain, one, other], None, NOTHING).tolist() == [ahead]


@pytest.mark.parametrize(
    ("rival", "ahead"),
    [
        ((0.04, 0.1), True),  # of other runs it leaves as much
        ((0.04, 0.098), False),  # less
        ((0.03, 0.11), False),  # less than twice as much of the measured ones, and on the average
    ],
)
def test_a_rival_that_leaves_twice_as_much_of_the_measured_runs_and_no_less_of_others_is_far(
    rival: tuple[float, float], ahead: bool
) -> None:
    plain, one, other = made("", 0.12, 0.12), made("inertia", 0.022, 0.1), made("viscous", *rival)
    assert _far_ahead(Choice(one, (one,)), [plain, one, other], None, NOTHING).tolist() == [ahead]


def test_an_effect_is_no_rival_of_itself_whatever_drives_it() -> None:
    plain, other = made("", 0.12, 0.12), made("viscous", 0.119, 0.119)
    one, again = made("load_dependence~T_in[N]", 0.05, 0.06), made("load_dependence", 0.0501, 0.0601)
    one.__dict__["disguised"] = again.__dict__["disguised"] = False
    assert _far_ahead(Choice(one, (one, again)), [plain, one, again, other], None, NOTHING).tolist() == [True]
    elsewhere = made("viscous", 0.0501, 0.0601)
    assert not _far_ahead(Choice(one, (one, elsewhere)), [plain, one, elsewhere, other], None, NOTHING).any()


@pytest.mark.parametrize(("behind", "told_apart"), [(1.3, False), (1.5, True)])
def test_what_hides_behind_a_law_that_is_not_quite_the_rigs_is_in_a_set_with_it(
    behind: float, told_apart: bool
) -> None:
    """Unless it leaves twice the mean square: which of two laws that are not there comes nearer says little."""
    plain, one = made("", 0.12, 0.12), made("drum_periodic", 0.05, 0.06)
    alike, other = made("stiffness_hardening", 0.05 * behind, 0.06 * behind), made("viscous", 0.06, 0.07)
    with_more = made("stiffness_hardening inertia", 0.05, 0.06)
    lost = made("stiffness_hardening@F", 0.05, 0.06)
    lost.__dict__["disguised"] = True
    found = hidden_near(Choice(one, (one,)), [plain, one, alike, other, with_more, lost])
    assert [h.effects for h in found] == ([] if told_apart else [("stiffness_hardening",)])
    assert hidden_near(Choice(one, (one, alike)), [plain, one, alike]) == []  # there already


@pytest.mark.parametrize(
    ("left", "held", "parameters", "there"),
    [
        (0.05, 0.06, 5, True), (0.05, 0.06, 4, True), (0.05, 0.06, 6, False),  # each parameter more must have paid
        (0.067, 0.067, 5, True), (0.0712, 0.0712, 5, False),  # three times the mean square: 0.06928
        (0.05, 0.0863, 5, True), (0.03, 0.0867, 5, False),  # half of what it closes of held-out runs: 0.08654
    ],
)  # fmt: skip
def test_what_comes_near_an_answer_with_no_more_parameters_is_in_a_set_with_it(
    left: float, held: float, parameters: int, there: bool
) -> None:
    plain, one = made("", 0.12, 0.1155), made("acceleration_branches", 0.04, 0.04)
    other = made("inertia", left, held, parameters=parameters)
    lost, pair = made("creep", 0.041, 0.041), made("inertia viscous", 0.041, 0.041)
    for h in (one, other, pair):
        h.__dict__["disguised"] = False
    lost.__dict__["disguised"] = True
    found = rivals(Choice(one, (one,)), [plain, one, other, lost, pair], None)
    assert [h.effects for h in found] == ([("inertia",)] if there else [])
    assert rivals(Choice(one, (one, other)), [plain, one, other, lost, pair], None) == []  # there already
    assert (
        rivals(Choice(plain, (plain,)), [plain, one, other], None) == []
    )  # no effect that another could be instead of


@pytest.mark.parametrize(("floor", "there"), [(0.0299, True), (0.0315, False)])
def test_an_answer_that_leaves_what_reference_runs_do_has_no_rivals(floor: float, there: bool) -> None:
    """Up to 1.3 times as much: its law is that of the rig."""
    plain, one, other = made("", 0.12, 0.12), made("wear", 0.04, 0.04), made("thermal", 0.05, 0.05)
    other.__dict__["disguised"] = False
    reference: Any = SimpleNamespace(rmse=np.array([floor * SPREAD]))
    assert bool(rivals(Choice(one, (one,)), [plain, one, other], reference)) is there


def test_a_rival_of_one_channel_closes_half_of_each() -> None:
    """What takes the gap of a torque and leaves that of a position is none of an answer that closes both."""

    def two(added: str, torque: float, position: float) -> Any:
        one, each = made(added, torque, torque), np.array([torque * SPREAD, position]) ** 2
        vars(one.fitted).update(spread=np.array([SPREAD, 1.0]), rmse=np.sqrt(each), share_of=lambda _: np.full(2, 0.1))
        return replace(one, measured=each, held_out=each, effective=np.full(2, 1e5), effective_held_out=np.full(2, 1e5))

    plain, one = two("", 0.1, 0.1), two("wear", 0.05, 0.05)
    both, torque = two("thermal", 0.06, 0.06), two("viscous", 0.04, 0.099)
    for h in (one, both, torque):
        h.__dict__["disguised"] = False
    assert [h.effects for h in rivals(Choice(one, (one,)), [plain, one, both, torque], None)] == [("thermal",)]
