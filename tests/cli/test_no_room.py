"""No room and no rights: each verb that writes says so in one line, and leaves the earlier files as they were."""

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tsm_fmu as tsm
from tsm_fmu.cli.app import run
from tsm_fmu.logs import whole_file
from tsm_fmu.logs.record import write_record
from tsm_fmu.logs.whole_file import write_whole
from tsm_fmu.reproduction import loops

MODEL = "PairedTsmBacklash"
WRITING = {
    "sample sine --out new.csv": "new.csv",
    "check log.csv --model PairedTsmBacklash --out log.toml": "log.toml",
    f"build {MODEL} --out new": f"{MODEL}.fmu",
    f"identify {MODEL} --measured log.csv --out new.toml --single-start": "new.toml",
    f"simulate {MODEL} --input log.csv --out new.csv": "new.csv",
    "export card.toml --flavour python --out new.fmu": "new.fmu",
    "run mssp_feedforward --stop 0.1 --out new": ".fmu",
    "report results": "index.html",
    "demo --out new": ".fmu",
    "run theirs.ssp --stop 0.1 --out new": "results.csv",
    f"batch identify {MODEL} --table rigs.csv --workers 1 --out new": "rigs.points.jsonl",
    "sweep theirs.ssp --stop 0.1 --vary unit.x_0=0.01:0.02:2 --out new": "sweep.points.jsonl",
    "monte-carlo theirs.ssp --card unit=card.toml --signal unit.x_out --stop 0.1 --draws 2 --workers 1 --out new": (
        "draws.points.jsonl"
    ),
    "linearize theirs.ssp --at 0.1 --input unit.x_in --output unit.x_out --out new": "report.html",
    "track card.toml log0.csv log1.csv log2.csv log3.csv log4.csv --out new": "track",
    "diagnose card.toml --measured log.csv --out new": "card.toml",
    "reproduce --out new": ".fmu",
}


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    from tsm_fmu.cosim.ssp import write_ssp
    from tsm_fmu.cosim.system import Component, Experiment, System

    folder = tmp_path_factory.mktemp("lab")
    record = tsm.sample("sine")
    columns = {name: values[::40] for name, values in record.columns.items()}
    write_record(folder / "log.csv", record.time[::40], columns, record.units)
    found = tsm.identify(MODEL, folder / "log.csv", single_start=True)
    found.write_card(folder / "card.toml")
    fmu = tsm.export(found, folder / "unit.fmu", flavour="python")
    case = System((Component("unit", Path(fmu), {}),), (), "theirs"), Experiment(stop=0.1, step=0.01)
    write_ssp(folder / "theirs.ssp", case)
    for number in range(5):
        shutil.copy(folder / "log.csv", folder / f"log{number}.csv")
    (folder / "rigs.csv").write_text("rig,measured\na,log.csv\nb,log.csv\n")
    (folder / "results").mkdir()
    found.write_card(folder / "results" / "card.toml")
    return folder


def state(folder):
    return {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize(
    ("line", "number"),
    [(line, errno.ENOSPC) for line in WRITING]
    + [("sample sine --out new.csv", n) for n in (errno.EROFS, errno.EACCES)],
)
def test_no_room_is_one_line_that_names_the_file_and_nothing_changes(lab, monkeypatch, capsys, line, number):
    monkeypatch.chdir(lab)
    before = state(lab)

    class Full(type(Path())):
        def write_bytes(self, data):
            if self.name.endswith(whole_file._PART):
                super().write_bytes(data[: len(data) // 2])  # as a disk does that fills up
                raise OSError(number, os.strerror(number), str(self))
            return super().write_bytes(data)

    monkeypatch.setattr(whole_file, "Path", Full)
    loops._fmu.cache_clear()  # FMUs that another test of this process has built need no room
    assert run(line.split()) == 2
    said = capsys.readouterr()
    refusals = [text for text in said.err.splitlines() if text.startswith("tsm-fmu: ")]
    assert len(refusals) == 1
    assert said.err.endswith(f"{refusals[0]}\n")
    assert os.strerror(number) in refusals[0]
    assert WRITING[line] in refusals[0]
    assert refusals[0].count(" -- ") >= 2
    assert "Traceback" not in said.err
    assert state(lab) == before


READ_ONLY = (*WRITING, f"diagnose {MODEL} --measured log.csv --out new",
    "reproduce --paper mmt2015 --quick --out new")  # fmt: skip


@pytest.mark.parametrize("line", READ_ONLY)
def test_a_read_only_folder_is_one_line_before_any_work(lab, monkeypatch, capsys, line):
    """A verb that would compute first and refuse then loses what it computed."""
    monkeypatch.chdir(lab)
    before, access = state(lab), os.access
    monkeypatch.setattr(
        os,
        "access",
        lambda path, mode, **more: (
            not (mode & os.W_OK and Path(path).resolve().is_relative_to(lab)) and access(path, mode, **more)
        ),
    )
    assert run(line.split()) == 2
    said = capsys.readouterr()
    assert said.out == ""
    *notes, refusal = said.err.splitlines()
    assert all(note.startswith("log: ") for note in notes)  # how a log was read
    assert refusal.startswith("tsm-fmu: ")
    assert refusal.count(" -- ") == 2
    assert state(lab) == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full is of Linux")
@pytest.mark.parametrize("line", ["list", "list --json"])
def test_output_that_has_no_room_is_one_line(line):
    with open("/dev/full", "w") as full:
        ended = subprocess.run(
            [sys.executable, "-m", "tsm_fmu", *line.split()], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert ended.returncode == 2
    assert ended.stderr.startswith("tsm-fmu: output: No space left on device -- expected")
    assert ended.stderr.count("\n") == 1


def test_a_file_is_replaced_whole_and_parts_of_ended_processes_go(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    target = tmp_path / "a.b.json"
    dead, living, other = (
        tmp_path / f".{name}.part" for name in (f"a.b.json.{ended.pid}", f"a.b.json.{os.getppid()}", "aXb.json.1")
    )
    for part in (dead, living, other):
        part.write_text("half")
    target.write_text("earlier")
    assert write_whole(target, "ümlaut\n") == target
    assert target.read_bytes() == "ümlaut\n".encode()
    assert not dead.exists()
    assert living.exists()
    assert other.exists()
    with pytest.raises(tsm.InputError, match="name of a file"):
        write_whole(f"{tmp_path}/a\0b", "")


def test_an_interrupt_while_a_file_is_written_leaves_the_earlier_one(tmp_path, monkeypatch):
    target = tmp_path / "card.toml"
    target.write_text("earlier")

    class Interrupted(type(Path())):
        def write_bytes(self, data):
            super().write_bytes(data[:1])
            raise KeyboardInterrupt

    monkeypatch.setattr(whole_file, "Path", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_whole(target, "new")
    assert target.read_text() == "earlier"
    assert list(tmp_path.iterdir()) == [target]
