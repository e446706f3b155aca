"""What the results of a check, a fit, a life and a sweep say, from numbers made up here."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tsm_fmu.card import CardParameter, ModelCard
from tsm_fmu.checking.clock import Clock
from tsm_fmu.checking.coverage import MotionCoverage
from tsm_fmu.checking.finding import Finding
from tsm_fmu.checking.power import Power
from tsm_fmu.checking.run_check import Channel, RunCheck
from tsm_fmu.cosim.metric import CaseMetrics, Metric, Spread
from tsm_fmu.cosim.step_study import SignalStudy
from tsm_fmu.cosim.sweep import Axis, Point
from tsm_fmu.cosim.trajectory import Trajectory
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.agreement import Agreement
from tsm_fmu.logs.record import Record
from tsm_fmu.models.contract import InputError
from tsm_fmu.verbs import check, identify, track
from tsm_fmu.verbs.check import CheckResult
from tsm_fmu.verbs.identify import IdentifyResult
from tsm_fmu.verbs.models import ResolvedModel
from tsm_fmu.verbs.run import RunResult
from tsm_fmu.verbs.step_study import StepStudyResult
from tsm_fmu.verbs.sweep import SweepResult


def cells(text: str, begin: str) -> list[str]:
    """The row of a table that begins with a word; cells are two blanks apart."""
    row = next(line for line in text.splitlines() if line.startswith(begin))
    return [cell.strip() for cell in row.split("  ") if cell.strip()]


MOTION = MotionCoverage(
    channel="x_in", unit="rad", x=(-0.5, 0.25), v=(-3.0, 2.0), a=(-4.0, 5.0), cutoff=12.0, amplitudes=(0.1, 0.2, 0.3),
    reversals=17, frequencies=(0.25, 1.5), dwell=0.75, initial_rest=0.0,
)  # fmt: skip
RUN = RunCheck(
    "one", "0123456789abcdef", 501, 2.0, 7.0, Clock(100.0, 0.00012, 3),
    {"x_in": Channel("rad", -0.5, 0.25, 0.003, 0.0125), "F": Channel("N", 1.0, 2.0, 0.0, 0.25)},
    MOTION, [Power("F", "x_in", -1.5, 0.25)],
    [Finding("gap", "time", 2.5, 3.0, (51, 101), "a hole"), Finding("coverage", "x_in", 2.0, 7.0, (2, 502), "no rest"),
     Finding("glitch", "F", 4.0, 4.0, (202, 202), "a spike")],
)  # fmt: skip
STILL = replace(RUN, name="two", motion=None, powers=[], findings=[])
T = 2.0 + 0.01 * np.arange(501)
RECORDS = tuple(
    Record(n, T, {"x_in": k + T, "F": k - T}, {"x_in": "rad", "F": "N"}) for k, n in enumerate(("one", "two"))
)


def test_a_check_says_clock_channels_motion_findings_and_what_is_missing() -> None:
    text = check._summary(RUN)
    lines = text.splitlines()
    assert lines[0] == "one: 501 samples from 2 to 7 s at 100 Hz, jitter 0.00012 s, 3 gaps; sha256 0123456789ab"
    assert cells(text, "x_in") == ["x_in", "rad", "-0.5", "0.25", "0.003", "250", "0.0125"]
    assert cells(text, "F ") == ["F", "N", "1", "2", "none found", "0.25"]
    assert (
        "motion of x_in: -28.65 deg to 14.32 deg, speed up to 171.9 deg/s, acceleration up to 286.5 deg/s2 "
        "(cut-off 12 Hz)"
    ) in lines
    assert "17 reversals, half strokes (least / median / most) 5.73 deg / 11.46 deg / 17.19 deg" in lines
    assert "frequencies 0.25, 1.5 Hz, longest rest 0.75 s" in lines
    assert "power F * dx_in/dt: -1.5 W on average" in lines
    assert lines[-5:] == ["findings: 2", "  gap: a hole", "  glitch: a spike", "what this log cannot show", "  no rest"]
    assert lines[1] == ""
    assert check._summary(STILL).splitlines()[-1] == "nothing wrong found"
    assert "motion of" not in check._summary(STILL)
    uneven = check._summary(replace(RUN, motion=replace(MOTION, cutoff=None, frequencies=())))
    assert "acceleration up to 286.5 deg/s2 (uneven sampling: differences)" in uneven
    assert "frequencies none Hz" in uneven
    assert len(check._summary(replace(STILL, channels={})).splitlines()) == 2


def test_a_check_of_several_runs_is_a_frame_a_figure_and_data() -> None:
    found = CheckResult((RUN, STILL), RECORDS, 8.0)
    assert found.findings == tuple(RUN.findings)
    assert found.notes == ("--cutoff 8 Hz is not used: no position in two moves",)
    assert replace(found, cutoff=None).notes == ()
    assert CheckResult((RUN,), RECORDS[:1], 8.0).notes == ()
    frame = found.to_frame()
    assert frame.loc[0].tolist() == ["one", "gap", "time", 2.5, 3.0, 51, 101, "a hole"]
    assert frame["kind"].tolist() == ["gap", "coverage", "glitch"]
    assert found.summary() == f"{check._summary(RUN)}\n\n{check._summary(STILL)}"
    assert found.as_json()["runs"]["one"]["clock"] == {"rate": 100.0, "jitter": 0.00012, "gaps": 3}
    assert CheckResult((STILL,), RECORDS[1:]).as_json()["name"] == "two"
    for name, k in (("one", 0), ("two", 1), (None, 0)):
        panels = found.figure(name).panels
        assert np.asarray(panels[1].lines[0].y) == pytest.approx(k - T)
        spans = [[(s.begin, s.end, s.word) for s in panel.spans] for panel in panels]
        hole, spike = (2.5, 3.0, "gap"), (4.0, 4.0, "glitch")
        assert spans == ([[hole], [hole, spike]] if k == 0 else [[], []])


def fit_made(runs: int = 2) -> Any:
    """Of PairedTsmBacklash: c fixed, beta on a bound, alpha undetermined with an interval, x_0 each run's own."""
    model = kernel("PairedTsmBacklash")
    p = {
        v.field: SimpleNamespace(value=0.125 * (k + 1), stderr=None if k == 0 else 0.0625, vary=k > 0)
        for k, v in enumerate(model.parameters)
    }
    score = Agreement("rad", 0.01, 0.05, 0.002, 0.0098, 0.125, 100)
    own = SimpleNamespace(values={"x_0": 0.5}, role="measured", channels={"x_out": score})
    names = ["a", "b", "c"][:runs]
    return SimpleNamespace(
        kernel=model, parameters=p, method="fast", intervals={"alpha": (7.25, 11.5)}, at_bound={"beta"},
        undetermined=("alpha",), per_run=("x_0",), measured={"x_out": score}, holdout={}, findings=("c is held",),
        noise_floor={"x_out": 0.003}, runs={n: own for n in names},
    )  # fmt: skip


