"""FMUs that exit, crash or hang: named, with the rows until then, and the program goes on."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from typing import Any

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.cli.app import run as tsm_fmu
from tsm_fmu.cosim.isolation import Simulations, simulation
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System
from tsm_fmu.cosim.trajectory import SimulationInterrupted, SimulationStopped
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record, read_record, write_record

EXITS, CRASHES, HANGS = 3, 4, 5


def moody(in_c, mood, t_end=0.055, **values):
    return System((Component("one", in_c["moody"], {"mood": mood, "t_end": t_end, "u": 1.5, **values}),), ())


@pytest.fixture(scope="module")
def there():
    with simulation(None, 20.0) as chosen:
        yield chosen


@pytest.mark.parametrize(
    ("mood", "how"),
    [(EXITS, "ended its process with exit code 7"), (CRASHES, "ended its process by SIGSEGV")],
)
def test_a_process_that_ends_is_named_with_the_rows_until_then_and_the_next_run_works(in_c, there, mood, how):
    with pytest.raises(SimulationStopped) as caught:
        there.simulate_system(moody(in_c, mood), 0.1, 0.01)
    assert str(caught.value).startswith(f"FMU one (moody.fmu): doStep at t = 0.05 s {how} -- expected a return")
    kept = caught.value.trajectory
    assert kept.columns["one.y"].tolist() == [0.0, *[1.5] * 5]
    assert kept.time == pytest.approx(np.arange(6) * 0.01)
    assert kept.incomplete == str(caught.value)
    again = there.simulate_system(moody(in_c, 0), 0.1, 0.01)
    assert again.columns["one.y"].tolist() == [0.0, *[1.5] * 10]


def test_a_call_that_does_not_return_is_ended_after_the_time_limit(in_c):
    begun = time.monotonic()
    with (
        simulation(None, 2.0) as process,
        pytest.raises(SimulationStopped, match=r"doStep at t = 0\.05 s did not return with"),
    ):
        process.simulate_system(moody(in_c, HANGS), 0.1, 0.01)
    assert time.monotonic() - begun < 120.0


@pytest.mark.parametrize(
    ("name", "how"), [("crash", "ended its process by SIGSEGV"), ("hang", "did not return within 2 s")]
)
def test_what_happens_while_it_is_instantiated_is_named_and_the_others_end_cleanly(in_c, tmp_path, name, how):
    """Before the first row there is nothing to keep; the unit beside it is freed, and the next run works."""
    sound = Component("sound", in_c["moody"], {"u": 1.5})
    system = System((sound, Component(name, in_c["moody"], {"u": 1.5})), ())
    with simulation(None, 2.0) as place:
        with pytest.raises(InputError, match=rf"^FMU {name} \(moody\.fmu\): .*{how}") as caught:
            place.simulate_system(system, 0.1, 0.01)
        assert "\n" not in str(caught.value)
        again = place.simulate_system(System((sound,), ()), 0.1, 0.01)
    assert again.columns["sound.y"].tolist() == [0.0, *[1.5] * 10]


def test_the_other_process_gives_the_same_numbers_messages_and_errors(in_c, foreign, there):
    system = System(
        (Component("x", foreign["integrator"], {"x_0": 1.3}), Component("a", in_c["arrays"], {"u": 0.25})),
        (Connection("x.x", "a.u[1]"), Connection("a.Y[2,1]", "x.u", factor=-0.4)),
    )
    here, elsewhere = simulate_system(system, 0.2, 0.01), there.simulate_system(system, 0.2, 0.01)
    assert here.messages == elsewhere.messages != ()
    assert here.units == elsewhere.units
    for name, values in here.columns.items():
        assert values.tolist() == elsewhere.columns[name].tolist()
        assert values.dtype == elsewhere.columns[name].dtype
    record = Record("r", np.arange(3) * 0.01, {"u": np.array([0.5, 1.5, -2.0])}, {"u": "1"})
    assert there.replay(in_c["moody"], record, parameters={"k": 3.0}).columns["y"].tolist() == [0.0, 4.5, -6.0]
    with pytest.raises(InputError, match="expected a whole number of steps"):
        there.simulate_system(system, 1.0, 0.3)
    discards = System((Component("belt", foreign["failing"], {"mode": 1, "t_fail": 0.1}),), ())
    with pytest.raises(SimulationStopped, match="the belt slipped") as caught:
        there.simulate_system(discards, 1.0, 0.01)
    assert caught.value.trajectory.columns["belt.count"].tolist() == list(range(11))


def test_each_foreign_fmu_has_a_process_and_the_others_end_cleanly(in_c, foreign, there, tmp_path):
    """Beside the one that crashes: its like, one in Python that says where it is and how it ends, and one of ours."""
    ended = tmp_path / "ended.txt"
    system = System(
        (
            Component("good", in_c["moody"], {"u": 2.5}),
            Component("python", foreign["process"], {"path": str(ended)}),
            Component("ours", build_fmu(kernel("Sum"), tmp_path / "Sum.fmu"), {"k1": 1.0, "u2": 0.75, "u3": 0.0}),
            Component("bad", in_c["moody"], {"mood": CRASHES, "t_end": 0.055}),
        ),
        (Connection("good.y", "ours.u1"), Connection("ours.y", "bad.u")),
    )
    with pytest.raises(SimulationStopped, match=r"^FMU bad \(moody.fmu\): doStep at t = 0\.05 s ended its") as caught:
        there.simulate_system(system, 0.1, 0.01)
    kept = caught.value.trajectory.columns
    assert kept["good.y"].tolist() == [0.0, *[2.5] * 5]
    assert kept["ours.y"][1:].tolist() == [3.25] * 5
    assert kept["bad.y"][1:].tolist() == [3.25] * 5
    process = int(kept["python.pid"][-1])
    assert process != os.getpid()
    assert ended.read_text() == f"terminated in {process}"
    calm = there.simulate_system(system.with_values({"bad.mood": 0}), 0.1, 0.01)  # the process that lives is kept
    assert calm.columns["python.pid"][-1] == process
    with simulation(False, 1.0) as here:
        assert (
            here.simulate_system(system.with_values({"bad.mood": 0}), 0.1, 0.01).columns["python.pid"][-1]
            == os.getpid()
        )


def test_a_system_of_foreign_fmus_gives_the_same_bits_by_each_way_of_stepping(in_c, foreign, there):
    """States saved and restored, texts, machine code and both orders of exchange through the pipe as here."""
    loop = System(
        (Component("x", foreign["integrator"], {"x_0": 1.3}), Component("a", in_c["arrays"], {"u": 0.25})),
        (Connection("x.x", "a.u[1]"), Connection("a.Y[2,1]", "x.u", factor=-0.4)),
    )
    texts = System((Component("one", foreign["typed"], {}),), ())
    ways: tuple[tuple[System, dict[str, Any]], ...] = (
        (loop, {"method": "jacobi"}), (loop, {"compiled": True}), (loop, {"compiled": True, "method": "jacobi"}),
        (loop, {"loops": "iterate"}), (texts, {}),
    )  # fmt: skip
    for system, options in ways:
        try:
            here = simulate_system(system, 0.2, 0.01, **options)
        except InputError as refused:
            with pytest.raises(InputError, match=re.escape(str(refused)[:60])):
                there.simulate_system(system, 0.2, 0.01, **options)
            continue
        elsewhere = there.simulate_system(system, 0.2, 0.01, **options)
        for name, values in here.columns.items():
            assert values.tobytes() == elsewhere.columns[name].tobytes(), (name, options)


@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT, which Windows does not have")
def test_ctrl_c_ends_the_run_after_the_step_and_an_fmu_cannot_send_it(foreign, there):
    belt = System((Component("belt", foreign["failing"], {"mode": 5, "t_fail": 0.37}),), ())
    for compiled in (False, True):
        with pytest.raises(SimulationInterrupted) as caught:
            there.simulate_system(belt, 1.0, 0.01, compiled=compiled)
        assert caught.value.trajectory.time[-1] == pytest.approx(0.38)
        itself = there.simulate_system(belt.with_values({"belt.mode": 4}), 1.0, 0.01, compiled=compiled)
        assert itself.columns["belt.count"][-1] == 100.0


def test_the_end_of_a_run_may_crash_too(in_c, there):
    run = there.simulate_system(moody(in_c, 6), 0.1, 0.01)
    assert run.columns["one.y"].tolist() == [0.0, *[1.5] * 10]
    assert run.messages[-1].startswith("FMU one (moody.fmu): terminate ended its process by SIGSEGV -- expected")


def test_isolate_takes_our_own_too_and_a_time_limit_is_positive(tmp_path):
    system = System(
        (Component("ours", build_fmu(kernel("Sum"), tmp_path / "Sum.fmu"), {f"u{k}": 2.0 for k in (1, 2, 3)}),), ()
    )
    with simulation(True, 20.0) as all_of_them, simulation(None, 20.0) as foreign_ones:
        a, b = (s.simulate_system(system, 0.1, 0.01).columns["ours.y"] for s in (all_of_them, foreign_ones))
    assert a.tobytes() == b.tobytes()
    with pytest.raises(InputError, match=r"^time limit 0\.0 s"):
        Simulations(None, 0.0)


def test_run_and_simulate_keep_the_rows_of_an_fmu_that_exits(in_c, tmp_path, capsys):
    path = write_ssp(tmp_path / "moody.ssp", (moody(in_c, EXITS), Experiment(stop=0.1, step=0.01)))
    log = write_record(tmp_path / "log.csv", np.arange(11) * 0.01, {"u": np.full(11, 1.5)}, {"u": "1"})
    replayed = ["simulate", str(in_c["moody"]), "--input", str(log), "--set", "mood=3", "--set", "t_end=0.055"]
    for arguments, column in (
        (["run", str(path), "--out", str(tmp_path / "out")], "one.y"),
        ([*replayed, "--out", str(tmp_path / "out" / "results.csv")], "y"),
    ):
        assert tsm_fmu(arguments) == 2
        said = capsys.readouterr().err
        assert re.search(r"tsm-fmu: FMU \w+ \(moody\.fmu\): doStep at t = 0\.05 s ended its process", said)
        assert "6 rows kept in" in said
        assert read_record(tmp_path / "out" / "results.incomplete.csv").columns[column].tolist() == [0.0, *[1.5] * 5]
    good = ["run", str(path), "--set", "one.mood=0", "--out", str(tmp_path / "out")]
    assert tsm_fmu(good) == 0
    assert not (tmp_path / "out" / "results.incomplete.csv").exists()


def test_a_sweep_goes_on_after_a_point_that_crashes(in_c, tmp_path, capsys):
    path = write_ssp(tmp_path / "moody.ssp", (moody(in_c, CRASHES), Experiment(stop=0.1, step=0.01)))
    assert tsm_fmu(["sweep", str(path), "--vary", "one.t_end=0.02:0.2:4", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.count("ended its process by SIGSEGV") == 2
    assert "tsm-fmu: 2 of 4 points failed -- expected none" in said
    points = json.loads((tmp_path / "out" / "sweep.json").read_text())["points"]
    assert [bool(p["failed"]) for p in points] == [True, True, False, False]
    assert points[3]["metrics"]["one.y.mean"]["value"] == pytest.approx(1.5 * 10 / 11)


SLOW = """
import os, sys
from pathlib import Path
from tsm_fmu.cli.app import main
from tsm_fmu.cosim import sweep
done = sweep.statistics
def statistics(*arguments):
    kept = Path(sys.argv[2], "sweep.points.jsonl")
    if kept.exists() and kept.read_text().count("\\n") == 1 + int(sys.argv[3]):
        os.kill(os.getpid(), int(sys.argv[4]))
    return done(*arguments)
