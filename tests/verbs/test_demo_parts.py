"""The parts of the demo and its page, on runs and results made up here."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tsm_fmu.card import CardParameter, ModelCard
from tsm_fmu.cosim.metric import CaseMetrics, Metric, Spread
from tsm_fmu.cosim.trajectory import Trajectory
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.scenarios import mssp_feedforward
from tsm_fmu.verbs import demo

DEG = 180.0 / np.pi
T = 3.0 + 0.01 * np.arange(501)
X = 0.6 * np.sin(1.9 * T)


def spread(peak_to_peak: float) -> Spread:
    return Spread(peak_to_peak / 7, peak_to_peak / 11, peak_to_peak, "deg")


METRICS = {
    name: CaseMetrics(Metric(10.0, "s"), Metric(20.0, "s"), {}, spread(7.77 / (k + 1)))
    for k, name in enumerate(demo.CASES)
}
RUNS = {name: Trajectory(T, {"error.y": k + X}, {"error.y": "rad"}) for k, name in enumerate(demo.CASES)}


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_fmu(kernel("PairedTsmBacklash"), tmp_path_factory.mktemp("unit") / "Drive.fmu", platforms=["linux64"])


def test_a_replay_is_judged_after_the_transient_beside_the_best_line(unit: Path) -> None:
    """The measurement is the model's own output with x_0 = 0.02, and far off in the two seconds that do not count."""
    model = kernel("PairedTsmBacklash")
    values = {**model.named(model.params()), "c": 0.9, "beta": -0.4, "x_0": 0.05}
    y = model.simulate(model.params(values={**values, "x_0": 0.02}), T, X[:, None])[:, 0]
    scored = np.arange(501) >= 200  # the first 2 s
    measured = np.where(scored, y, 9.0)
    record = Record("one", T, {"x_in": X, "x_out": measured}, {"x_in": "rad", "x_out": "rad"})
    card = ModelCard("PairedTsmBacklash", "", (), {v.name: CardParameter(values[v.name], v.quantity.unit)
                                                  for v in model.parameters})  # fmt: skip
    own = {n: v for n, v in values.items() if n not in ("x_0", "x_h_0")}
    fmu = build_fmu(model, unit.parent / "Fitted.fmu", start_values={**own, "x_0": 0.4}, platforms=["linux64"])
    fitted: Any = SimpleNamespace(runs={"one": SimpleNamespace(values={"x_0": 0.12, "x_h_0": values["x_h_0"]})})
    found = demo._replayed(fmu, card, fitted, record)
    assert found["rmse"].unit == found["line"].unit == "deg"
    assert found["rmse"].value == pytest.approx(0.1 * DEG, rel=1e-6)  # the run's own offset against the true one
    _, (left,), *_ = np.linalg.lstsq(np.column_stack([X[scored], np.ones(301)]), y[scored], rcond=None)
    assert found["line"].value == pytest.approx(DEG * np.sqrt(left / 301), rel=1e-9)
    assert found["from_kernel"] < 1e-9
    assert found["lost_motion"](y) == pytest.approx(y - 0.9 * X - 0.12)
    assert found["run"].columns["x_out"].shape == (501,)


def test_a_replay_is_drawn_as_loop_lost_motion_history_and_error_in_degrees() -> None:
    y = 0.9 * X + 0.03 * np.cos(T)
    record = Record("one", T, {"x_in": X, "x_out": y}, {"x_in": "rad", "x_out": "rad"})
    simulated = y + 0.001 * T
    found = {
        "run": Trajectory(T, {"x_out": simulated}, {"x_out": "rad"}),
        "rmse": Metric(0.1234, "deg"), "line": Metric(5.678, "deg"), "from_kernel": 3.2e-13,
        "lost_motion": lambda angle: angle - 0.9 * X,
    }  # fmt: skip
    section = demo._replay_section(record, found, "fitted")
    assert section.title == "one (fitted): measured and replayed through the FMU"
    assert section.text.startswith("RMSE 0.123 deg from 2 s on; the best straight line 5.678 deg. ")
    assert section.text.endswith("at most 3.2e-13 rad.")
    loop, lost, history, error = (figure.panels[0] for figure in section.figures)
    late = slice(200, None)
    for panel, over, parts in (
        (loop, DEG * X[late], (DEG * y[late], DEG * simulated[late])),
        (lost, DEG * X[late], (DEG * (y - 0.9 * X)[late], DEG * (simulated - 0.9 * X)[late])),
        (history, T, (DEG * y, DEG * simulated)),
    ):
        assert [(line.name, line.dashed) for line in panel.lines] == [("measured", True), ("FMU", False)]
        for line, part in zip(panel.lines, parts, strict=True):
            assert np.asarray(line.x) == pytest.approx(over)
            assert np.asarray(line.y) == pytest.approx(part)
    (line,) = error.lines
    assert np.asarray(line.y) == pytest.approx(DEG * 0.001 * T)
    assert (loop.y_label, lost.y_label, error.y_label) == ("x_out [deg]", "x_out - c x_in - x_0 [deg]", "deg")


