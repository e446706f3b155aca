"""Sweeps: numbers against closed forms, failed points, interruption, wrong calls; the verb and its files."""

import json
import os
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.cli.app import run
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Experiment, System
from tsm_fmu.logs.table import read_table

TIMING = Experiment(stop=0.8, step=0.01)


def ramp(foreign):
    return System((Component("x", foreign["integrator"], {"u": 1.7, "x_0": -0.4}),), ()), TIMING


def belt(foreign, **values):
    return System((Component("belt", foreign["failing"], {"t_fail": 0.37, **values}),), ()), TIMING


def swept(tmp_path, case, *arguments):
    path = write_ssp(tmp_path / "system.ssp", case)
    return run(["sweep", str(path), *arguments, "--out", str(tmp_path / "out")])


def test_a_grid_gives_the_closed_form_at_every_point(foreign, tmp_path, capsys):
    """X = x_0 + u t: the mean is that of the middle, the peak-to-peak value u times the time."""
    vary = ["--vary", "x.u=-1.3:2.9:4", "--vary", "x.x_0=0.25:7.75:3"]
    assert swept(tmp_path, ramp(foreign), *vary, "--json") == 0
    said = json.loads(capsys.readouterr().out)
    columns = {c.name: c.values for c in read_table(tmp_path / "out" / "sweep.csv").columns}
    u, x_0 = np.repeat(np.linspace(-1.3, 2.9, 4), 3), np.tile(np.linspace(0.25, 7.75, 3), 4)
    assert columns["x.u"] == pytest.approx(u)
    assert columns["x.x_0"] == pytest.approx(x_0)
    assert columns["x.x.mean"] == pytest.approx(x_0 + u * 0.4, rel=1e-12)
    assert columns["x.x.peak_to_peak"] == pytest.approx(abs(u) * 0.8, rel=1e-12)
    assert columns["x.x.std"] == pytest.approx(abs(u) * 0.01 * np.sqrt((81**2 - 1) / 12), rel=1e-12)
    written = json.loads((tmp_path / "out" / "sweep.json").read_text(encoding="utf-8"))
    assert said == {**written, "report": str(tmp_path / "out" / "report.html")}
    assert written["complete"] is True
    assert written["vary"]["x.x_0"] == {"unit": "1", "values": [0.25, 4.0, 7.75]}
    assert [p["metrics"]["x.x.mean"]["value"] for p in written["points"]] == columns["x.x.mean"].tolist()
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "12 points, 0 failed; complete. x.x.peak_to_peak is at worst 2.32 1, at x.u = 2.9, x.x_0 = 0.25." in page


def test_a_point_that_fails_says_why_and_the_others_stay(foreign, tmp_path, capsys):
    assert swept(tmp_path, belt(foreign, mode=1), "--vary", "belt.t_fail=0.2:1.4:3") == 2
    said = capsys.readouterr()
    assert said.err.startswith("belt.t_fail = 0.2: FMU belt (Failing.fmu) returned Discard from doStep at t = 0.2 s")
    assert "tsm-fmu: 1 of 3 points failed -- expected none" in said.err
    assert said.err.count("\n") == 2
    first, *rest = json.loads((tmp_path / "out" / "sweep.json").read_text(encoding="utf-8"))["points"]
    assert first["metrics"] == {}
    assert "the belt slipped" in first["failed"]
    assert [p["metrics"]["belt.count.peak_to_peak"] for p in rest] == [{"value": 80.0, "unit": "1"}] * 2
    _, mean, *_, why = read_table(tmp_path / "out" / "sweep.csv").columns
    assert np.isnan(mean.values).tolist() == [True, False, False]
    assert [text or "" for text in why.values] == [first["failed"], "", ""]