def test_a_fit_says_each_parameter_with_what_is_to_be_known_of_it() -> None:
    fit = fit_made()
    card: Any = SimpleNamespace(
        effects=("creep",), parameters={"c": CardParameter(0.5, "1"), "x": CardParameter(2.0, "1")}
    )
    found = IdentifyResult(fit, card, (), (), ("derived v",))
    text = found.summary()
    assert text.splitlines()[:2] == ["derived v", "PairedTsmBacklash+creep, method fast"]
    assert cells(text, "c ") == ["c", "0.125", "1", "fixed"]
    assert cells(text, "beta") == ["beta", "0.25", "0.062", "1", "on a bound"]
    assert cells(text, "alpha") == ["alpha", "0.375", "0.062", "7.25 to 11.5", "1/rad", "not determined"]
    assert cells(text, "x_0") == ["x_0", "0.5", "0.062", "rad", "per run, mean"]
    assert cells(text, "a ") == ["a", "measured", "x_out", "0.573 deg", "2.865 deg", "0.125"]
    assert cells(text, "all ") == ["all", "measured", "x_out", "0.573 deg", "2.865 deg", "0.125"]
    assert "Held-out" not in text
    assert text.splitlines()[-2:] == [
        "Noise floor of x_out: 0.1719 deg, the part that does not repeat from period to period.", "Note: c is held."
    ]  # fmt: skip
    fit.holdout = fit.measured
    assert "Held-out runs: the first 2 s" in found.summary()
    assert found.parameters == {"c": 0.5, "x": 2.0}
    assert found.findings == ("c is held",)
    frame = found.errors()
    assert frame["run"].tolist() == ["a", "b"]
    assert frame["rmse"].tolist() == [0.01, 0.01]
    alone = fit_made(1)
    assert identify._parameter_row(alone, alone.kernel.parameters[3])[-1] == ""  # of one run there is no mean