def test_fitted_parameters_are_told_in_the_order_of_the_model_with_findings_as_sentences() -> None:
    model = kernel("PairedTsmBacklash")
    found = {v.field: SimpleNamespace(value=0.1 * k, stderr=0.01 * k) for k, v in enumerate(model.parameters)}
    fitted: Any = SimpleNamespace(kernel=model, parameters=found, findings=("c is small", "alpha is on a bound"))
    section = demo._parameters(fitted)
    assert section.text == "C is small. Alpha is on a bound."
    assert [(row[0], row[1], row[2], row[3]) for row in section.tables[0].rows] == [
        (v.name, 0.1 * k, 0.01 * k, v.quantity.unit) for k, v in enumerate(model.parameters)
    ]


def test_the_loop_stands_beside_its_closed_form_and_the_paper() -> None:
    """10.5 deg without compensation and 3 with it are printed; a plant of the same loop width has no closed form."""
    section = demo._loop_section(RUNS, METRICS)
    forms = mssp_feedforward.closed_forms()
    rows = [tuple(row) for row in section.tables[0].rows]
    assert [row[0] for row in rows] == ["uncompensated", "law_1", "b065_law_1"]
    assert [row[1] for row in rows] == pytest.approx([7.77, 7.77 / 2, 7.77 / 3])
    assert [row[2] for row in rows] == pytest.approx([7.77 / 7 / k for k in (1, 2, 3)])
    assert [row[3] for row in rows] == pytest.approx([7.77 / 11 / k for k in (1, 2, 3)])
    assert [row[4] for row in rows] == [forms["uncompensated"].value, forms["law_1"].value, None]
    assert [row[5] for row in rows] == [10.5, 3.0, 3.0]
    assert f"better than {forms['law_1'].value:.2f} deg" in section.text
    lines = section.figures[0].panels[0].lines
    assert [line.name for line in lines] == ["uncompensated", "law_1", "b065_law_1"]
    for k, line in enumerate(lines):
        assert np.asarray(line.x) == pytest.approx(T)
        assert np.asarray(line.y) == pytest.approx(DEG * (k + X))


def test_fmus_are_told_with_their_size_and_what_is_wrong_with_them(unit: Path) -> None:
    broken = unit.parent / "Broken.fmu"
    with zipfile.ZipFile(broken, "w") as archive:
        archive.writestr("a.txt", "x" * 5000)
        archive.writestr("b.txt", "")
    section = demo._fmu_section({"Drive": unit, "Broken": broken})
    assert section.text == f"In {unit.parent}."
    first, second = section.tables[0].rows
    with zipfile.ZipFile(unit) as archive:
        assert first == ("Drive", f"{unit.stat().st_size / 1024:.0f} kB", len(archive.namelist()), "valid")
    assert second[:3] == ("Broken", "5 kB", 2)
    assert "modelDescription" in second[3]


def test_the_page_says_both_replays_and_the_width_beside_the_papers(
    unit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[Any] = []
    monkeypatch.setattr(demo, "write_report", lambda *given: told.append(given) or given[0])
    records = [
        replace(Record(name, T, {"x_in": X, "x_out": X}, {"x_in": "rad", "x_out": "rad"}), sha256=name * 3)
        for name in ("ab", "cd")
    ]
    replays = {
        name: {"run": Trajectory(T, {"x_out": X}, {"x_out": "rad"}), "rmse": Metric(0.25 * (k + 1), "deg"),
               "line": Metric(4.0 + k, "deg"), "from_kernel": 0.0, "lost_motion": lambda angle: angle}
        for k, name in enumerate(("ab", "cd"))
    }  # fmt: skip
    fitted: Any = SimpleNamespace(kernel=SimpleNamespace(name="M", parameters=()), parameters={}, findings=(), seed=3)
    path = demo._report(tmp_path, {"Drive": unit}, RUNS, METRICS, fitted, replays, records)
    ((place, title, summary, sections, provenance),) = told
    assert path == place == tmp_path / "report.html"
    assert title == "tsm-fmu demo"
    numbers = [float(x) for x in re.findall(r"\d+\.\d+", cast(str, summary))]
    assert numbers == [0.25, 4.0, 0.5, 5.0, 7.77, 10.5]
    assert [section.title.partition(":")[0] for section in sections] == [
        "ab (fitted)", "cd (not fitted)", "Fitted parameters of M", "Closed loop of MSSP 2015, co-simulated",
        "FMUs built",
    ]  # fmt: skip
    assert (provenance["seed"], provenance["ab (sha256)"]) == (3, "ababab")
