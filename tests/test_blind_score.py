"""The scorer of the blind cases: points by hand, Wilson intervals from their equation, a stand-in for the verb."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from benchmarks.blind.catalogue import selected
from benchmarks.blind.generate import write
from benchmarks.blind.judge import arguments, diagnosed
from benchmarks.blind.score import Scored, confusion, rates, risk_coverage, scored, wilson
from benchmarks.blind.table import lines, row

ROOT = Path(__file__).parents[1]


def truth(stratum: str, *effects: str, hidden: int | None = None, tolerated: tuple[str, ...] = ()) -> dict[str, Any]:
    forms = ["form"] * (len(effects) if hidden is None else hidden)
    channels = {"response": {"x_out": 0.02, "F": 0.3}, "noise": {"x_out": 0.01, "F": 0.05}}
    return {"stratum": stratum, "effects": list(effects), "hidden": forms, "tolerated": list(tolerated), **channels}


def said(*named: str, verdict: str = "", sets: tuple[tuple[str, ...], ...] = (), **more: Any) -> dict[str, Any]:
    answer = {
        "verdict": verdict or ("named" if named else "unknown"),
        "effects": list(named), "equivalent": [list(s) for s in sets], "not_excited": [], "candidates": [], "gap": {},
    }  # fmt: skip
    return {**answer, **more}


@pytest.mark.parametrize(
    ("what", "answer", "points"),
    [
        (truth("A", "inertia"), said("inertia"), 1.0),
        (truth("A", "inertia"), said("creep"), -2.0),
        (truth("A", "inertia"), said("inertia", "creep"), -1.0),
        (truth("A", "inertia"), said(), 0.0),
        (truth("A", "inertia"), said(sets=(("inertia", "creep", "slack"),)), 0.5 / 3.0),
        (truth("A", "inertia"), said(sets=(("creep", "slack"),)), 0.0),
        (truth("A", "inertia"), said("inertia", sets=(("inertia", "creep"),)), 1.0),
        (truth("A", "backlash"), said("smooth_backlash"), 1.0),
        (truth("C", "inertia", tolerated=("quantisation",)), said("inertia", "quantisation"), 1.0),
        (truth("C", "inertia"), said("inertia", "quantisation"), -1.0),
        (truth("C", "quantisation", tolerated=("quantisation",)), said("quantisation"), 1.0),
        (truth("C"), said("creep"), -3.0),
        (truth("D", "inertia", "creep"), said("creep", "inertia"), 1.0),
        (truth("D", "inertia", "creep"), said("creep"), 0.5),
        (truth("D", "inertia", "creep"), said("creep", "slack"), -1.5),
        (truth("E", hidden=1), said("creep"), -2.0),
        (truth("E", hidden=1), said(), 0.0),
        (truth("B"), said("creep"), -3.0),
        (truth("F"), said("creep"), -3.0),
        (truth("F"), said(verdict="none"), 0.0),
        (truth("G", "creep"), said("slack"), -3.0),
        (truth("G", "creep"), said("creep"), 1.0),
        (truth("F"), {"failed": 1}, 0.0),
    ],
)
def test_points(what: dict[str, Any], answer: dict[str, Any], points: float) -> None:
    assert scored("case", what, answer).points == pytest.approx(points)


def test_closures_and_margin_are_read() -> None:
    candidates = [
        {"effect": "creep", "score": 7.5, "gap_closure_holdout": 0.31},
        {"effect": "inertia", "score": 40.0, "gap_closure_holdout": 0.93},
        {"effect": "slack", "score": None, "gap_closure_holdout": None},
    ]
    gap = {"F": {"closure": 0.91}, "x_out": {"closure": 0.2}}
    one = scored("case", truth("A", "inertia"), said("inertia", candidates=candidates, gap=gap))
    assert (one.closure, one.wrong_closure, one.confidence) == (0.91, 0.31, 32.5)
    listed = scored("case", truth("G", "creep"), said(not_excited=["slack", "creep"]))
    assert listed.listed
    assert not scored("case", truth("G", "creep"), said(not_excited=["slack"])).listed


@pytest.mark.parametrize(("hits", "trials"), [(0, 10), (3, 17), (10, 10), (119, 120)])
def test_wilson_interval_solves_its_equation(hits: int, trials: int) -> None:
    z = 1.96
    low, high = wilson(hits, trials, z)
    p = hits / trials
    for bound in (low, high):
        if 0.0 < bound < 1.0:
            assert abs(p - bound) == pytest.approx(z * math.sqrt(bound * (1.0 - bound) / trials), rel=1e-9)
    assert low <= p <= high
    assert wilson(0, 0) == (0.0, 1.0)


def made_up() -> list[Scored]:
    return [
        Scored("a", "A", "named", ("inertia",), ("inertia",), 1.0, 1, 0, confidence=50.0, closure=0.95),
        Scored("b", "A", "named", ("creep",), ("slack",), -2.0, 0, 1, confidence=3.0),
        Scored("c", "A", "unknown", ("wear",), (), 0.0, 0, 0),
        Scored("d", "E", "unknown", (), (), 0.0, 0, 0),
        Scored("e", "F", "none", (), (), 0.0, 0, 0),
        Scored("f", "F", "named", (), ("creep",), -3.0, 0, 1),
        Scored("g", "G", "none", ("delay",), (), 0.0, 0, 0, listed=True),
        Scored("h", "D", "named", ("creep", "delay"), ("creep",), 0.5, 1, 0, confidence=9.0, closure=0.4),
    ]


def test_rates_by_hand() -> None:
    found = {r.what.split("(")[0].strip().rstrip(","): (r.hits, r.trials, r.met) for r in rates(made_up())}
    assert found["names given that are right"] == (2, 3, False)
    assert found["coverage: a name given"] == (3, 4, True)
    assert found["false alarms, nothing missing"] == (1, 2, False)
    assert found["outside the vocabulary: unknown"] == (1, 1, True)
    assert found["wrong parameters: said so"] == (0, 0, None)
    assert found["not excited: listed"] == (1, 1, True)
    assert found["right name closes 0.9 of the gap"] == (1, 2, False)


def test_confusion_by_hand() -> None:
    found = confusion(made_up())
    assert found["inertia", "inertia"] == 1
    assert found["creep", "slack"] == found["creep", "creep"] == 1
    assert found["wear", "[unknown]"] == 1
    assert found["(E)", "[unknown]"] == found["(F)", "[none]"] == found["(F)", "creep"] == 1
    assert found["delay", "[named]"] == 1
    assert sum(found.values()) == 9


def test_risk_coverage_by_hand() -> None:
    # of five cases where something shows, three have names, by margin: right, right, wrong
    assert risk_coverage(made_up()) == [
        (pytest.approx(1 / 5), 0.0),
        (pytest.approx(2 / 5), 0.0),
        (pytest.approx(3 / 5), pytest.approx(1 / 3)),
    ]


def test_tables_print_everything() -> None:
    text = "\n".join([*lines(made_up()), *(row(r) for r in made_up())])
    assert "MISSED" in text
    assert "coverage" in text
    assert "2/3" in text
    assert "nan" not in text
    assert "\n".join(lines([Scored("f", "F", "none", (), (), 0.0, 0, 0)]))


def test_command_line_says_only_what_the_user_knows(tmp_path: Path) -> None:
    case = next(c for c in selected(14) if c.reference)
    write([case], tmp_path)
    folder = tmp_path / "logs" / case.name
    words = arguments(folder, tmp_path / "out")
    assert words[:2] == ["diagnose", case.model]
    assert words.count("--measured") == len(case.measured)
    assert words.count("--holdout") == len(case.holdout)
    assert words.count("--reference") == 2
    values = dict(w.split("=") for w in words if "=" in w)
    assert {n: float(v) for n, v in values.items()} == json.loads((folder / "case.json").read_text())["set"]

    def stand_in(given: list[str]) -> int:
        assert given == words
        (tmp_path / "out" / "diagnosis.json").write_text(json.dumps(said("creep")))
        return 0

    answer = diagnosed(folder, tmp_path / "out", stand_in)
    assert answer["effects"] == ["creep"]
    assert answer["wall_s"] >= 0.0
    assert diagnosed(folder, tmp_path / "out", lambda _: 2) == {"failed": 2, "wall_s": pytest.approx(0.0, abs=5.0)}