@pytest.mark.parametrize(("runs", "said"), [(1, "that of the measured run"), (3, "the mean of 3 runs")])
def test_a_fit_says_what_its_card_holds_of_values_that_each_run_has(runs: int, said: str) -> None:
    fit = fit_made(runs)
    fit.runs["late"] = SimpleNamespace(role="holdout")
    (note,) = identify._per_run_notes(fit)
    assert note.startswith(f"each run has its own x_0: the card holds {said} beside them")
    fit.per_run = ()
    assert identify._per_run_notes(fit) == ()


def test_followed_are_those_asked_for_or_those_that_the_card_knows() -> None:
    model = kernel("PairedTsmBacklash")
    errors = {"c": 0.1, "beta": 0.1, "alpha": None, "x_0": 0.1, "x_h_0": None}
    parameters = {v.name: CardParameter(0.5, "1", errors[v.name], fixed=v.name == "beta") for v in model.parameters}
    card = ModelCard("PairedTsmBacklash", "", (), parameters)
    resolved = ResolvedModel(model, "", card)
    per_run = ("x_0", "x_h_0")
    assert track._followed(resolved, (), per_run) == ["c"]
    assert track._followed(resolved, ("alpha", "beta"), per_run) == ["beta", "alpha"]
    for name in ("ghost", "x_0"):
        with pytest.raises(InputError, match=f"--free {name} of PairedTsmBacklash -- expected one of c, beta, alpha "):
            track._followed(resolved, (name,), per_run)
    released = track._released(resolved, ("beta",)).parameters
    assert [n for n in released if released[n].fixed] == []
    assert [n for n in card.parameters if track._released(resolved, ("c",)).parameters[n].fixed] == ["beta"]
    assert released["c"] == parameters["c"]
    assert resolved.values == dict.fromkeys(parameters, 0.5)
    assert resolved.fixed == ("beta",)
    assert (ResolvedModel(model, "", None).values, ResolvedModel(model, "", None).fixed) == ({}, ())


def test_a_card_uses_a_runs_own_values_where_it_holds_them() -> None:
    model = kernel("PairedTsmBacklash")
    values = {**model.named(model.params()), "x_0": 0.25}
    parameters = {v.name: CardParameter(values[v.name], v.quantity.unit) for v in model.parameters}
    resolved = ResolvedModel(model, "", ModelCard("PairedTsmBacklash", "", (), parameters, {"mine": {"x_0": -0.5}}))
    assert resolved.params(run="mine").x_0 == -0.5
    assert resolved.params(run="other").x_0 == 0.25
    assert resolved.params({"x_0": 0.75}, "mine").x_0 == 0.75
    bare = ResolvedModel(model, "published", None)
    assert bare.params({"x_0": 0.75}).x_0 == 0.75
    assert bare.params().alpha == model.params("published").alpha


def point(k: float, failed: str = "") -> Point:
    metrics = {f"e.{n}.peak_to_peak": Metric(k * m, "rad") for m, n in enumerate("abcdef", 1)}
    return Point({"m.k": k, "card": f"/p/{k:g}.toml"}, {} if failed else metrics, failed)


