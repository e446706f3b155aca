"""What verbs write into their folders, from results made up here."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import control
import numpy as np
import pytest

import tsm_fmu as tsm
from tsm_fmu.card import CardParameter, ModelCard
from tsm_fmu.cosim.linearize import Linear, named
from tsm_fmu.cosim.metric import CaseMetrics, Metric, Spread
from tsm_fmu.cosim.sweep import Axis, Point
from tsm_fmu.cosim.trajectory import SimulationInterrupted, SimulationStopped, Trajectory
from tsm_fmu.models.contract import InputError
from tsm_fmu.verbs import batch, linearize, points
from tsm_fmu.verbs import run as run_verb
from tsm_fmu.verbs.batch import Rig, RigResult, RigWork
from tsm_fmu.verbs.linearize import LinearizeResult
from tsm_fmu.verbs.points import How
from tsm_fmu.verbs.run import RunResult
from tsm_fmu.verbs.systems import Opened

H = 0.01


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What the page of a batch, and that of a linearisation, is made of."""
    told: list[Any] = []
    for module in (batch, linearize):
        monkeypatch.setattr(module, "write_report", lambda *given: told.append(given) or given[0])
    return told


def rigs() -> list[RigResult]:
    """Eleven rigs with errors 0, 1, ..., 10 but for a sign, one without, one that failed."""
    found = [
        RigResult(f"r{k}", {"c [1]": -float(k) if k == 10 else float(k), "c stderr [1]": 0.5, "findings": f"f{k}"})
        for k in range(11)
    ]
    return [*found, RigResult("bare", {"findings": ""}), RigResult("lost", {}, "no file")]


def test_the_page_of_a_batch_has_the_spread_of_each_number_and_a_row_for_each_rig(tmp_path: Path, told: Any) -> None:
    batch._page(tmp_path, "identify", "/models/wrist.toml", rigs())
    ((path, title, answer, (section,), provenance, picture),) = told
    assert (path, title, picture) == (tmp_path / "report.html", "identify of wrist.toml over 13 rigs", None)
    assert answer == "13 rigs, 1 failed."
    assert section.text.startswith("13 rigs, 1 failed. ")
    assert provenance == {"tsm-fmu": tsm.__version__}
    spread, whole = section.tables
    (row,) = spread.rows
    assert row == ("c [1]", -10.0, 4.0, 9.0, "r10")  # of -10, 0, 1, ..., 9: the largest magnitude is at r10
    assert whole.heading == ["rig", "c [1]", "c stderr [1]", "findings", "failed"]
    assert whole.rows[3] == ["r3", 3.0, 0.5, "f3", ""]
    assert whole.rows[12][0::4] == ["lost", "no file"]
    assert np.isnan(whole.rows[12][1])
    batch._page(tmp_path, "diagnose", "Sum", [RigResult("r", {"effects": "creep"}), RigResult("s", {}, "why")])
    assert len(told[1][3][0].tables) == 1  # no number, no spread
    assert told[1][5].panels[0].bars == {"creep": 1.0}


def test_a_summary_of_rigs_has_six_columns_and_no_standard_errors() -> None:
    values = {f"n{k} [N]": 0.125 * k for k in range(9)}
    found = batch.BatchResult("identify", (RigResult("a", {"c stderr [1]": 7.5, **values}),), Path("t"), Path("p"))
    heading, _, row = found.summary().splitlines()
    assert heading.split("  ")[0].strip() == "rig"
    assert [n for n in range(9) if f"n{n} [N]" in heading] == [0, 1, 2, 3, 4]
    assert row.split() == ["a", "0", "0.125", "0.25", "0.375", "0.5"]
    assert found.as_json() == {
        "verb": "identify", "results": "t", "report": "p",
        "rigs": [{"rig": "a", "values": {"c stderr [1]": 7.5, **values}, "failed": ""}],
    }  # fmt: skip


