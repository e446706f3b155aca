"""What is not named although it closes the gap: laws without their signature, and those that do not carry over."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.conftest import exponential
from tests.diagnosis.test_choice import made
from tsm_fmu.diagnosis.choice.floors import _above_references, _lost_elsewhere, shown_elsewhere
from tsm_fmu.diagnosis.choice.supported import choice_of
from tsm_fmu.diagnosis.fits.disguise import disguised
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

LIMITS = {
    "wear.L": (0.31, 47.0), "breakaway_ageing.theta_0": (0.066, 83.0), "breakaway_ageing.L_0": (1e-4, 0.3),
    "x_out.creep.tau": (0.07, 91.0), "thermal.v_0": (0.01, 0.4), "viscous.p": (0.125, 4.0),
}  # fmt: skip


def fit(moved: float = 0.083, **values: float) -> Any:
    """A fit whose law moves a channel by 0.17 of its spread, and by `moved` where its time is another one."""
    named = {name.replace("__", "."): value for name, value in values.items()}
    return SimpleNamespace(
        task=SimpleNamespace(limits=LIMITS), values=named, model="TendonDrive",
        share_of=lambda spec: np.array([0.17, 0.0]), change_with=lambda fields: np.array([moved, 0.0]),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("spec", "values", "expected"),
    [
        ("wear", {"wear__L": 0.31}, True),  # over at once: a start-up
        ("wear", {"wear__L": 0.33}, False),
        ("wear", {"wear__L": 47.0}, False),  # straight over the log, and wear all the same
        ("breakaway_ageing", {"breakaway_ageing__theta_0": 0.06601}, True),  # a step after each rest
        ("breakaway_ageing", {"breakaway_ageing__theta_0": 82.99}, True),  # a straight line in disguise
        ("breakaway_ageing", {"breakaway_ageing__theta_0": 1.3}, False),
        ("breakaway_ageing", {"breakaway_ageing__theta_0": 1.3, "breakaway_ageing__L_0": 1e-4}, False),  # no time
        ("creep@x_out", {"x_out__creep__tau": 0.07}, True),
        ("creep@x_out", {"x_out__creep__tau": 5.0}, False),
        ("viscous", {"viscous__p": 0.12501}, True),  # next to constant: Coulomb's
        ("viscous", {"viscous__p": 3.97}, True),  # nothing, and then a wall
        ("viscous", {"viscous__p": 0.14}, False),
        ("thermal", {"thermal__v_0": 0.01, "thermal__tau": 3.0}, False),  # a speed, and a time without a range
        ("inertia", {}, False),
    ],
)
def test_a_law_at_the_end_of_its_range_of_time_or_travel_is_another_one(
    spec: str, values: dict[str, float], expected: bool
) -> None:
    everywhere = {name.replace(".", "__"): 1.0 for name in LIMITS}
    assert disguised(fit(**{**everywhere, **values}), spec) is expected


@pytest.mark.parametrize(("moved", "expected"), [(0.0033, True), (0.0035, False)])
def test_a_law_of_time_that_does_the_same_at_the_end_of_its_range_is_another_one(moved: float, expected: bool) -> None:
    everywhere = {name.replace(".", "__"): 1.0 for name in LIMITS}
    assert disguised(fit(moved, **everywhere), "creep@x_out") is expected
    assert not disguised(fit(moved, **everywhere), "wear"), "a travel"


@pytest.mark.parametrize(("moved", "expected"), [(0.0033, False), (0.0035, True)])
def test_an_exponent_that_does_nothing_may_be_anywhere(moved: float, expected: bool) -> None:
    """Friction that is linear in the speed has no power term."""
    assert disguised(fit(moved, viscous__p=0.125), "viscous") is expected


@pytest.mark.parametrize(("moved", "expected"), [(0.0033, False), (0.0035, True)])
def test_the_travel_of_running_in_that_there_is_none_of_may_be_anywhere(moved: float, expected: bool) -> None:
    """Steady wear alone."""
    assert disguised(fit(moved, wear__L=0.31), "wear") is expected


@pytest.mark.parametrize(("theta_0", "expected"), [(0.066, "inertia"), (1.7, "breakaway_ageing")])
def test_a_disguised_law_is_no_candidate_however_little_it_leaves(theta_0: float, expected: str) -> None:
    plain, other, sound = made("", 0.31), made("breakaway_ageing", 0.02), made("inertia", 0.09)
    vars(other.fitted).update(model="TendonDrive", change_with=lambda fields: np.array([0.03]))
    vars(other.fitted)["task"] = replace(other.fitted.task, limits=LIMITS)
    vars(other.fitted)["values"] = {"breakaway_ageing.theta_0": theta_0, "breakaway_ageing.L_0": 0.01}
    assert [h.effects for h in choice_of([plain, other, sound], plain).supported] == [(expected,)]
    assert choice_of([plain, other], plain).winner is (plain if expected == "inertia" else other)


@pytest.mark.parametrize(
    ("measured", "held", "reference", "shown"),
    [
        (0.013, 0.0525, None, True), (0.013, 0.0515, None, False),  # four times
        (0.011, 0.0505, None, True), (0.011, 0.0495, None, False),  # five hundredths of the spread
        (0.013, 0.0525, 0.0135, False), (0.013, 0.0545, 0.0135, True),  # reference runs show as much of the form
    ],
)  # fmt: skip
def test_a_gap_of_held_out_runs_alone(measured: float, held: float, reference: float | None, shown: bool) -> None:
    plain = made("", measured, held)
    known: Any = None if reference is None else SimpleNamespace(rmse=np.array([reference * 3.7]))
    assert shown_elsewhere(plain, known).tolist() == [shown]
    assert not shown_elsewhere(replace(plain, folded=True), known).any(), "measured runs left out in turn"
    assert not shown_elsewhere(made("inertia", measured, held), known).any(), "an effect that is missing"
    assert not shown_elsewhere(made("", measured), known).any(), "nothing held out"


@pytest.mark.parametrize(
    ("measured", "held", "reference", "missing"),
    [
        (0.0061, 0.0075, 0.002, True), (0.0061, 0.0075, 0.00204, False), (0.0075, 0.0061, 0.00204, False),  # thrice
        (0.0045, 0.0076, 0.001, True), (0.0045, 0.0067, 0.001, False),  # in all what names an effect
        (0.0061, 0.0075, None, False),
    ],
)  # fmt: skip
def test_far_more_than_reference_runs_show_is_no_form_of_the_model(
    measured: float, held: float, reference: float | None, missing: bool
) -> None:
    plain = made("", measured, held)
    known: Any = None if reference is None else SimpleNamespace(rmse=np.array([reference * 3.7]))
    assert _above_references(plain, known).tolist() == [missing]
    coarse = made("", measured, held, steps=0.0059)
    assert not _above_references(coarse, known).any(), "the steps of a converter"
    assert not _above_references(made("inertia", measured, held), known).any(), "an effect that is missing"
    assert not _above_references(made("", measured), known).any(), "nothing held out"


NOISE = 0.011


@pytest.mark.parametrize(("share", "lost"), [(0.19, False), (0.21, True), (0.0, False), (0.9, True)])
def test_a_law_carries_over_where_it_closes_four_fifths_of_the_gap_of_held_out_runs(share: float, lost: bool) -> None:
    gap, unit = 0.083, 3.7  # above the noise, of the spread
    plain = made("", 0.12, float(np.hypot(gap, NOISE)))
    one = made("inertia", 0.02, float(np.sqrt(share * gap**2 + NOISE**2)))
    assert _lost_elsewhere(one, plain, np.array([NOISE * unit])).tolist() == [lost]


def test_nothing_is_lost_where_held_out_runs_show_no_gap_nothing_acts_or_nothing_is_held_out() -> None:
    noise = np.array([NOISE * 3.7])
    plain, one = made("", 0.12, 1.2 * NOISE), made("inertia", 0.02, 1.19 * NOISE)
    assert not _lost_elsewhere(one, plain, noise).any()
    still = made("inertia", 0.1199, 0.09)  # on this channel it does nothing
    assert not _lost_elsewhere(still, made("", 0.12, 0.09), noise).any()
    other = made("inertia", 0.02, 0.09, share=0.0059)  # what other parameters do is not judged
    assert not _lost_elsewhere(other, made("", 0.12, 0.09), noise).any()
    assert _lost_elsewhere(made("inertia", 0.02, 0.09, share=0.0061), made("", 0.12, 0.09), noise).all()
    assert not _lost_elsewhere(made("inertia", 0.02), made("", 0.12), noise).any()
    assert not _lost_elsewhere(made("", 0.02, 0.09), made("", 0.12, 0.1), noise).any()  # no effect: nothing is named


def test_a_stop_that_only_held_out_runs_reach_is_unknown_and_a_law_of_the_position() -> None:
    records = []
    for number, size in enumerate((0.5, 0.5, 1.0)):
        rng, t = np.random.default_rng(600 + number), np.arange(2400) * 0.01
        x = size * (0.05 * np.sin(2.3 * t + 0.4 * number) + 0.03 * np.sin(5.9 * t + number))
        v = np.gradient(x, 0.01)
        stop = 19.0 * np.maximum(np.abs(x) - 0.045, 0.0) * np.sign(x)
        force = 0.7 * exponential(x, 0.0047) + 0.3 * v + stop + 0.004 * rng.standard_normal(t.size)
        records.append(Record(f"run {number}", t, {"v": v, "F": force}, {"v": "m/s", "F": "N"}))
    given = {"F_c": 0.7, "F_s": 0.71, "v_s": 0.01, "sigma0": 150.0, "sigma1": 0.3, "sigma2": 0.3}
    one = diagnose(kernel("LuGreFriction"), records[:2], holdout=records[2:], values=given)
    assert (one.verdict, one.effects, one.family) == ("unknown", (), ("position",))
    assert one.gap["F"].elsewhere
    assert one.family_evidence[0].share > 0.9
    assert one.answer.startswith("Only the held-out runs show what F lacks")
    within = diagnose(kernel("LuGreFriction"), records[:1], holdout=records[1:2], values=given)
    assert within.verdict in ("none", "parameters")
    assert not within.gap["F"].elsewhere
