"""What a system's page says and draws, and which columns of a run are kept."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.cosim import cases, system_report
from tsm_fmu.cosim.metric import BondEnergy, CaseMetrics, Metric
from tsm_fmu.cosim.system import Component, Experiment, Link, System
from tsm_fmu.cosim.trajectory import Trajectory, write_trajectory

T = 2.0 + 0.5 * np.arange(9)
X = np.sin(T)
UNITS = {"motor.phi": "rad", "motor.i": "A", "load.phi": "rad", "reference.y": "rad", "controller.u": "V"}


def run(**columns: np.ndarray) -> Trajectory:
    named = {name.replace("__", "."): values for name, values in columns.items()}
    return Trajectory(T, named, {n: UNITS[n.partition("[")[0]] for n in named})


@pytest.mark.parametrize(
    ("record", "kept"),
    [
        (None, ["motor.phi", "motor.i", "load.phi"]), (["motor"], ["motor.phi", "motor.i"]),
        (["load.phi", "motor.i"], ["motor.i", "load.phi"]), (["ghost"], []), ([], []),
    ],
)  # fmt: skip
def test_columns_are_kept_by_name_or_by_component(record: list[str] | None, kept: list[str]) -> None:
    whole = run(motor__phi=X, motor__i=2 * X, load__phi=3 * X)
    found = whole.only(record)
    assert list(found.columns) == list(found.units) == kept
    assert all(found.columns[n] is whole.columns[n] for n in kept)


def test_an_array_is_kept_by_its_name() -> None:
    whole = Trajectory(T, {"a.x[1]": X, "a.x[2]": X, "a.y": X}, dict.fromkeys(("a.x[1]", "a.x[2]", "a.y"), "1"))
    assert list(whole.only(["a.x"]).columns) == ["a.x[1]", "a.x[2]"]
    assert list(whole.only(["a.x[2]"]).columns) == ["a.x[2]"]


def test_a_whole_run_takes_the_place_of_one_that_ended_early(tmp_path: Path) -> None:
    early = Trajectory(T, {"x": X}, {"x": "m"}, "it broke")
    assert write_trajectory(tmp_path / "r.csv.gz", early) == tmp_path / "r.incomplete.csv.gz"
    assert write_trajectory(tmp_path / "r.csv.gz", Trajectory(T, {"x": X}, {"x": "m"})) == tmp_path / "r.csv.gz"
    assert [p.name for p in tmp_path.iterdir()] == ["r.csv.gz"]


def test_commands_are_drawn_by_unit_and_those_that_cases_share_once() -> None:
    runs = {
        "one": run(reference__y=X, controller__u=X, motor__phi=X), "two": run(reference__y=X, controller__u=2 * X),
    }  # fmt: skip
    (section,) = system_report.commands_section(runs)
    angles, volts = (f.panels[0] for f in section.figures)
    assert [line.name for line in angles.lines] == ["reference.y, one"]
    assert np.asarray(angles.lines[0].y) == pytest.approx(np.degrees(X))
    assert [line.name for line in volts.lines] == ["controller.u, one", "controller.u, two"]
    assert np.asarray(volts.lines[1].y) == pytest.approx(2 * X)
    assert [f.title for f in section.figures] == ["Commands in deg", "Commands in V"]
    assert system_report.commands_section({"one": run(motor__phi=X)}) == []


@pytest.mark.parametrize(
    ("delayed", "said"),
    [
        ((), "One step late: nothing. "),
        ((Link(("a", "y"), ("b", "u"), "Real", 1.0, 0.0),), "One step late: a.y to b.u. "),
    ],
)
def test_a_case_says_its_times_its_order_and_what_is_late(
    delayed: Any, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[Any] = []
    plan = SimpleNamespace(components=("b", "a"), delayed=delayed)
    monkeypatch.setattr(system_report, "check_system", lambda system: system)
    monkeypatch.setattr(system_report, "schedule", lambda wiring, loops: plan)
    monkeypatch.setattr(system_report, "write_report", lambda *given: told.append(given) or given[0])
    case: Any = ("system", Experiment(6.0, 0.5, start=2.0, evaluate_from=3.2))
    one = run(motor__phi=X, motor__i=2 * X, load__phi=3 * X)
    path = system_report.write_system_report(tmp_path / "p.html", "sys", {"c": case}, {"c": one}, {}, "In order.")
    ((_, title, summary, (section, coupling), _),) = told
    assert (path, title, summary) == (tmp_path / "p.html", "sys", "1 system co-simulated.")
    assert section.text == (
        "From 2 to 6 s, communication step 0.5 s, gauss-seidel, in the order b, a. "
        + said
        + "Statistics from 3.5 s on."
    )
    window = T >= 3.5
    rows = {row[0]: row[1:] for row in section.tables[0].rows}
    for name, factor in (("motor.phi", 1), ("motor.i", 2), ("load.phi", 3)):
        values = factor * X[window]
        assert rows[name][0] == UNITS[name]
        assert rows[name][1:] == pytest.approx((values.mean(), values.std(), np.ptp(values)))
    assert [[line.name for line in f.panels[0].lines] for f in section.figures] == [
        ["motor.phi", "load.phi"], ["motor.i"]
    ]  # fmt: skip
    assert coupling.text == "In order."


def test_the_cost_of_a_coupling_is_said_where_it_is_known() -> None:
    own = CaseMetrics(Metric(0.0, "s"), Metric(1.0, "s"), {}, bonds={"a ~ b": BondEnergy(2.0, 1.0, 1.0, 4.0)})
    (section,) = system_report.coupling_section({"one": own}, "")
    assert section.text.startswith("At a power bond")
    assert list(section.tables[0].rows) == [("one", "a ~ b", 2.0, 1.0, 1.0, 25.0)]
    (plain,) = system_report.coupling_section({}, "In order.")
    assert (plain.text, plain.tables) == ("In order.", ())
    assert system_report.coupling_section({}, "") == []


@pytest.mark.parametrize("step_error", [None, 1e-3])
def test_cases_are_run_as_their_experiments_say_without_a_bar(
    step_error: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[dict[str, Any]] = []
    monkeypatch.setattr(cases, "describe", lambda fmu: SimpleNamespace(ports={}))

    def simulate(system: System, stop: float, step: float, **options: Any) -> Trajectory:
        told.append({"name": system.name, "stop": stop, "step": step, **options})
        return run(motor__phi=X)

    system = System((Component("motor", Path("x.fmu")),), ())
    experiment = Experiment(6.0, 0.5, 2.0, "jacobi", "delay", tracking_error="motor.phi", step_error=step_error)
    found = cases.run_cases({"c": (system, experiment)}, record=["motor.phi", "ghost.x"], simulate=simulate)
    assert list(found) == ["c"]
    expected = {"name": "c", "stop": 6.0, "step": 0.5, "start": 2.0, "method": "jacobi", "loops": "delay",
                "record": ["motor.phi"], "progress": False}  # fmt: skip
    assert told == [expected if step_error is None else {**expected, "step_error": step_error}]
    late = Experiment(6.0, 0.5, 2.0, evaluate_from=3.2, tracking_error="motor.phi")
    numbers = cases.statistics({"c": (system, late)}, found, lambda name, _: {"work": Metric(7.0, "J")})["c"]
    assert (numbers.begin.value, numbers.end.value) == (3.5, 6.0)
    assert numbers.tracked().mean == pytest.approx(np.degrees(X[T >= 3.5]).mean())
    assert numbers.quantities == {"work": Metric(7.0, "J")}
