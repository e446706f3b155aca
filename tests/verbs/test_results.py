"""What a result says, draws and gives as data, from numbers that are known: of systems in closed form, of many rigs."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import control
import numpy as np
import pytest

import tsm_fmu
from tsm_fmu.card import CardParameter, ModelCard, Provenance, RecordUsed, read_card, write_card
from tsm_fmu.cosim.linearize import Linear, named
from tsm_fmu.cosim.metric import Metric
from tsm_fmu.cosim.step_study import SignalStudy
from tsm_fmu.cosim.sweep import Axis, Point
from tsm_fmu.cosim.tolerance import Bands
from tsm_fmu.cosim.trajectory import Trajectory
from tsm_fmu.diagnosis.workflow import DiagnosisInterrupted
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import write_record
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.verbs import batch, diagnose, identify, monte_carlo
from tsm_fmu.verbs import report as folder_report
from tsm_fmu.verbs.batch import BatchResult, RigResult, read_rigs
from tsm_fmu.verbs.identify import IdentifyResult
from tsm_fmu.verbs.linearize import LinearizeResult
from tsm_fmu.verbs.monte_carlo import MonteCarloResult
from tsm_fmu.verbs.run import RunResult
from tsm_fmu.verbs.step_study import StepStudyResult

H = 0.01


def integrator(gain: float, design: Any = None, asymmetry: float = 0.0, opened: bool = True) -> LinearizeResult:
    """L = gain / s held over steps: gain h / (z - 1)."""
    model = named(control.ss([[1.0]], [[H]], [[gain]], [[0.0]], H), ["a.u"], ["b.y"])
    response = np.full((1, 1, 501), gain * H)
    linear = Linear(model, response, 3.2e-9, asymmetry, (("(1)/(1)",),), opened, 0.75)
    return LinearizeResult("loop", ("a.u",), ("b.y",), linear, design)


def test_margins_of_an_integrator_and_of_its_design_are_those_of_closed_form():
    """Crossed at gain rad/s in continuous time with 90 deg; held, half a step of delay more."""
    gain = 2.5
    found = integrator(gain, control.tf([gain], [1.0, 0.0]))
    crossover = 2.0 * math.asin(gain * H / 2.0) / H
    phase = 90.0 - math.degrees(crossover * H / 2.0)
    asked, ran = found.design_margins, found.margins
    assert (asked.crossover, asked.phase_margin_deg) == pytest.approx((gain, 90.0), rel=1e-3)
    assert (ran.crossover, ran.phase_margin_deg) == pytest.approx((crossover, phase), rel=1e-3)
    assert ran.delay_margin_s == pytest.approx(math.radians(phase) / crossover, rel=1e-3)
    heading, rows = found.margin_table()
    assert heading == ("margin", "co-simulation", "design", "unit")
    assert [(row[0], row[-1]) for row in rows] == [
        ("crossover", "rad/s"), ("gain margin", "dB"), ("phase margin", "deg"), ("delay margin", "s")
    ]  # fmt: skip
    assert rows[0][1:3] == (ran.crossover, asked.crossover)
    assert rows[3][1:3] == (ran.delay_margin_s, asked.delay_margin_s)
    assert (
        f"crosses at {ran.crossover:.4g} rad/s with {ran.phase_margin_deg:.3g} deg of phase margin (design 2.5 rad/s"
        in (found._answer())
    )
    assert found.as_json()["margins"]["crossover"] == ran.crossover
    assert found.as_json()["design"]["crossover"] == asked.crossover
    alone = integrator(gain)
    assert alone.design_margins is None
    assert alone.margin_table()[0] == ("margin", "co-simulation", "unit")
    assert "design" not in alone._answer()
    assert integrator(gain, opened=False).margins is None
    assert integrator(gain, opened=False).margin_table() == ((), [])


def test_a_bode_plot_has_gain_and_phase_of_the_model_within_its_range():
    found = integrator(2.5, control.tf([2.5], [1.0, 0.0]))
    table = found.to_frame()
    omega = table.index.to_numpy()
    assert omega[0] == pytest.approx(2 * math.pi / (500 * H))
    assert 0.98 * math.pi / H < omega[-1] < math.pi / H
    assert len(omega) == 599
    response = 2.5 * H / (np.exp(1j * omega * H) - 1.0)
    assert table["gain [dB]"].to_numpy() == pytest.approx(20 * np.log10(np.abs(response)))
    assert table["phase [deg]"].to_numpy() == pytest.approx(-90.0 - np.degrees(omega * H / 2))
    assert table["design gain [dB]"].to_numpy() == pytest.approx(20 * np.log10(2.5 / omega))
    assert table["design phase [deg]"].to_numpy() == pytest.approx(-90.0)
    gain, phase = found.figure().panels
    for panel, name in ((gain, "gain [dB]"), (phase, "phase [deg]")):
        assert (panel.x_label, panel.y_label) == ("frequency [rad/s]", name)
        ours, design = panel.lines
        assert (ours.name, ours.dashed, design.name, design.dashed) == ("co-simulation", False, "design", True)
        assert np.asarray(ours.y) == pytest.approx(table[name].to_numpy())
        assert np.asarray(design.y) == pytest.approx(table[f"design {name}"].to_numpy())


@pytest.mark.parametrize(("asymmetry", "said"), [(0.0099, False), (0.0234, True)])
def test_a_system_that_is_not_linear_is_said_to_be_so(asymmetry: float, said: bool):
    text = integrator(2.5, asymmetry=asymmetry).summary()
    assert ("not linear here: impulses up and down differ by 2.3 %" in text) is said
    assert text.startswith("loop: a.u -> b.y, open at t = 0.75 s, order 1, step 0.01 s; left by the model: 3.2e-09")
    assert "closed at t" in integrator(2.5, opened=False).summary()
    closed = integrator(2.5, asymmetry=asymmetry, opened=False)._answer()
    assert ("not linear here" in closed) is said


def test_several_ports_have_a_line_each_and_none_where_nothing_is_heard():
    a = np.diag([0.9, 0.8])
    model = named(control.ss(a, np.eye(2), np.diag([1.0, 2.0]), np.zeros((2, 2)), H), ["a.u", "b.u"], ["a.y", "b.y"])
    linear = Linear(model, np.zeros((2, 2, 101)), 0.0, 0.0, (("1", "1"), ("1", "1")), False, 0.5)
    found = LinearizeResult("two", ("a.u", "b.u"), ("a.y", "b.y"), linear)
    table = found.to_frame()
    assert list(table.columns) == [f"{i} -> {o}: {what}" for o in ("a.y", "b.y") for i in ("a.u", "b.u")
                                   for what in ("gain [dB]", "phase [deg]")]  # fmt: skip
    omega = table.index.to_numpy()
    expected = 20 * np.log10(np.abs(2.0 / (np.exp(1j * omega * H) - 0.8)))
    assert table["b.u -> b.y: gain [dB]"].to_numpy() == pytest.approx(expected)
    assert table["a.u -> b.y: gain [dB]"].isna().all()
    assert [line.name for line in found.figure().panels[0].lines] == [f"{i} -> {o}" for o in ("a.y", "b.y")
                                                                      for i in ("a.u", "b.u")]  # fmt: skip
    assert found.loops == {}
    opened = replace(found, linear=replace(linear, opened=True, returns=(-1.0, -0.5)))
    assert list(opened.loops) == ["a.u", "b.u"]
    assert opened.margins is None


def studied() -> StepStudyResult:
    signals = (
        SignalStudy("a.x", "rad", 2.0, {"gauss-seidel": (0.04, 0.01, 0.0025), "jacobi": (0.08, 0.04, 0.02)},
                    (0.1, 0.05, 0.02, 0.01)),
        SignalStudy("b.F", "N", 50.0, {"gauss-seidel": (1.0, 0.5, 0.25), "jacobi": (0.0, 0.0, 0.0)},
                    (0.001, 0.0, 0.0, 0.0)),
        SignalStudy("c.still", "m", 0.0, {"gauss-seidel": (0.0,) * 3, "jacobi": (0.0,) * 3}, (0.0,) * 4),
    )  # fmt: skip
    return StepStudyResult("one", (0.01, 0.005, 0.0025, 0.00125), signals, 3.0)


def test_a_step_study_tells_orders_differences_and_draws_what_moves_in_percent():
    found = studied()
    assert [s.order("gauss-seidel") for s in found.signals[:2]] == [2.0, 1.0]
    assert found.signals[0].order("jacobi") == 1.0
    assert math.isnan(found.signals[1].order("jacobi"))
    lines = found.summary().splitlines()
    row = next(line.split() for line in lines if line.startswith("a.x"))
    assert row == ["a.x", "2", "0.04", "2.00", "0.08", "1.00", "0.1", "rad"]
    assert next(line.split() for line in lines if line.startswith("b.F"))[4:] == ["0", "-", "0.001", "N"]
    assert "one, steps of 0.01, 0.005, 0.0025, 0.00125 s. " in lines[-1]
    frame = found.to_frame()
    assert frame["step [s]"].tolist() == [0.01, 0.005, 0.0025] * 3
    assert frame.loc[frame["signal"] == "a.x", ["gauss-seidel", "jacobi", "exchange"]].to_numpy().tolist() == [
        [0.04, 0.08, 0.1], [0.01, 0.04, 0.05], [0.0025, 0.02, 0.02]
    ]  # fmt: skip
    (panel,) = found.figure().panels
    assert [(line.name, line.dashed) for line in panel.lines] == [
        ("a.x, gauss-seidel", False), ("a.x, jacobi", True), ("b.F, gauss-seidel", False), ("b.F, jacobi", True)
    ]  # fmt: skip
    assert list(panel.lines[1].y) == pytest.approx([4.0, 2.0, 1.0])
    assert list(panel.lines[0].x) == [0.01, 0.005, 0.0025]
    assert panel.lines[0].colour == panel.lines[1].colour != panel.lines[2].colour
    data = found.as_json()
    assert data["signals"]["a.x"]["order"] == {"gauss-seidel": 2.0, "jacobi": 1.0}
    assert data["steps"] == found.steps


def rig(name: str, failed: str = "", **values: float | str) -> RigResult:
    return RigResult(name, {} if failed else dict(values), failed)


def test_a_batch_tells_the_range_of_each_error_and_where_it_is_largest():
    rigs = [
        rig(f"r{k}", **{"measured rmse x [rad]": 0.1 * (k % 4) + 0.05, "measured rmse F [N]": 9.0 - k})
        for k in range(7)
    ]
    rigs.insert(2, rig("lost", "no file"))
    assert batch._answer(rigs) == (
        "8 rigs, 1 failed. measured rmse x from 0.05 to 0.35 rad, largest at r3. "
        "measured rmse F from 3 to 9 N, largest at r0."
    )
    header, columns = batch._columns(rigs)
    assert header == ["rig", "measured rmse x [rad]", "measured rmse F [N]", "failed"]
    assert np.isnan(columns[1][2])
    assert [str(c) for c in columns[3]] == ["", "", "no file", *[""] * 5]
    found = BatchResult("identify", tuple(rigs), Path("t"), Path("p"))
    assert found.failures == ("lost: no file",)
    assert found.to_frame().loc[3, "measured rmse F [N]"] == 7.0


def test_a_batch_tells_who_has_which_effect_the_most_frequent_first():
    texts = ["wear", "creep, wear", "", "wear", "creep", "wear", "wear, creep", "wear"]
    rigs = [rig(f"r{k}", effects=text, verdict="v") for k, text in enumerate(texts)] + [rig("lost", "why")]
    assert batch._answer(rigs) == (
        "9 rigs, 1 failed. wear: 6 of 8 rigs (r0, r1, r3, r5, r6, ...). creep: 3 of 8 rigs (r1, r4, r6). "
        "nothing named: 1 of 8 rigs (r2)."
    )
    moving = [rig("a", moving="alpha"), rig("b", moving="")]
    assert batch._answer(moving) == ("2 rigs, 0 failed. alpha: 1 of 2 rigs (a). nothing moves: 1 of 2 rigs (b).")


def test_rigs_are_read_with_their_files_by_role_beside_the_table(tmp_path: Path):
    for name in ("b2.csv", "b1.csv", "c.csv"):
        (tmp_path / name).touch()
    table = tmp_path / "rigs.csv"
    table.write_text(
        "\ufeffrig,measured,holdout\n one ,a.csv ; c.csv,\ntwo,b*.csv,c.csv\nthree,n*.csv,\n", encoding="utf-8"
    )
    one, two, three = read_rigs(table)
    assert [r.name for r in (one, two, three)] == ["one", "two", "three"]
    assert one.runs == {"measured": (str(tmp_path / "a.csv"), str(tmp_path / "c.csv")), "holdout": (), "reference": ()}
    assert two.runs["measured"] == (str(tmp_path / "b1.csv"), str(tmp_path / "b2.csv"))
    assert two.runs["holdout"] == (str(tmp_path / "c.csv"),)
    assert three.runs["measured"] == (str(tmp_path / "n*.csv"),)  # which is then said not to exist
    with pytest.raises(InputError, match="expected a CSV of rigs"):
        read_rigs(tmp_path / "none.csv")
    table.write_text("rig,measured\n,a.csv\n", encoding="utf-8")
    with pytest.raises(InputError, match="rig '' -- expected letters and digits"):
        read_rigs(table)


def test_a_page_on_a_folder_has_every_number_of_its_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    told: list[Any] = []
    monkeypatch.setattr(folder_report, "write_report", lambda *given: told.append(given))
    used = (RecordUsed("run", "ab" * 32), RecordUsed("late", "cd" * 32, "holdout"))
    found = {"c": (0.8713, 0.00317), "beta": (-0.2391, None), "alpha": (7.0, 0.1), "x_0": (0.0, None)}
    found["x_h_0"] = found["x_0"]
    parameters = {n: CardParameter(v, "1", e, -2.0, 9.0, n == "beta") for n, (v, e) in found.items()}
    parameters["alpha"] = replace(parameters["alpha"], unit="1/rad")
    parameters |= {n: replace(parameters[n], unit="rad") for n in ("x_0", "x_h_0")}
    card = ModelCard("PairedTsmBacklash", "published", (), parameters, {"run": {"x_0": 0.25}},
                     Provenance(used, seed=7, date="2024-01-02", method="fast"))  # fmt: skip
    write_card(tmp_path / "fit.toml", card)
    time = np.arange(50) * 0.02
    write_record(
        tmp_path / "r.csv", time, {"x": time**2, "y": 1 - time, "F": 2 * time}, {"x": "rad", "y": "rad", "F": "N"}
    )
    gap = {
        "unit": "rad",
        "before": 0.4127,
        "after": None,
        "noise_floor": 0.1,
        "closure": 0.75,
        "closure_interval": [0, 1],
    }
    data = {"verdict": "unknown", "effects": [], "gap": {"x_out": gap}}
    (tmp_path / "diagnosis.json").write_text(json.dumps(data), encoding="utf-8")
    for name in ("a.txt", "b.txt"):
        (tmp_path / name).write_text("12345")
    (tmp_path / "fmus").mkdir()  # a folder is no result
    folder_report.write_folder_report(tmp_path)
    path, title, summary, sections, _ = told[0]
    assert path == tmp_path / "index.html"
    assert (title, summary) == (f"Results in {tmp_path.name}", f"3 results in {tmp_path.name}.")
    diagnosis, fit, run, others = sections
    assert diagnosis.text == "Verdict unknown: no effect."
    assert list(diagnosis.tables[0].rows) == [
        ("x_out", "before", 0.4127, "rad"), ("x_out", "noise floor", 0.1, "rad"), ("x_out", "closure", 0.75, "")
    ]  # fmt: skip
    assert fit.text.startswith("PairedTsmBacklash, from preset published; method fast, seed 7, 2024-01-02, tsm-fmu ")
    values, per_run, records = fit.tables
    assert list(values.rows)[:2] == [
        ("c", 0.8713, 0.00317, "1", -2.0, 9.0, ""),
        ("beta", -0.2391, None, "1", -2.0, 9.0, "fixed"),
    ]
    assert list(per_run.rows) == [("run", "x_0", 0.25)]
    assert list(records.rows) == [("run", "measured", "ab" * 32), ("late", "holdout", "cd" * 32)]
    assert run.text.startswith("50 rows from 0 to 0.98 s; sha256 ")
    rows = {row[0]: row[1:] for row in run.tables[0].rows}
    for name, y in (("x", time**2), ("y", 1 - time), ("F", 2 * time)):
        assert rows[name][1:] == pytest.approx((y.min(), y.max(), y.mean(), y.std()))
    assert [[line.name for line in figure.panels[0].lines] for figure in run.figures] == [["x", "y"], ["F"]]
    assert list(others.tables[0].rows) == [("a.txt", 5), ("b.txt", 5)]
    for name in ("a.txt", "b.txt"):
        (tmp_path / name).unlink()
    folder_report.write_folder_report(tmp_path)
    assert told[1][2] == f"3 results in {tmp_path.name}."


def test_a_fit_is_drawn_over_its_input_or_over_time_without_one(monkeypatch: pytest.MonkeyPatch):
    """Two runs and two channels of unlike unit; what is simulated is twice what was measured."""
    t = 0.1 * np.arange(20)
    runs = [
        FitRun(n, t, np.column_stack([k + t, t]), np.column_stack([k + np.sin(t), 30.0 * t]))
        for k, n in enumerate("ab")
    ]
    monkeypatch.setattr(identify, "run_outputs", lambda _, run: 2.0 * run.targets)
    for name, over in (("TendonDrive", ("x_in [deg]", 180.0 / math.pi)), ("ReferenceSignal", None)):
        measured = {"x": SimpleNamespace(unit="rad"), "F": SimpleNamespace(unit="N")}
        fit = SimpleNamespace(channels=("x", "F"), measured=measured, kernel=kernel(name))
        found = IdentifyResult(cast(Any, fit), cast(Any, None), (), tuple(runs), ())
        for run, channel, k, column, factor, unit in (
            (None, None, 0, 0, 180.0 / math.pi, "deg"), ("b", "F", 1, 1, 1.0, "N"), ("a", "F", 0, 1, 1.0, "N")
        ):  # fmt: skip
            figure = found.figure(run, channel)
            (panel,) = figure.panels
            assert figure.title == f"{('x', 'F')[column]}, run {'ab'[k]}"
            measured_line, fitted_line = panel.lines
            assert (measured_line.dashed, fitted_line.dashed) == (True, False)
            y = factor * runs[k].targets[:, column]
            assert np.asarray(measured_line.y) == pytest.approx(y)
            assert np.asarray(fitted_line.y) == pytest.approx(2.0 * y)
            x = t if over is None else over[1] * runs[k].inputs[:, 0]
            assert np.asarray(fitted_line.x) == pytest.approx(x)
            assert panel.x_label == ("time [s]" if over is None else over[0])
            assert unit in panel.y_label


def test_a_run_is_a_frame_a_figure_and_numbers_by_case():
    t = 0.5 * np.arange(5)
    one = Trajectory(t, {"a.x": t**2, "b.F": 1.0 - t}, {"a.x": "rad", "b.F": "N"}, messages=("warm", "hot"))
    two = Trajectory(2 * t, {"a.x": -t}, {"a.x": "rad"}, messages=("hot",))
    found = RunResult("sys", {"one": one, "two": two}, {}, {}, "the order matters")
    assert found.messages == ("warm", "hot")
    frame = found.to_frame()
    assert list(frame.columns) == ["a.x [rad]", "b.F [N]"]
    assert frame.index.to_list() == t.tolist()
    assert found.to_frame("two")["a.x [rad]"].to_list() == (-t).tolist()
    lines = found.figure().panels[0].lines
    assert [line.name for line in lines] == ["one", "two"]
    assert np.asarray(lines[0].y) == pytest.approx(np.degrees(t**2))
    assert np.asarray(lines[1].x) == pytest.approx(2 * t)
    (alone,) = found.figure("b.F").panels[0].lines
    assert np.asarray(alone.y) == pytest.approx(1.0 - t)
    for call, known in ((lambda: found.figure("c.y"), "a.x, b.F"), (lambda: found.to_frame("three"), "one, two")):
        with pytest.raises(InputError, match=f"expected one of {known} -- correct"):
            call()
    assert found.as_json() == {"metrics": {}, "comparison": {}, "order": "the order matters"}
    written = replace(found, results=Path("r.csv"), report=Path("p.html")).as_json()
    assert (written["results"], written["report"]) == ("r.csv", "p.html")
    assert found.summary() == "the order matters"


def test_bands_of_cases_stand_beside_one_another_where_their_times_are_the_same(tmp_path: Path):
    """Three draws of one parameter; the third case has other times, and is only in the page."""

    def made(n: int, level: float) -> Bands:
        t = np.linspace(0.0, 1.0, n)
        return Bands(t, level + t, level + np.arange(5.0)[:, None] + t, "rad")

    def point(k: float) -> Point:
        return Point({"draw": k, "m.k": 1.5 + k}, {f"{case}.e.std": Metric(2.0 + k, "rad") for case in ("a", "b", "c")})

    axes = (Axis("draw", "1", (1.0, 2.0, 3.0)), Axis("m.k", "N/m", (2.5, 3.5, 4.5)))
    draws = (*map(point, (1.0, 2.0)), Point({"draw": 3.0, "m.k": 4.5}, {}, "it broke"))
    bands = {"a": made(5, 0.0), "b": made(5, 10.0), "c": made(9, 20.0)}
    result = MonteCarloResult("sys", "e.y", axes, point(0.0), draws, bands, ("a note",))
    assert result.failures == ("draw 3: it broke",)
    found = monte_carlo._written(result, tmp_path)
    lines = (tmp_path / "bands.csv").read_text(encoding="utf-8").splitlines()
    names = ("nominal", "p2.5", "p25", "p50", "p75", "p97.5")
    assert lines[0].split(",") == ["time [s]", *(f"{case}.{n} [rad]" for case in "ab" for n in names)]
    assert [float(x) for x in lines[2].split(",")] == [
        0.25, *(0.25 + x for x in (0, 0, 1, 2, 3, 4)), *(10.25 + x for x in (0, 0, 1, 2, 3, 4))
    ]  # fmt: skip
    assert len(lines) == 6
    assert found.report == tmp_path / "report.html"
    alone = monte_carlo._written(replace(result, bands={"c": bands["c"]}), tmp_path / "alone")
    head = (tmp_path / "alone" / "bands.csv").read_text(encoding="utf-8").splitlines()[0]
    assert head.split(",")[1] == "nominal [rad]"
    frame = alone.to_frame()
    assert frame["m.k [N/m]"].tolist() == [2.5, 3.5, 4.5]
    assert frame["a.e.std [rad]"].tolist()[:2] == [3.0, 4.0]
    assert frame["failed"].tolist() == ["", "", "it broke"]
    assert result.figure().title.startswith("e.y, a")
    with pytest.raises(InputError, match="case 'd' -- expected one of a, b, c"):
        result.figure("d")


def test_an_interrupted_diagnosis_keeps_the_refitted_card_in_its_folder_and_passes_what_was_set(tmp_path, monkeypatch):
    """With a preset and a value set; without a folder nothing is kept."""
    given: list[dict[str, Any]] = []

    def find(model: Any, runs: Any, **options: Any) -> None:
        given.append({"model": model.name, "runs": [r.name for r in runs], **options})
        raise DiagnosisInterrupted(card)

    parameters = {v.name: CardParameter(v.start, v.quantity.unit, None) for v in kernel("PairedTsmBacklash").parameters}
    card = ModelCard("PairedTsmBacklash", "published", (), parameters)
    monkeypatch.setattr(diagnose, "find", find)
    runs = [tsm_fmu.sample("sine")]
    with pytest.raises(
        KeyboardInterrupt, match="interrupted before an answer; PairedTsmBacklash as refitted is kept in"
    ):
        diagnose.diagnose("PairedTsmBacklash:published", runs, values={"alpha": 9.0}, out=tmp_path, seed=5)
    assert read_card(tmp_path / "card.incomplete.toml").parameters == card.parameters
    with pytest.raises(DiagnosisInterrupted):
        diagnose.diagnose(replace(card, preset=""), runs)
    first, second = given
    assert (first["preset"], first["seed"], first["values"]["alpha"]) == ("published", 5, 9.0)
    assert second["preset"] is None
    assert first["runs"] == [runs[0].name]