def test_a_sweep_shows_four_numbers_and_draws_the_points_that_did_not_fail() -> None:
    axes = (Axis("m.k", "N/m", (1.0, 2.0, 3.0)), Axis("card", "", ("/p/1.toml",)))
    found = SweepResult("sys", axes, (point(1.0), point(2.0, "it broke"), point(3.0)))
    assert found.failures == ("m.k = 2, card = 2.toml: it broke",)
    text = found.summary()
    assert cells(text, "m.k") == ["m.k", "card", *(f"e.{n}.peak_to_peak [rad]" for n in "abcd")]
    assert cells(text, "3 ") == ["3", "3.toml", "3", "6", "9", "12"]
    assert cells(text, "2 ") == ["2", "2.toml", *["failed"] * 4]
    frame = found.to_frame()
    assert frame["m.k [N/m]"].tolist() == [1.0, 2.0, 3.0]
    assert frame["failed"].tolist() == ["", "it broke", ""]
    assert frame["e.f.peak_to_peak [rad]"].tolist()[::2] == [6.0, 18.0]
    for metric, factor in ((None, 1.0), ("e.c.peak_to_peak", 3.0)):
        (panel,) = found.figure(metric).panels
        assert list(panel.lines[0].x) == [1.0, 3.0]
        assert list(panel.lines[0].y) == [factor, 3.0 * factor]
        assert panel.x_label == "m.k [N/m]"
        assert panel.y_label.endswith(".peak_to_peak [rad]")
    with pytest.raises(InputError, match=r"number 'none' -- expected one of e\.a\.peak_to_peak, "):
        found.figure("none")
    with pytest.raises(InputError, match="sweep of sys -- expected a point that did not fail"):
        replace(found, points=(point(1.0, "no"),)).figure()
    assert "report" not in found.as_json()
    assert replace(found, report=Path("p.html")).as_json()["report"] == "p.html"
    assert found.as_json()["complete"] is True


def test_a_run_tells_its_tracking_error_or_all_its_signals_or_the_numbers_of_its_scenario() -> None:
    signals = {"a.x": Spread(1.5, 0.25, 3.0, "rad"), "b.F": Spread(2.5, 0.5, 4.0, "N")}
    bare = CaseMetrics(Metric(0.0, "s"), Metric(1.0, "s"), signals)
    tracked = replace(bare, tracking_error=Spread(7.5, 8.5, 9.5, "deg"))
    numbers = replace(bare, quantities={"work": Metric(6.25, "J")})
    run = Trajectory(T, {"a.x": T}, {"a.x": "rad"})
    alone = RunResult("s", {"one": run}, {"one": bare}, {}).summary()
    assert cells(alone, "a.x") == ["a.x", "1.5", "0.25", "3", "rad"]
    assert cells(alone, "b.F") == ["b.F", "2.5", "0.5", "4", "N"]
    text = RunResult("s", {"one": run}, {"one": bare, "two": tracked, "three": numbers}, {}, "In order.").summary()
    assert cells(text, "one.a.x")[0] == "one.a.x"
    assert cells(text, "two: ") == ["two: tracking error", "7.5", "8.5", "9.5", "deg"]
    assert cells(text, "three") == ["three", "work", "6.25", "J"]
    assert "two.a.x" not in text
    assert "three.a.x" not in text
    assert text.endswith("\n\nIn order.")


def test_a_step_study_draws_the_four_signals_in_which_the_order_matters_most() -> None:
    """However small they are, but none that rests."""
    sizes = {"a": 0.25, "b": 0.5, "rest": 0.0, "c": 0.125, "d": 1.0, "e": 2.0}
    shares = {"a": 0.4, "b": 0.1, "rest": 0.0, "c": 0.3, "d": 0.2, "e": 0.5}
    signals = tuple(
        SignalStudy(
            n, "m", size, {"gauss-seidel": (size, 0.5 * size), "jacobi": (0.0, 0.0)}, (shares[n] * size, 0.0, 0.0)
        )
        for n, size in sizes.items()
    )
    panel = StepStudyResult("one", (0.5, 0.25, 0.125), signals, 1.0).figure().panels[0]
    assert [line.name for line in panel.lines[::2]] == [f"{n}, gauss-seidel" for n in "eacd"]
    for line in panel.lines[::2]:
        assert list(line.y) == pytest.approx([100.0, 50.0])
    assert panel.log_x


