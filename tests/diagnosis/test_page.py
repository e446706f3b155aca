"""What the page of a diagnosis says and its tables hold, from a result made by hand; nothing is written."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tsm_fmu import __version__
from tsm_fmu.card import ModelCard
from tsm_fmu.diagnosis.evidence import (
    Candidate,
    ChannelError,
    Dependence,
    FamilyShare,
    Formula,
    Gap,
    Gate,
    ModelFit,
    NextMotion,
    ParameterChange,
    ParameterValue,
    Place,
    ResidualShape,
    RunComparison,
)
from tsm_fmu.diagnosis.improved import ImprovedModel, ImprovementStep, RunZeros
from tsm_fmu.diagnosis.report import page
from tsm_fmu.diagnosis.report.page import _rounded, _span, write_diagnosis_report
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.effects import about, words
from tsm_fmu.logs.record import Record
from tsm_fmu.report import Section

GAP = Gap("rad", 0.0131, 0.0024, 0.0121, 0.0023, 0.0019, 0.0011, 0.93, 0.91, None, 0.01222, 0.0120)
PLAIN = Gap("N", 0.31, 0.0412, None, None, 0.04, 0.009, 1.03, 0.96, None, 0.29, None)
CHANNELS = ("x_out", "F")


@dataclass
class Told:
    """What is handed to the writer of the page."""

    path: Path
    title: str
    summary: str
    given: list[Section]
    provenance: dict[str, str]

    @property
    def sections(self) -> dict[str, Section]:
        assert len({s.title for s in self.given}) == len(self.given)
        return {s.title: s for s in self.given}


def told(monkeypatch: pytest.MonkeyPatch, **more: Any) -> Told:
    found = Diagnosis(more.pop("verdict", "named"), **{"gap": {"x_out": GAP, "F": PLAIN}, "channels": CHANNELS, **more})
    seen: list[Told] = []
    monkeypatch.setattr(page, "write_report", lambda *arguments: seen.append(Told(*arguments)))
    write_diagnosis_report(Path("report.html"), found)
    return seen[0]


def place(channel: str, coordinate: str, ends: tuple[float, float], unit: str = "m", **more: Any) -> Place:
    values: dict[str, Any] = {
        "share_of_gap": 0.714, "share_of_samples": 0.226, "explained": 0.61, "chance": 0.043, "p": 0.00234,
        "significant": True,
    }  # fmt: skip
    return Place(channel, coordinate, unit, ends, **{**values, **more})


def fit_of(model: str, effects: tuple[str, ...] = (), **values: float) -> ModelFit:
    units = {"tau_c": "N.m", "beta": "1", "inertia.m": "kg"}
    return ModelFit(model, effects, tuple(ParameterValue(n, x, units[n], f"about {n}") for n, x in values.items()))


def test_empty_sections_are_left_out_and_the_page_says_where_it_comes_from(monkeypatch: pytest.MonkeyPatch) -> None:
    bare = told(monkeypatch, verdict="none", answer="Nothing.", gap={}, seed=7)
    assert (bare.title, bare.summary, bare.given) == ("Diagnosis", "Nothing.", [])
    assert bare.provenance == {"tsm-fmu": __version__, "verdict": "none", "preset": "none", "seed": "7"}
    final = fit_of("TendonDrive")
    records = {"measured a": "12ab", "holdout b": "34cd"}
    full = told(monkeypatch, final=final, preset="mssp_2015", records=records)
    assert full.title == "Diagnosis of TendonDrive"
    assert full.provenance == {
        "tsm-fmu": __version__, "verdict": "named", "model": "TendonDrive", "preset": "mssp_2015", "seed": "0",
        "measured a": "sha256 12ab", "holdout b": "sha256 34cd",
    }  # fmt: skip
    assert list(full.sections) == ["Gap"]


def test_sections_stand_in_the_order_of_reading(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.linspace(0.0, 1.0, 7)
    run = RunComparison(Record("r", t, {}, {}, None, ""), t, np.ones((7, 2)),
                        dict.fromkeys(("given", "refitted", "final"), np.ones((7, 2))), None, {})  # fmt: skip
    stage = fit_of("TendonDrive", tau_c=0.1)
    seen = told(
        monkeypatch, verdict="ambiguous", where=(place("F", "x", (0.1, 0.2)),), equivalent=(("wear", "delay"),),
        candidates=(candidate("wear"),), family_evidence=(FamilyShare("position", "F", 0.3),),
        shapes=(ResidualShape("F", "N"),), improved=IMPROVED, runs=(run,), given=stage, refitted=stage, final=stage,
        next_motion=NextMotion("go", t, {}, {}, 1.0), notes=("it is so",),
    )  # fmt: skip
    assert list(seen.sections) == [
        "Gap", "Where", "Candidates", "Family", "What the missing part looks like", "For prediction", "Run r",
        "What could not be excluded", "Next experiment", "Parameters", "Notes",
    ]  # fmt: skip


def test_the_gap_says_what_its_floor_is_and_cautions_twofold_errors_on_held_out_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for after, floor, out, said in (
        (0.04, 0.01, 0.081, True), (0.04, 0.01, 0.079, False), (0.01, 0.04, 0.081, True), (0.01, 0.04, 0.079, False),
    ):  # fmt: skip
        one = replace(PLAIN, after=after, floor=floor, holdout_before=0.3, holdout_after=out, holdout_refitted=0.3)
        text = told(monkeypatch, gap={"F": one}).sections["Gap"].text
        assert (f"Caution: the error of F on the held-out runs is {out / after:.2g} times that on the" in text) is said
    section = told(monkeypatch).sections["Gap"]
    assert "That may still hold a law" in section.text
    assert len(section.tables) == 2
    assert len(section.figures) == 1
    beside = {"x_out": replace(GAP, reference=0.001), "F": PLAIN}
    section = told(monkeypatch, gap=beside).sections["Gap"]
    assert "It is not less than what the refitted model leaves on reference runs." in section.text
    assert [t.rows[4][0] for t in section.tables] == ["left on reference runs, or noise", "surely noise"]


def test_a_row_of_the_gap_for_each_error_that_is_known_in_the_unit_of_the_largest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    degree = 180.0 / np.pi
    angle, force = told(monkeypatch).sections["Gap"].tables
    assert tuple(angle.heading) == ("error of x_out [deg]", "measured", "held out")
    rows = {name: cells for name, *cells in angle.rows}
    expected = {
        "model as given": (0.0131, 0.0121), "refit alone": (0.01222, 0.0120), "model of the answer": (0.0024, 0.0023),
        "floor": (0.0019, 0.0019), "surely noise": (0.0011, 0.0011),
    }  # fmt: skip
    for name, errors in expected.items():
        assert rows[name] == [float(f"{degree * e:.3g}") for e in errors], name
    assert list(rows) == [*expected, "gap closed"]
    assert rows["gap closed"] == ["", "91 to 93 %"]
    assert tuple(force.heading) == ("error of F [N]", "measured")
    assert {name: cells for name, *cells in force.rows}["gap closed"] == ["96 % to all"]
    small = replace(PLAIN, before=0.02, floor=0.11, fmu=0.0412, threshold=0.03, closure_interval=(0.87, 1.2))
    (table,) = told(monkeypatch, gap={"F": small}).sections["Gap"].tables
    assert table.heading[0] == "error of F [N]"  # the floor is the larger one
    rows = {name: cells for name, *cells in table.rows}
    assert rows["its exported FMU"] == [0.0412]
    assert rows["threshold of an effect"] == [0.03]
    assert rows["the same, 90 % over runs"] == ["87 to 100 %"]
    (table,) = told(monkeypatch, gap={"F": replace(small, floor=0.04)}).sections["Gap"].tables
    assert table.heading[0] == "error of F [mN]"
    assert table.rows[0] == ("model as given", 20.0)


def test_where_has_a_row_for_each_place_and_a_sentence_for_what_is_notable(monkeypatch: pytest.MonkeyPatch) -> None:
    first = place("F", "x", (0.1, 0.2))
    where = (
        first,
        place("F", "v", (-0.5, 1.9), unit="m/s", explained=0.144, chance=0.043, p=1e-6),  # barely notable
        place("F", "a", (0.1, 0.2), unit="m/s2", explained=0.142, chance=0.043, p=1.01e-6),  # just not
        place("F", "load", (3.0, 4.0), unit="N", significant=False, p=0.061),
        place("x_out", "sgn v", (1.0, 1.0), unit="1", share_of_gap=0.996),
    )
    section = told(monkeypatch, where=where).sections["Where"]
    assert section.text == (
        "71 % of the disagreement of F lies at positions from 100 mm to 200 mm (23 % of the samples), "
        "71 % at speeds from -500 mm/s to 1900 mm/s. "
        "All of the disagreement of x_out lies on the way forth (23 % of the samples)."
    )
    (table,) = section.tables
    assert tuple(table.heading) == (
        "channel", "over", "mostly", "of the gap", "of samples", "explained", "by chance", "p", "significant",
    )  # fmt: skip
    assert table.rows[0] == ("F", "x", "100 mm to 200 mm", "71 %", "23 %", "61 %", "4 %", "0.002", "yes")
    assert [row[-2:] for row in table.rows[1:4]] == [("< 1e-6", "yes"), ("1e-06", "yes"), ("0.06", "no")]
    assert [row[2] for row in table.rows[3:]] == ["3 N to 4 N", "on the way forth"]
    assert "Residual of the refitted model, most telling first" in table.caption
    assert "Only the speed is known" not in table.caption
    given = told(monkeypatch, where=(replace(first, significant=False),), located="given", motion="v")
    assert given.sections["Where"].text == "The disagreement does not depend on any coordinate beyond chance."
    others = told(monkeypatch, where=(first,), gap={"F": replace(PLAIN, elsewhere=True)}).sections["Where"]
    assert others.text.endswith(" This is of the measured runs, which do not show what the held-out ones do.")
    caption = given.sections["Where"].tables[0].caption
    assert "Residual of the model as given, most telling first" in caption
    assert caption.endswith(" Only the speed is known: positions x count from the start of each run.")


def test_twelve_places_have_a_row_and_three_of_a_channel_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    bands = np.arange(0.11, 0.249, 0.01)
    where = tuple(place("F", "x", (0.1, b), share_of_gap=b) for b in bands)
    section = told(monkeypatch, where=where).sections["Where"]
    assert [row[3] for row in section.tables[0].rows] == [f"{round(100 * b)} %" for b in bands[:12]]
    assert section.text.startswith("11 % of the disagreement of F lies")
    assert section.text.count("%") == 4  # of the samples, too, of the first
    assert "13 % at positions from" in section.text
    assert "14 % at positions from" not in section.text


def test_where_draws_every_shape(monkeypatch: pytest.MonkeyPatch) -> None:
    law = Dependence("x", "m", "", np.array([0.1, 0.2]), *(np.array([1.0, 2.0]) for _ in range(3)))
    shapes = (ResidualShape("F", "N", (law,)), ResidualShape("x_out", "rad", (law, replace(law, coordinate="v"))))
    seen = told(monkeypatch, where=(place("F", "x", (0.1, 0.2)),), shapes=shapes).sections["Where"]
    assert [f.title for f in seen.figures] == [
        f"Mean residual of {channel}, 90 % interval" for channel in ("F", "x_out", "x_out")
    ]


@pytest.mark.parametrize(("coordinate", "ends", "unit", "text"), [
    ("x", (0.0997, 0.1997), "rad", "6 deg to 11 deg"), ("time", (4.0, 4.0), "s", "4 s"),
    ("load", (4.0, 4.001), "N", "4 N"), ("sgn v", (-1.0, -1.0), "1", "on the way back"),
])  # fmt: skip
def test_one_value_stands_where_both_ends_look_the_same(coordinate, ends, unit, text) -> None:
    assert _span(place("F", coordinate, ends, unit)) == text


def candidate(spec: str, **more: Any) -> Candidate:
    values: dict[str, Any] = {
        "score": 7.1234, "closure_measured": 0.9, "closure_holdout": None, "parameters": {"m": 0.04321, "L": 0.0176},
        "units": {"m": "kg", "L": "m"}, "misfit": 0.5,
        "channels": {"x_out": ChannelError(0.004321, (0.42, 0.444), (0.3, 0.3)), "F": ChannelError(0.05678)},
    }  # fmt: skip
    return Candidate(spec, **{**values, **more})


def test_each_testable_candidate_has_a_row_beside_the_refit_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    listed = (
        candidate("inertia"), candidate("creep@x_out", score=-0.04, misfit=0.7, parameters={}),
        candidate("wear", misfit=0.6, channels={"x_out": ChannelError(0.0087, (-0.3, -0.2))}),
        candidate("slack@x_out", misfit=0.1, testable=False), candidate("thermal", testable=False),
    )  # fmt: skip
    gaps = {"F": replace(PLAIN, refitted=0.05, after=0.05), "x_out": GAP}  # the force has no gap: the angle leads
    section = told(monkeypatch, gap=gaps, effects=("inertia",), candidates=listed).sections["Candidates"]
    (table,) = section.tables
    assert tuple(table.heading) == (
        "effect", "error of x_out [deg]", "closes, measured", "closes, held out", "score", "id", "parameters",
    )  # fmt: skip
    assert table.rows == [
        ("none (refit alone)", 0.7, "", "", "", "", ""),
        (words("inertia"), 0.248, "42 to 44 %", "30 %", 7.1, "inertia", "m = 0.0432 kg, L = 17.6 mm"),
        (words("creep@x_out"), 0.248, "42 to 44 %", "30 %", 0.0, "creep@x_out", ""),
        (words("wear"), 0.498, "worse", "", 7.1, "wear", "m = 0.0432 kg, L = 17.6 mm"),
    ]
    assert str(table.rows[2][4]) == "0.0"  # and not -0.0
    assert section.text == (
        "Each effect refitted together with the model: those of the answer together, the others alone. "
        f"Error of x_out with {words('inertia')}: 0.138 deg; with the best of the others, {words('wear')}: 0.498 deg. "
        f"Tried as well, but these runs could not show them: {words('slack@x_out')}, {words('thermal')}."
    )
    two = told(monkeypatch, gap=gaps, effects=("inertia", "wear"), candidates=listed).sections["Candidates"].text
    assert f"Error of x_out with {words('inertia')} and {words('wear')}: 0.138 deg; with the best of" in two
    assert f"of the others, {words('creep@x_out')}: 0.248 deg" in two
    for alone in ({"effects": ()}, {"effects": ("inertia",), "candidates": listed[:1]}):
        text = told(monkeypatch, **{"gap": gaps, "candidates": listed[:3], **alone}).sections["Candidates"].text
        assert text == "Each effect refitted together with the model: those of the answer together, the others alone."
    assert "Candidates" not in told(monkeypatch, candidates=listed[3:]).sections
    assert told(monkeypatch, gap={}, candidates=listed).given == []


def test_shares_of_families_are_told_as_percent_and_never_below_none(monkeypatch: pytest.MonkeyPatch) -> None:
    evidence = (
        FamilyShare("position", "F", 0.376),
        FamilyShare("history", "x_out", -0.2),
        FamilyShare("load", "F", 0.0),
    )
    section = told(monkeypatch, family_evidence=evidence, family=("position", "load")).sections["Family"]
    (table,) = section.tables
    position, load = page.FAMILIES["position"], page.FAMILIES["load"]
    assert [row[0::2] for row in table.rows] == [("F", "38 %"), ("x_out", "0 %"), ("F", "0 %")]
    assert [row[1] for row in table.rows] == [position, page.FAMILIES["history"], load]
    assert section.text == f"Of what is missing: {position} and {load}."
    section = told(monkeypatch, family_evidence=evidence).sections["Family"]
    assert section.text.startswith("No family of laws predicts enough")
    section = told(monkeypatch, verdict="none", family_evidence=evidence, family=("load",)).sections["Family"]
    assert section.text == f"Of what the model's own parameters leave, too little for a name: {load}."
    assert "Family" not in told(monkeypatch, family=("position",)).sections


def test_formulas_are_told_of_what_has_no_name(monkeypatch: pytest.MonkeyPatch) -> None:
    formula = Formula((("v", 0.21, "N.s/m"),), "0.21 N.s/m v", 0.6449, 1e-4)
    shapes = (ResidualShape("F", "N", (), formula), ResidualShape("x_out", "rad"))
    heading = "What the missing part looks like"
    for verdict in ("unknown", "ambiguous"):
        lines = told(monkeypatch, verdict=verdict, shapes=shapes).sections[heading].text.split("\n\n")
        assert lines[:2] == [
            "F: residual = 0.21 N.s/m v. Predicts 64 % of the residual on parts left out.",
            "x_out: no short formula predicts the residual on parts left out.",
        ]
        assert lines[2].startswith("A description within the range of these runs, not a name")
        assert len(lines) == 3
    text = told(monkeypatch, verdict="unknown", shapes=shapes[1:]).sections[heading].text
    assert text == "x_out: no short formula predicts the residual on parts left out."
    assert heading not in told(monkeypatch, verdict="unknown").sections
    assert heading not in told(monkeypatch, verdict="named", shapes=shapes).sections


def test_what_could_not_be_excluded_has_sets_effects_unseen_and_effects_without_a_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sets = (("wear", "delay"), ("slack", "thermal", "inertia"))
    section = told(
        monkeypatch, equivalent=sets, not_excited=("wear", "slack"), not_applicable={"bend_angle": "no angle"}
    ).sections["What could not be excluded"]
    assert section.text.split("\n\n") == [
        f"These runs cannot tell apart: {words('wear')}, {words('delay')}.",
        f"These runs cannot tell apart: {words('slack')}, {words('thermal')}, {words('inertia')}.",
    ]
    unseen, nowhere = section.tables
    assert unseen.rows == [(words(e), about(e).shown_by, e) for e in ("wear", "slack")]
    assert nowhere.rows == [(words("bend_angle"), "no angle", "bend_angle")]
    for one in ({"equivalent": sets}, {"not_excited": ("wear",)}, {"not_applicable": {"wear": "so"}}):
        section = told(monkeypatch, **one).sections["What could not be excluded"]
        assert (bool(section.text), len(section.tables)) == ((True, 0) if "equivalent" in one else (False, 1))
    assert "What could not be excluded" not in told(monkeypatch).sections


def test_the_next_experiment_is_a_file_its_length_and_what_it_tells_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.linspace(0.0, 19.6, 50)
    motion = NextMotion("two sines", t, {"x_in": np.sin(t), "F": 0.0 * t}, {"x_in": "rad", "F": "N"}, 4.567)
    section = told(monkeypatch, next_motion=motion, equivalent=(("wear", "delay"), ("slack",))).sections[
        "Next experiment"
    ]
    assert section.text == (
        f"Play two sines (next_experiment.csv, 20 s): the predictions of {words('wear')} and {words('delay')} then "
        "differ by 4.6 times the floor."
    )
    assert [f.title for f in section.figures] == ["x_in"]
    assert "predictions of the rivals then" in told(monkeypatch, next_motion=motion).sections["Next experiment"].text
    assert "Next experiment" not in told(monkeypatch, equivalent=(("wear", "delay"),)).sections


def test_parameters_stand_beside_one_another_and_what_a_model_lacks_is_empty(monkeypatch: pytest.MonkeyPatch) -> None:
    given, refitted = fit_of("T", tau_c=0.123456, beta=1.0), fit_of("T", tau_c=0.2, beta=-12345.6)
    final = fit_of("T", tau_c=0.3, beta=2.0, **{"inertia.m": 0.04321})
    section = told(monkeypatch, given=given, refitted=refitted, final=final).sections["Parameters"]
    (table,) = section.tables
    assert tuple(table.heading) == ("parameter", "as given", "refitted", "answer", "unit", "meaning")
    assert table.rows == [
        ("tau_c", 0.123, 0.2, 0.3, "N.m", "about tau_c"),
        ("beta", 1.0, -12300.0, 2.0, "1", "about beta"),
        ("inertia.m", "", "", 0.0432, "kg", "about inertia.m"),
    ]
    assert "Parameters" not in told(monkeypatch, given=given, final=final).sections


def test_values_that_are_no_number_stay_so() -> None:
    assert [_rounded(x) for x in (1234.5, -0.00123456, np.inf)] == [1230.0, -0.00123, np.inf]
    assert np.isnan(_rounded(np.nan))


CHANGES = tuple(ParameterChange(f"p{k}", "1", 1.0, 2.0 + k, 0.5) for k in range(7))


@pytest.mark.parametrize("verdict", ["named", "ambiguous", "parameters", "unknown", "none", "not_excited"])
def test_notes_tell_six_changes_where_the_answer_has_a_fit(monkeypatch: pytest.MonkeyPatch, verdict: str) -> None:
    seen = told(monkeypatch, verdict=verdict, changes=CHANGES).sections
    moved = ", ".join(f"p{k} 1 -> {2 + k}" for k in range(6))
    if verdict in ("named", "ambiguous", "parameters"):
        assert seen["Notes"].text == f"The refit moved {moved}."
    else:
        assert "Notes" not in seen


def test_notes_are_sentences_and_one_finding_of_several_runs_is_one_row(monkeypatch: pytest.MonkeyPatch) -> None:
    gate = Gate(("a: the clock jitters: 3 ms", "b: F stands still", "c: the clock jitters: 3 ms"), ("too short",))
    stage = fit_of("T")
    final = replace(stage, effects=("inertia", "wear", "delay@x_out"))
    section = told(
        monkeypatch, effects=("inertia",), given=stage, refitted=stage, final=final, gate=gate,
        notes=("it is odd.", "the Rest is not"),
    ).sections["Notes"]  # fmt: skip
    assert section.text.split("\n\n") == [
        f"The model of the answer, its card and its FMU also hold {words('wear')} (wear) and {words('delay@x_out')} "
        "(delay@x_out): nuisance parameters of every fit, of too little effect to be named.",
        "It is odd.", "The Rest is not.", "Too short.",
    ]  # fmt: skip
    (table,) = section.tables
    assert table.rows == [("the clock jitters: 3 ms", "a, c"), ("F stands still", "b")]
    alone = told(monkeypatch, gate=Gate(("a: so",))).sections["Notes"]
    assert (alone.text, len(alone.tables)) == ("", 1)
    alone = told(monkeypatch, notes=("so",)).sections["Notes"]
    assert (alone.text, alone.tables) == ("So.", [])
    assert "Notes" not in told(monkeypatch).sections


IMPROVED = ImprovedModel(
    "Better.", ("wear",), (),
    (ImprovementStep("", {"x_out": 0.0131, "F": 0.31}, {"x_out": 0.0141}, {}),
     ImprovementStep("wear", {"x_out": 0.004567, "F": 0.2}, {"x_out": 0.0091}, {})),
    (RunZeros("x_out", "rad", {"a": 0.0123, "b": -0.0456}, 0.04, 0.01), RunZeros("F", "N", {"a": 0.5}, 0.09, 0.01)),
    ModelCard("TendonDrive"),
)  # fmt: skip


def test_the_way_to_the_improved_model_and_its_zeros_are_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    section = told(monkeypatch, improved=IMPROVED).sections["For prediction"]
    assert section.text == "Better."
    way, angle, force = section.tables
    assert tuple(way.heading) == ("added, RMS", "x_out [rad], measured", "x_out [rad], left out", "F [N], measured")
    assert way.rows == [("refitted", "0.0131", "0.0141", "0.31"), ("wear", "0.00457", "0.0091", "0.2")]
    assert tuple(angle.heading) == ("zero of x_out by run", "[deg]")
    assert angle.rows == [("a", 0.705), ("b", -2.61)]
    assert tuple(force.heading) == ("zero of F by run", "[mN]")  # by the scatter, not by the values
    assert force.rows == [("a", 500.0)]
    assert "For prediction" not in told(monkeypatch).sections
