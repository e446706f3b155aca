"""The sentence on top of the report, for each verdict, from numbers made up here."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tsm_fmu.diagnosis.answer.sentence import answer, best_wrong, leading_channel, place_text
from tsm_fmu.diagnosis.evidence import (
    Candidate,
    ChannelError,
    FamilyShare,
    Formula,
    Gap,
    Gate,
    ModelFit,
    ParameterChange,
    Place,
    ResidualShape,
)
from tsm_fmu.diagnosis.result import Diagnosis

AFTER = Place("tau_in", "distance since reversal", "rad", (0.001, 0.1396), 0.714, 0.22, 0.6, 0.05, 1e-6, True)
BAND = Place("tau_in", "frequency", "Hz", (0.2, 0.8), 0.95, 0.4, 0.7, 0.05, 1e-6, True)
WEAK = Place("tau_in", "load", "N.m", (0.1, 0.2), 0.99, 0.5, 0.12, 0.08, 1e-3, True)


def gap(**changes: Any) -> dict[str, Gap]:
    values: dict[str, Any] = {
        "unit": "N.m", "before": 0.0131, "after": 0.0024, "holdout_before": 0.0121, "holdout_after": 0.0023,
        "floor": 0.0019, "floor_least": 0.0019, "closure": 0.93, "closure_least": 0.93,
        "closure_interval": None, "refitted": 0.0122, "holdout_refitted": 0.0120,
        "fmu": None,
    }  # fmt: skip
    quiet = Gap("rad", 0.003, 0.003, 0.0031, 0.0031, 0.003, 0.003, None, None, None, 0.003, 0.0031, None)
    return {"x_out": quiet, "tau_in": Gap(**{**values, **changes})}


def found(verdict: str, **more: Any) -> Diagnosis:
    values: dict[str, Any] = {
        "where": (WEAK, BAND, AFTER), "channels": ("x_out", "tau_in"), "gap": gap(),
    }  # fmt: skip
    return Diagnosis(verdict, **{**values, **more})


def candidate(spec: str, closure: float, misfit: float = 1.0, testable: bool = True) -> Candidate:
    channels = {"tau_in": ChannelError(0.01, (closure, closure))}
    return Candidate(spec, 3.0, closure, None, {}, {}, channels, misfit, testable)


def test_named_is_the_sentence_of_the_specification() -> None:
    said = answer(found("named", effects=("load_dependence",)))
    assert said == (
        "71 % of the disagreement of tau_in lies within 8 deg after reversals (22 % of the samples); load-dependent "
        "friction explains 93 % of it; held-out error of tau_in 12.1 -> 2.3 mN.m, floor 1.9 mN.m."
    )


@pytest.mark.parametrize(("closure", "said"), [(0.81, False), (0.79, True), (0.02, True), (-0.1, False), (None, False)])
def test_of_a_gap_that_is_closed_in_part_it_is_said_that_the_law_may_be_another(closure, said: bool) -> None:
    """A name is given at half of a gap where no other effect comes near: who reads it must know."""
    sentence = "Part of it is left: the law of the rig is not quite the one that is named, or more is missing."
    of = gap(closure=closure, closure_least=closure)
    assert (sentence in answer(found("named", effects=("inertia",), gap=of))) is said
    alike = found("ambiguous", equivalent=(("thermal", "wear"),), gap=of)
    assert (sentence in answer(alike)) is said
    assert sentence not in answer(found("unknown", gap=of))


def test_a_gap_of_held_out_runs_alone_is_said_without_places_and_candidates_of_the_measured_ones() -> None:
    of = gap(holdout_before=0.0314, holdout_refitted=0.0293, holdout_after=0.0293, unexplained=True, elsewhere=True)
    evidence = (FamilyShare("position", "tau_in", 0.62),)
    one = found(
        "unknown", gap=of, candidates=(candidate("inertia", 0.4),), family=("position",), family_evidence=evidence
    )
    assert answer(one) == (
        "Only the held-out runs show what tau_in lacks, and no values that the measured runs allow close it; held-out "
        "error of tau_in 31.4 -> 29.3 mN.m, floor 1.9 mN.m, on the measured runs 2.4 mN.m. Give runs with both motions "
        "to --measured. What is missing there is a law of the position (such laws predict 62 % of it)."
    )


def test_a_floor_that_is_what_the_best_model_leaves_is_a_range() -> None:
    said = answer(
        found("named", effects=("load_dependence",), where=(), gap=gap(floor_least=0.0004, closure_least=0.887))
    )
    assert said == (
        "Load-dependent friction explains 89 to 93 % of the disagreement of tau_in; held-out error of tau_in "
        "12.1 -> 2.3 mN.m, floor 0.4 to 1.9 mN.m."
    )
    said = answer(
        found("named", effects=("inertia",), where=(), gap=gap(floor_least=0.0004, closure=1.0, closure_least=0.6))
    )
    assert said.startswith("Inertia explains 60 % to all of the disagreement of tau_in; ")


def test_two_names_without_a_place_and_what_the_refit_did() -> None:
    said = answer(found("named", effects=("inertia", "backlash@x_out"), where=(), gap=gap(holdout_refitted=0.0071)))
    assert said == (
        "Inertia and backlash in x_out explain 93 % of the disagreement of tau_in; held-out error of tau_in "
        "12.1 -> 2.3 mN.m (7.1 by a refit alone), floor 1.9 mN.m."
    )


def test_without_held_out_runs_the_measured_ones_count() -> None:
    said = answer(found("none", where=(), gap=gap(holdout_before=None, holdout_after=None, holdout_refitted=None)))
    assert said == (
        "No effect named. No gap above the floor. Error of tau_in 13.1 -> 2.4 mN.m (12.2 by a refit alone), floor "
        "1.9 mN.m."
    )


def test_where_nothing_is_named_what_is_left_over_the_motion_and_what_was_not_testable_is_said() -> None:
    levels = {"holdout_before": 0.0031, "holdout_after": 0.0031, "holdout_refitted": 0.003}
    part = replace(AFTER, rms=0.0011)
    few = {"where": (WEAK, part, replace(part, coordinate="x", rms=0.0019)), "not_excited": ("wear", "delay", "slack")}
    said = answer(found("none", gap=gap(**levels, threshold=0.0024), **few))
    assert said == (
        "No effect named. A repeatable residual of 1.9 mN.m (RMS) over position remains, below the threshold of "
        "2.4 mN.m; 3 effects are not testable here. Held-out error of tau_in 3.1 mN.m (3 by a refit alone), floor "
        "1.9 mN.m."
    )
    assert "below the threshold" not in answer(found("none", gap=gap(**levels, threshold=0.0017), **few))
    quiet = answer(found("none", where=(), gap=gap(**{**levels, "holdout_after": 0.0019})))
    assert quiet.startswith("No effect named. No gap above the floor. Held-out error")


def test_effects_that_close_nothing_on_held_out_runs_have_no_share() -> None:
    said = answer(found("named", effects=("inertia",), where=(), gap=gap(closure=-0.2, closure_least=-0.1)))
    assert said.startswith("Missing: inertia; held-out error")
    said = answer(found("named", effects=("inertia",), where=(), gap=gap(closure=0.4, closure_least=-0.1)))
    assert said.startswith("Inertia explains 0 to 40 % of the disagreement")


def test_what_the_model_holds_beside_the_named_effects_is_said() -> None:
    """The effects of the card, but for those the model was given with."""
    before = ModelFit("TendonDrive", ("coulomb",), ())
    after = ModelFit("TendonDrive", ("coulomb", "presliding_shape", "inertia", "offset_drift@tau_in"), ())
    diagnosis = found("named", effects=("inertia",), where=(), given=before, refitted=before, final=after)
    assert diagnosis.also_in_model == ("presliding_shape", "offset_drift@tau_in")
    assert answer(diagnosis).endswith(
        " The model of the answer also holds another curve of friction after reversals and an offset or drift in "
        "tau_in: nuisance parameters, too small to be named."
    )
    assert "also holds" not in answer(replace(diagnosis, final=replace(after, effects=("coulomb", "inertia"))))
    moved = (ParameterChange("sigma0", "N.m/rad", 1.0, 15.0, 0.3),)
    parameters = answer(replace(diagnosis, verdict="parameters", effects=(), final=after, changes=moved))
    assert parameters.startswith(
        "No effect named: other parameter values with another curve of friction after reversals, inertia and an offset "
        "or drift in tau_in (nuisance parameters, too small to be named) close the gap (sigma0 "
    )
    assert "also holds" not in parameters
    of_a_shape = replace(diagnosis, verdict="parameters", effects=(), final=after, family=("history",))
    assert "is a law of the motion before (of a nuisance parameter)" in answer(of_a_shape)


def test_ambiguous_names_all_and_says_what_to_do() -> None:
    rivals = (candidate("delay@x_out", 0.88), candidate("sensor_lag@x_out", 0.87))
    alike = gap(closure=0.88, closure_least=0.88)
    said = answer(found("ambiguous", equivalent=(("delay", "sensor_lag"),), candidates=rivals, gap=alike))
    assert (
        "a delay or a lag of the sensor explains 88 % of it, these runs cannot tell which: play the next experiment"
        in said
    )


def test_unknown_gives_the_formula_and_says_that_it_is_no_name() -> None:
    formula = Formula((("v", 0.0021, "N.m.s/rad"),), "0.0021 N.m.s/rad v", 0.64, 1e-4)
    shapes = (ResidualShape("tau_in", "N.m", (), formula),)
    said = answer(found("unknown", candidates=(candidate("stribeck", 0.31),), shapes=shapes))
    assert "no effect of the library explains it well enough (the best, Stribeck friction, 31 %)" in said
    assert said.endswith("What predicts 64 % of it, not a name: tau_in lacks 0.0021 N.m.s/rad v.")


def test_parameters_and_refusal() -> None:
    assert answer(found("parameters")).startswith("No effect named: other parameter values close the gap. Held-out")
    elsewhere = answer(found("parameters", gap=gap(holdout_after=0.0101)))
    assert "close the gap of the measured runs" in elsewhere
    assert "Of tau_in they do not carry over to the held-out runs" in elsewhere
    refused = found("not_excited", gap={}, gate=Gate((), ("x_in does not move in any run",)))
    assert answer(refused) == "No answer from these runs: x_in does not move in any run."
    assert answer(found("not_excited")).startswith(
        "No answer from these runs: their motion shows no effect that could explain it"
    )


def test_an_answer_whose_model_predicts_held_out_runs_no_better_says_so() -> None:
    """An effect can be plain on the measured runs while other motions show what these leave open of the model."""
    better = answer(found("named", effects=("bend_angle",), gap=gap(holdout_refitted=0.012, holdout_after=0.0119)))
    assert "do not carry over" not in better
    worse = gap(refitted=0.0101, after=0.0013, holdout_refitted=0.0112, holdout_after=0.0123, closure=0.0)
    said = answer(found("named", effects=("bend_angle",), gap=worse))
    assert "On the measured runs a refit alone leaves 10.1 mN.m, the answer 1.3 mN.m." in said
    assert "Of tau_in the values of the answer's model do not carry over to the held-out runs" in said


def test_a_channel_that_nothing_explains_is_said_beside_the_answer() -> None:
    left = gap()
    left["x_out"] = replace(left["x_out"], unexplained=True, holdout_before=0.31, holdout_after=0.27)
    one = found("named", effects=("load_dependence",), gap=left)
    assert leading_channel(one) == "tau_in"
    assert "load-dependent friction explains 93 % of it; held-out error of tau_in 12.1 -> 2.3 mN.m" in answer(one)
    assert "What x_out lacks no effect of the library explains: held-out error of x_out" in answer(one)
    assert leading_channel(found("unknown", gap=left)) == "x_out"
    assert "lacks no effect" not in answer(found("unknown", gap=left))


def test_the_channel_is_the_one_that_was_closed() -> None:
    assert leading_channel(found("named", effects=("inertia",))) == "tau_in"
    both = gap()
    # the larger gap, not closed
    both["x_out"] = Gap(
        "rad", 0.5, 0.5, None, None, 0.003, 0.003, 0.0, 0.0, None, 0.5, None, None
    )  # the larger gap, not closed
    assert leading_channel(found("named", effects=("inertia",), gap=both)) == "tau_in"
    assert leading_channel(found("unknown", gap=both)) == "x_out"
    assert leading_channel(found("unknown", gap={})) is None


@pytest.mark.parametrize(
    ("coordinate", "unit", "ends", "text"),
    [
        ("distance since reversal", "m", (0.0101, 0.0202), "from 10 mm to 20 mm after reversals"),
        ("distance since reversal", "m", (0.0101, 0.0101), "about 10 mm after reversals"),
        ("v", "rad/s", (-0.0201, 0.0199), "at speeds below 1.2 deg/s"),
        ("v", "m/s", (0.3, 3.21), "at speeds from 0.3 m/s to 3.2 m/s"),
        ("sgn v", "1", (-1.0, -1.0), "on the way back"),
        ("sgn v", "1", (0.0, 0.0), "at rest"),
        ("sgn v", "1", (0.0, 1.0), "on the way forth"),
        ("harmonic 2", "Hz", (0.83, 0.83), "at the second harmonic of the motion (0.83 Hz)"),
        ("even harmonics", "Hz", (0.83, 4.2), "at even harmonics of the motion"),
        ("time", "s", (0.0, 4.94), "between 0 s and 4.9 s of a run"),
        ("load", "N", (-12.0, 3.3), "at loads from -12 N to 3 N"),
        ("x", "rad", (1e-9, 0.5), "at positions from 0 deg to 29 deg"),
        ("x", "rad", (2.2, 2.34), "at positions from 126 deg to 134 deg"),
        ("load", "N", (1.71, 1.71), "at loads of about 1.7 N"),
        ("dwell", "s", (0.02, 0.02), "after rests of about 0.02 s"),
        ("time", "s", (4.0, 4.0), "at about 4 s of a run"),
        ("frequency", "Hz", (0.83, 0.83), "at about 0.83 Hz, in step with the motion"),
    ],
)  # fmt: skip
def test_places_in_words(coordinate: str, unit: str, ends: tuple[float, float], text: str) -> None:
    assert place_text(Place("F", coordinate, unit, ends, 0.5, 0.1, 0.5, 0.1, 0.01, True)) == text


def test_best_wrong_is_none_of_the_answer() -> None:
    listed = (candidate("inertia", 0.9, 0.2), candidate("creep@x_out", 0.5, 0.6), candidate("delay@x_out", 0.4, 0.5))
    wrong = best_wrong(found("named", effects=("inertia",), candidates=listed))
    assert wrong is listed[2]
    assert best_wrong(found("unknown", candidates=listed)) is None
    hidden = (*listed, candidate("wear", 0.9, 0.1, testable=False))
    assert best_wrong(found("named", effects=("inertia",), candidates=hidden)) is listed[2]
    assert best_wrong(found("ambiguous", equivalent=(("inertia", "delay"),), candidates=listed)) is listed[1]


@pytest.mark.parametrize("other", ["F", "x_out"])
def test_a_place_is_that_of_the_channel_of_the_answer(other: str) -> None:
    """Whatever its name: of another channel it is not said."""
    said = answer(found("named", effects=("inertia",), where=(replace(AFTER, channel=other),)))
    assert said.startswith("Inertia explains 93 % of the disagreement of tau_in; held-out error")
    rest = answer(found("none", where=(replace(AFTER, channel=other, rms=0.005),)))
    assert "repeatable residual" not in rest


@pytest.mark.parametrize(("explained", "said"), [(0.149, False), (0.151, True)])
def test_a_place_is_said_where_it_explains_a_tenth_beyond_chance(explained: float, said: bool) -> None:
    place = replace(AFTER, explained=explained, chance=0.05)
    text = answer(found("named", effects=("inertia",), where=(place,)))
    assert ("within 8 deg after reversals" in text) is said
    assert "after reversals" not in answer(
        found("named", effects=("inertia",), where=(replace(place, significant=False),))
    )