def series(name: str, kind: str, drift: Any, values: tuple[float, ...] = (0.01, 0.05)) -> Any:
    moves = drift is not None and drift.form != "steady"
    return SimpleNamespace(
        name=name, kind=kind, unit="N", values=values, drift=drift, moves=moves, text=f"{name} says"
    )  # fmt: skip


def life() -> track.TrackResult:
    jumps = [SimpleNamespace(size=0.25), SimpleNamespace(size=-0.5)]
    trend = SimpleNamespace(form="trend", begin=1.5, end=2.5, jumps=jumps, p_trend=0.0123, p_jump=0.456)
    steady = SimpleNamespace(form="steady", begin=0.0125, end=0.0625, jumps=[], p_trend=0.5, p_jump=1.0)
    values = [
        {"F_c": SimpleNamespace(value=k + 1.0, stderr=0.1, low=k + 0.8, high=k + 1.2, used=k > 0)} for k in (0, 1)
    ]
    runs = [SimpleNamespace(name=f"day {k}", values=v, rmse={"F": 0.5 + k}) for k, v in enumerate(values, 1)]
    many = [
        series("F_c", "parameter", trend, (1.0, 2.0)),
        series("error of F", "error", steady),
        series("z", "offset", None),
    ]
    return track.TrackResult("M+creep", ("F_c", "z"), cast(Any, tuple(runs)), cast(Any, tuple(many)),
                             {"day 1": "ab", "day 2": ""}, "name", ("a note",))  # fmt: skip


def test_a_life_says_what_moves_and_gives_a_row_for_each_run_and_value() -> None:
    found = life()
    assert found.moving == ("F_c",)
    assert found.answer == "F_c says."
    quiet = replace(found, series=found.series[1:])
    assert quiet.answer == "No drift shown in F_c, z over 2 runs."
    text = found.summary()
    assert text.splitlines()[:2] == ["a note", "M+creep over 2 runs, day 1 to day 2"]
    assert cells(text, "F_c ") == ["F_c", "trend", "1.5 N", "2.5 N", "0.25 N, -0.5 N", "0.012", "0.46"]
    assert cells(text, "error") == ["error of F", "steady", "12.5 mN", "62.5 mN", "0.5", "1"]
    assert cells(text, "z ") == ["z", "too few runs"]
    assert text.splitlines()[-4:] == ["", "F_c says.", "error of F says.", "z says."]
    frame = found.to_frame()
    assert frame[["run", "number", "name", "kind", "value", "used"]].to_numpy().tolist() == [
        ["day 1", 1, "F_c", "parameter", 1.0, False], ["day 2", 2, "F_c", "parameter", 2.0, True],
        ["day 1", 1, "error of F", "error", 1.5, True], ["day 2", 2, "error of F", "error", 2.5, True],
    ]  # fmt: skip
    assert frame["low"].tolist()[:2] == pytest.approx([0.8, 1.8])
    assert all(math.isnan(x) for x in frame["low"][2:])


def test_a_life_is_written_whole_with_the_digests_of_runs_that_have_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[Any] = []
    monkeypatch.setattr("tsm_fmu.tracking.page.write_life", lambda *given: told.append(given))
    monkeypatch.setattr(track.TrackResult, "as_json", lambda self: {"by": self.by})
    for name in ("track.incomplete.csv", "report.html", "other.txt"):
        (tmp_path / name).write_text("old", encoding="utf-8")
    found = life()
    assert found.write(tmp_path) == tmp_path
    assert sorted(p.name for p in tmp_path.iterdir()) == ["other.txt", "track.csv", "track.json"]
    assert json.loads((tmp_path / "track.json").read_text(encoding="utf-8")) == {"by": "name"}
    assert len((tmp_path / "track.csv").read_text(encoding="utf-8").splitlines()) == 5
    ((path, title, *_, by, sources),) = told
    assert (path, title, by) == (tmp_path / "report.html", "M+creep over 2 runs", "name")
    assert sources == {"run 1, day 1": "SHA-256 ab"}