def test_a_rig_gives_its_numbers_by_verb_and_what_was_wrong_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Any] = []
    score = SimpleNamespace(rmse=0.25, unit="rad")
    parameters = {"c": CardParameter(1.5, "1", 0.125), "k": CardParameter(2.5, "N", None)}
    written: list[Path] = []
    fitted = SimpleNamespace(
        card=ModelCard("Sum", parameters=parameters), write_card=written.append, findings=("one", "two"),
        complete=True, fit=SimpleNamespace(measured={"x": score}, holdout={"x": replace_rmse(score, 0.75)}),
    )  # fmt: skip
    diagnosed = SimpleNamespace(verdict="named", effects=("creep", "wear"), answer="It creeps.", complete=True)
    tracked = SimpleNamespace(runs=(1, 2, 3), moving=("c", "k"), answer="It moves.")
    for name, result in (("identify", fitted), ("diagnose", diagnosed), ("track", tracked)):

        def verb(*some: Any, _result: Any = result, **options: Any) -> Any:
            given.append((some, options))
            return _result

        monkeypatch.setattr(f"tsm_fmu.verbs.{name}.{name}", verb)
    rig = Rig("north", {"measured": ("a", "b"), "holdout": ("c",), "reference": ("d",)})
    found = {v: RigWork(v, "Sum", tmp_path / "out", {"seed": 3})(rig) for v in ("identify", "diagnose", "track")}
    assert found["identify"].values.pop("k stderr [N]") != 0.0  # pyright: ignore[reportAttributeAccessIssue]
    assert found["identify"].values == {
        "c [1]": 1.5, "c stderr [1]": 0.125, "k [N]": 2.5, "measured rmse x [rad]": 0.25, "holdout rmse x [rad]": 0.75,
        "findings": "one; two",
    }  # fmt: skip
    assert written == [tmp_path / "out" / "north" / "card.toml"]
    assert found["diagnose"].values == {"verdict": "named", "effects": "creep, wear", "answer": "It creeps."}
    assert found["track"].values == {"runs": 3.0, "moving": "c, k", "answer": "It moves."}
    folder = tmp_path / "out" / "north"
    assert [options for _, options in given] == [
        {"holdout": ("c",), "seed": 3}, {"holdout": ("c",), "reference": ("d",), "out": folder, "seed": 3},
        {"out": folder, "seed": 3},
    ]  # fmt: skip
    assert [some for some, _ in given] == [("Sum", ("a", "b"))] * 3
    assert [one.failed for one in found.values()] == [""] * 3
    monkeypatch.setattr("tsm_fmu.verbs.track.track", lambda *_, **__: (_ for _ in ()).throw(InputError("too few")))
    assert RigWork("track", "Sum", tmp_path / "out", {})(rig) == RigResult("north", {}, "too few")
    (tmp_path / "file").write_text("")
    failed = RigWork("track", "Sum", tmp_path / "file", {})(rig).failed
    assert failed.startswith(f"{tmp_path / 'file' / 'north'}: ")
    assert failed.endswith("-- expected a writable folder")


def replace_rmse(score: Any, rmse: float) -> Any:
    return SimpleNamespace(**{**vars(score), "rmse": rmse})


def linear(gain: float, step: float = H, asymmetry: float = 0.0, opened: bool = True) -> LinearizeResult:
    """``gain / s``, held over steps, or in continuous time."""
    model = named(control.ss([[0.0 if step == 0.0 else 1.0]], [[step or 1.0]], [[gain]], [[0.0]], step), ["u"], ["y"])
    found = Linear(model, np.full((1, 1, 501), gain * H), 0.0, asymmetry, (("(1)/(1)",),), opened, 0.75)
    return LinearizeResult("loop", ("u",), ("y",), found)


def test_the_page_of_a_linearisation_says_margins_and_how_far_it_is_not_linear(tmp_path: Path, told: Any) -> None:
    assert linear(2.5, asymmetry=0.0625).write(tmp_path) == tmp_path / "report.html"
    linear(2.5, opened=False).write(tmp_path)
    (_, title, answer, (section,), _), (_, _, closed, (bare,), _) = told
    assert title == "loop: u to y"
    assert "the loop as it runs crosses at 2.5 rad/s" in answer
    assert section.text.endswith("here the answers differ by 6.2 %.")
    assert section.text.startswith("Gain and phase at the communication points")
    assert section.tables[0].rows[0][0] == "crossover"
    assert bare.tables == []
    assert closed.startswith("loop: u -> y, closed at t = 0.75 s")
    assert len(section.figures[0].panels) == 2