sweep.statistics = statistics
if __name__ == "__main__":
    main(["sweep", sys.argv[1], "--vary", "one.k=0.5:4:8", "--out", sys.argv[2], "--no-isolate", "--workers", "1"])
"""


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL and SIGTERM are not there on Windows")
def test_a_killed_sweep_goes_on_where_it_was_and_gives_what_an_undisturbed_one_gives(in_c, tmp_path, capsys):
    system = System((Component("one", in_c["moody"], {"u": 1.5}),), ())
    path = write_ssp(tmp_path / "moody.ssp", (system, Experiment(stop=0.1, step=0.01)))
    out = tmp_path / "out"
    script = [sys.executable, "-c", SLOW, str(path), str(out)]
    killed = subprocess.run([*script, "3", str(int(signal.SIGKILL))], capture_output=True, text=True)
    assert killed.returncode == -signal.SIGKILL
    assert not (out / "sweep.csv").exists()
    ended = subprocess.run([*script, "5", str(int(signal.SIGTERM))], capture_output=True, text=True)
    assert "3 of 8 points kept from a sweep that did not end" in ended.stderr
    assert (ended.returncode, "5 points kept in" in ended.stderr) == (130, True)
    assert (out / "sweep.incomplete.csv").exists()
    sweep = ["sweep", str(path), "--vary", "one.k=0.5:4:8"]
    assert tsm_fmu([*sweep, "--out", str(out)]) == 0
    assert "5 of 8 points kept from a sweep that did not end" in capsys.readouterr().err
    assert sorted(p.name for p in out.iterdir()) == [
        "report.html",
        "sweep.csv",
        "sweep.json",
        "sweep.parquet",
    ]
    assert tsm_fmu([*sweep, "--out", str(tmp_path / "whole")]) == 0
    assert (out / "sweep.csv").read_bytes() == (tmp_path / "whole" / "sweep.csv").read_bytes()
    assert "kept from" not in capsys.readouterr().err


def test_points_of_another_sweep_do_not_count(in_c, tmp_path, capsys):
    system = System((Component("one", in_c["moody"], {"u": 1.5}),), ())
    path = write_ssp(tmp_path / "moody.ssp", (system, Experiment(stop=0.1, step=0.01)))
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "sweep.points.jsonl").write_text('{"sweep": "other"}\n{"values": {}, "metrics": {}}\n')
    assert tsm_fmu(["sweep", str(path), "--vary", "one.k=1:2:2", "--out", str(tmp_path / "out"), "--no-isolate"]) == 0
    assert "kept" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["--stop", "-1"], "stop -1.0"), (["--case", "ghost"], "case 'ghost'"), (["--step", "0.3"], "whole number of")],
)
@pytest.mark.parametrize("verb", [["run"], ["sweep", "--vary", "load.k=0.1:0.2:2"]])
def test_wrong_times_and_cases_are_found_before_any_fmu_is_built(
    monkeypatch, tmp_path, capsys, arguments, message, verb
):
    monkeypatch.setattr("tsm_fmu.fmu.build.build_fmu", None)
    assert tsm_fmu([*verb, "mssp_feedforward", *arguments, "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_pythonfmu_unit_without_its_script_is_named_before_it_is_loaded(foreign, tmp_path):
    bare = tmp_path / "bare.fmu"
    with zipfile.ZipFile(foreign["gain"]) as old, zipfile.ZipFile(bare, "w") as new:
        for name in old.namelist():
            if not name.startswith("resources/"):
                new.writestr(name, old.read(name))
    with pytest.raises(InputError, match=r"^FMU one \(bare\.fmu\) has no resources/slavemodule\.txt -- expected"):
        simulate_system(System((Component("one", bare, {"u": 0.0, "u_2": 0.0}),), ()), 0.1, 0.01)