@pytest.mark.skipif(os.name == "nt", reason="sends itself SIGINT, which Windows does not have")
def test_ctrl_c_keeps_the_points_that_are_done(foreign, tmp_path, capsys):
    assert swept(tmp_path, belt(foreign), "--vary", "belt.mode=0:4:2", "--workers", "1", "--no-isolate") == 130
    kept = tmp_path / "out" / "sweep.incomplete.csv"
    assert capsys.readouterr().err == f"tsm-fmu: interrupted; 1 points kept in {kept}\n"
    mode, *_ = read_table(kept).columns
    assert mode.values.tolist() == [0.0]
    data = json.loads((tmp_path / "out" / "sweep.incomplete.json").read_text(encoding="utf-8"))
    assert data["complete"] is False
    assert data["vary"]["belt.mode"]["values"] == [0.0, 4.0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--vary", "belt.mode=0:1"], "--vary belt.mode=0:1 -- expected A:B:N, two different finite numbers"),
        (["--vary", "belt.mode=0:1:1"], "--vary belt.mode=0:1:1 -- expected A:B:N"),
        (["--vary", "belt.mode=2:2:3"], "--vary belt.mode=2:2:3 -- expected A:B:N"),
        (["--vary", "belt.mode=0:inf:3"], "--vary belt.mode=0:inf:3 -- expected A:B:N"),
        (["--vary", "belt.mode"], "--vary 'belt.mode' -- expected name=value"),
        (["--vary", "belt.mode=0:1:4"], "start value belt.mode = 0.333"),
        (["--vary", "belt.width=0:1:4"], "start value 'belt.width': Failing.fmu has no such variable"),
        (["--vary", "drum.width=0:1:4"], "'drum.width' -- expected component.variable with one of belt"),
        (["--vary", "belt.count=0:1:4"], "start value 'belt.count' is an output -- expected a parameter or an input"),
        (["--vary", "belt.t_fail=0:1:400000"], "--vary belt.t_fail=0:1:400000 -- expected at most 100000 points"),
        (["--vary", "belt.t_fail=0:1:1000000000000"], "expected at most 100000 points -- take fewer"),
        (["--vary", "belt.t_fail=0:1:50000", "--vary", "belt.mode=0:4:5"], "250000 points -- expected at most 100000"),
        (["--vary", "belt.mode=0:1:2", "--set", "belt.mode=1"], "--vary and --set belt.mode -- expected one of them"),
        (
            ["--vary", "belt.mode=0:1:2", "--scheduler", "host:1"],
            "--scheduler host:1 -- expected the address of a running Dask",
        ),
        (["--vary", "belt.t_fail=0.1:0.3:2", "--set", "belt.mode=1"], "all 2 points failed, the first: FMU belt"),
        ([], "Missing option '--vary'"),
    ],
)
def test_wrong_use_is_one_line_and_leaves_no_result(foreign, tmp_path, capsys, monkeypatch, arguments, message):
    monkeypatch.setattr("tsm_fmu.batching.cluster.PATIENCE", 0.5)
    assert swept(tmp_path, belt(foreign), *arguments) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.err.count(" -- ") >= 2
    assert said.out == ""
    assert not list((tmp_path / "out").glob("sweep*"))


def test_cases_stand_side_by_side(foreign, tmp_path):
    fast = System((Component("x", foreign["integrator"], {"u": 5.3}),), ())
    first = write_ssp(tmp_path / "first.ssp", (replace(ramp(foreign)[0], name="slow"), TIMING))
    second = write_ssp(tmp_path / "second.ssp", (replace(fast, name="fast"), replace(TIMING, stop=0.4)))
    path = tmp_path / "two.ssp"
    with zipfile.ZipFile(first) as old, zipfile.ZipFile(second) as other, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name))
        new.writestr("fast.ssd", other.read("SystemStructure.ssd"))
    assert run(["sweep", str(path), "--vary", "x.x_0=1.5:2.5:2", "--out", str(tmp_path / "out")]) == 0
    columns = {c.name: c.values for c in read_table(tmp_path / "out" / "sweep.csv").columns}
    assert columns["slow.x.x.mean"] == pytest.approx([1.5 + 1.7 * 0.4, 2.5 + 1.7 * 0.4], rel=1e-12)
    assert columns["fast.x.x.mean"] == pytest.approx([1.5 + 5.3 * 0.2, 2.5 + 5.3 * 0.2], rel=1e-12)