@pytest.mark.parametrize("sizes", [(100, 90), (4001, 6000), (8100, 8100)])
def test_the_common_results_of_several_cases_have_about_2000_rows(
    sizes: tuple[int, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[Any] = []
    scenario = SimpleNamespace(write_scenario_report=lambda *given: told.append(given) or given[0])
    systems: list[tuple[Path, Any]] = []
    monkeypatch.setattr(run_verb, "write_ssp", lambda path, case: systems.append((path, case)))
    monkeypatch.setattr(run_verb, "commands_section", lambda cases: [f"commands of {len(cases)}"])
    monkeypatch.setattr(run_verb, "coupling_section", lambda metrics, order: [order])
    runs = {n: Trajectory(H * np.arange(s), {"a.x": np.arange(float(s))}, {"a.x": "rad"})
            for n, s in zip(("slow.one", "fast"), sizes, strict=True)}  # fmt: skip
    system: Any = SimpleNamespace(name="s", cases=dict.fromkeys(runs, "case"), scenario=scenario)
    for file in ("results.csv", "report.html", "other"):
        (tmp_path / file).write_text("old")
    found = run_verb._written(RunResult("s", runs, {}, {"paper": 1}, "In order."), system, tmp_path)
    assert (found.results, found.report) == (tmp_path / "results.csv", tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()  # of an earlier run; this one's writer is stood in for
    lines = (tmp_path / "results.csv").read_text(encoding="utf-8").splitlines()
    every = max(1, min(sizes) // 2000)
    assert len(lines) - 1 == -(-min(sizes) // every)
    assert [float(cell) for cell in lines[2].split(",")] == pytest.approx([H * every, every, every])
    assert [path for path, _ in systems] == [tmp_path / "systems" / "slow_one.ssp", tmp_path / "systems" / "fast.ssp"]
    assert told[0][3] == {"paper": 1, "ending": ["commands of 2", "In order."]}
    alone: Any = SimpleNamespace(name="s", cases={"fast": "case"}, scenario=scenario)
    run_verb._written(RunResult("s", {"fast": runs["fast"]}, {}, {}, ""), alone, tmp_path)
    assert systems[-1][0] == tmp_path / "s.ssp"
    assert len((tmp_path / "results.csv").read_text(encoding="utf-8").splitlines()) == 1 + sizes[1]


def test_an_interrupt_while_orders_are_compared_keeps_the_cases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Trajectory(H * np.arange(5), {"a.x": np.arange(5.0), "a.v": np.ones(5)}, {"a.x": "rad", "a.v": "1"})

    def stopped(*_: Any, **__: Any) -> str:
        raise SimulationInterrupted(run)

    monkeypatch.setattr(run_verb, "compared", stopped)
    monkeypatch.setattr(run_verb, "present", lambda system, record: record)
    system: Any = SimpleNamespace(cases={"one": ("case", None)}, record=["a.x"], simulate=None)
    with pytest.raises(SimulationInterrupted) as caught:
        run_verb._order(system, {"one": run}, None)
    assert list(caught.value.trajectory.columns) == ["a.x"]
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SimulationInterrupted):
        run_verb._order(system, {"one": run}, tmp_path)
    (kept,) = tmp_path.iterdir()
    assert len(kept.read_text(encoding="utf-8").splitlines()) == 6


AXES = (Axis("m.k", "1", (1.0, 2.0, 3.0)),)
GRID = [{"m.k": k} for k in (1.0, 2.0, 3.0)]


def found_at(values: Any) -> Point:
    return Point(values, {"e.mean": Metric(2.0 * values["m.k"], "rad")}, "it broke" if values["m.k"] == 2.0 else "")


def batched(monkeypatch: pytest.MonkeyPatch, until: int = 3) -> list[Any]:
    """Points done one after the other by `found_at`; an interrupt after so many of them."""
    told: list[Any] = []

    def run_batch(work: Any, given: Any, done: dict[int, Point], **how: Any) -> None:
        told.append((work, dict(done), how))
        for number, values in list(enumerate(given))[:until]:
            if number not in done:
                done[number] = found_at(values)
                how["keep"](number, done[number])
        if until < len(given):
            raise KeyboardInterrupt

    monkeypatch.setattr(points, "run_batch", run_batch)
    return told


def test_points_that_an_earlier_call_left_are_not_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there: Any = SimpleNamespace()
    system = Opened("s", {}, ["e.y"], None, there)
    notes: list[str] = []
    how = How(2, "tcp://x:1", True, 5.0, False, notes.append)

    def run(folder: Path | None, traced: str = "", kind: str = "sweep") -> list[Point]:
        return points.run_points(
            system=system,
            axes=AXES,
            points=GRID,
            folder=folder,
            how=how,
            changes={},
            settings={"m.j": "3"},
            traced=traced,
            kind=kind,
        )

    told = batched(monkeypatch, until=2)
    with pytest.raises(KeyboardInterrupt, match=r"^$"):
        run(None)
    with pytest.raises(KeyboardInterrupt, match=r"interrupted; 2 points kept in .*draws\.incomplete\.csv"):
        run(tmp_path, kind="draws")
    assert {p.name for p in tmp_path.iterdir()} == {
        "draws.points.jsonl", *(f"draws.incomplete.{e}" for e in ("csv", "json", "parquet"))
    }  # fmt: skip
    told += batched(monkeypatch)
    told = batched(monkeypatch)
    assert run(tmp_path, kind="draws") == [found_at(v) for v in GRID]
    assert notes == ["2 of 3 points kept from a draws that did not end"]
    ((work, done, options),) = told
    assert done == {k: found_at(GRID[k]) for k in (0, 1)}
    assert (work.record, work.settings, work.traced) == (["e.y"], {"m.j": "3"}, "")
    assert (options["workers"], options["scheduler"]) == (2, "tcp://x:1")
    assert not (tmp_path / "draws.points.jsonl").exists()
    assert run(None, traced="e.y") == [found_at(v) for v in GRID]
    assert told[-1][0].traced == "e.y"
    assert len(notes) == 1


def test_a_sweep_of_which_all_points_failed_is_an_error_that_says_the_first() -> None:
    bad = [replace(found_at(v), failed=f"no {v['m.k']:g}") for v in GRID]
    with pytest.raises(InputError, match="all 3 points failed, the first: no 1"):
        points._some_good(bad)
    assert points._some_good([*bad[:2], found_at(GRID[2])])[2].failed == ""


def test_rigs_of_a_batch_that_ended_early_are_not_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a.csv", "b.csv", "m.toml"):
        (tmp_path / name).write_text(name)
    table = tmp_path / "rigs.csv"
    table.write_text("rig,measured\nnorth,a.csv\nsouth,b.csv\n", encoding="utf-8")
    told: list[Any] = []

    def run_batch(work: Any, given: Any, done: dict[int, RigResult], **how: Any) -> None:
        told.append((work, [rig.name for rig in given], dict(done), how["workers"]))
        for number, rig in enumerate(given):
            done[number] = RigResult(rig.name, {"c [1]": 1.5 + number}, "broken" if number else "")
            how["keep"](number, done[number])
            if len(told) == 1:
                raise KeyboardInterrupt

    monkeypatch.setattr(batch, "run_batch", run_batch)
    notes: list[str] = []

    def run(verb: str = "track", **options: Any) -> Any:
        more = {"workers": 3, "notes": notes.append, **options}
        return tsm.batch(verb=verb, model=tmp_path / "m.toml", table=table, out=tmp_path / "out", **more)

    with pytest.raises(KeyboardInterrupt):
        run(seed=2)
    found = run(seed=2)
    assert notes == ["1 of 2 rigs kept from a batch that did not end"]
    work, names, done, workers = told[1]
    assert (work.verb, work.model, work.options, workers) == ("track", str(tmp_path / "m.toml"), {"seed": 2}, 3)
    assert (names, list(done)) == (["north", "south"], [0])
    assert found.failures == ("south: broken",)
    assert found.results == tmp_path / "out" / "rigs.parquet"
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["report.html", "rigs.csv", "rigs.parquet"]
    run(seed=3)
    assert told[2][2] == {}
    with pytest.raises(InputError, match="verb 'check' -- expected one of identify, diagnose, track -- choose one"):
        run("check")
    monkeypatch.setattr(batch, "run_batch", lambda work, given, done, **_: done.update(
        {k: RigResult(rig.name, {}, f"no {rig.name}") for k, rig in enumerate(given)}
    ))  # fmt: skip
    with pytest.raises(InputError, match="all 2 rigs failed -- expected one that does not -- the first: no north"):
        run()


@pytest.mark.parametrize("error", [SimulationStopped, SimulationInterrupted])
def test_rows_until_a_run_stopped_are_kept_in_its_folder(
    error: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Trajectory(H * np.arange(4), {"a.x": np.arange(4.0)}, {"a.x": "rad"}, incomplete="the belt slipped")

    @contextmanager
    def opened(*_: Any) -> Any:
        yield SimpleNamespace(cases={}, record=None, simulate=None)

    def stopped(*_: Any, **__: Any) -> Any:
        raise SimulationStopped("it slipped", run) if error is SimulationStopped else SimulationInterrupted(run)

    monkeypatch.setattr(run_verb, "opened", opened)
    monkeypatch.setattr(run_verb, "recorded_too", lambda cases, record: record)
    monkeypatch.setattr(run_verb, "run_cases", stopped)
    with pytest.raises(error) as plain:
        tsm.run("x.ssp")
    assert "kept" not in str(plain.value)
    with pytest.raises(error, match="kept in"):
        tsm.run("x.ssp", out=tmp_path)
    (kept,) = tmp_path.iterdir()
    assert kept.name.startswith("results.incomplete")
    assert len(kept.read_text(encoding="utf-8").splitlines()) == 5


def test_the_statistics_of_a_case_are_kept_beside_what_its_bonds_lose() -> None:
    """A run of two cases says the numbers of each, in the order of the cases."""
    own = CaseMetrics(Metric(0.0, "s"), Metric(1.0, "s"), {"a.x": Spread(1.0, 2.0, 3.0, "rad")})
    run = Trajectory(H * np.arange(3), {"a.x": np.arange(3.0)}, {"a.x": "rad"})
    found = RunResult("s", {"one": run, "two": run}, {"one": own, "two": own}, {})
    assert [line.split()[0] for line in found.summary().splitlines()[2:]] == ["one.a.x", "two.a.x"]
    assert list(found.as_json()["metrics"]) == ["one", "two"]
