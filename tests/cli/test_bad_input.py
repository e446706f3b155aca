"""Everything a user can get wrong on the command line: exit code 2, one line that says what, nothing on stdout.

Logs are sampled from closed forms here, not from our models. What `test_record_malformed`, `test_card`, `cosim/` and
`fmu/` test on the functions behind the verbs is not repeated.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.system import System

MODEL = "PairedTsmBacklash"


def write(path: Path, header: str, *columns: np.ndarray) -> Path:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.9g")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Good and bad files, and one FMU in a path that a URI would escape."""
    place = tmp_path_factory.mktemp("bad")
    t = np.arange(0.0, 6.0, 0.01)
    x = 0.713 * np.sin(2.0 * np.pi * 0.31 * t)
    y = 0.62 * x - 0.11 * np.sign(np.cos(2.0 * np.pi * 0.31 * t)) + 0.004 * np.cos(7.0 * t)
    still = np.full(t.size, 0.3)
    head = "time [s],x_in [rad],x_out [rad]"
    write(place / "ok.csv", head, t, x, y)
    write(place / "short.csv", head, t[:90], x[:90], y[:90])
    write(place / "five.csv", head, t[:5], x[:5], y[:5])
    write(place / "one.csv", head, t[:1], x[:1], y[:1])
    write(place / "still_in.csv", head, t, still, y)
    write(place / "still_out.csv", head, t, x, still)
    write(place / "huge.csv", head, t, 1e200 * x, y)
    write(place / "tiny.csv", head, t, 1e-300 * x, y)
    write(place / "in_mm.csv", "time [s],x_in [mm],x_out [rad]", t, x, y)
    write(place / "out_mm.csv", "time [s],x_in [rad],x_out [mm]", t, x, y)
    write(place / "no_out.csv", "time [s],x_in [rad]", t, x)
    write(place / "friction.csv", "time [s],x [rad],tau_in [N.m],tau_load [N.m]", t, x, y, y)
    write(place / "angle.csv", "time [s],x_in [rad],tau_out [N.m],tau_in [N.m],Theta [mm]", t, x, y, y, 9.0 * x)
    rows = (place / "ok.csv").read_text().splitlines()
    (place / "back.csv").write_text("\n".join([*rows[:50], rows[20], *rows[50:]]))
    (place / "nan.csv").write_text("\n".join([*rows[:50], "0.485,nan,0.1", *rows[50:]]))
    (place / "file").write_text("x")
    (place / "other_version.toml").write_text('format = 99\nmodel = "PairedTsmBacklash"\n')
    (place / "folder.fmu").mkdir()
    (place / "folder.toml").mkdir()
    (place / "junk.ssp").write_bytes(b"PK\x03\x04 not an archive")
    odd = place / "sp ace#%+ü"
    odd.mkdir()
    assert run(["build", MODEL, "--out", str(odd)]) == 0
    (odd / f"{MODEL}.fmu").rename(odd / "ä #%20+.fmu")
    damaged(odd / "ä #%20+.fmu", place)
    return place


def damaged(good: Path, place: Path) -> None:
    content = good.read_bytes()
    (place / "truncated.fmu").write_bytes(content[: len(content) // 2])
    with zipfile.ZipFile(good) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    description = members["modelDescription.xml"]
    changes = {
        "xml": {"modelDescription.xml": description[: len(description) // 2]},
        "library": {name: b"no library" for name in members if name.startswith("binaries/")},
        "guid": {"modelDescription.xml": re.sub(rb'guid="[^"]+"', b'guid="{0}"', description)},
    }
    for name, change in changes.items():
        with zipfile.ZipFile(place / f"{name}.fmu", "w") as archive:
            for member, data in {**members, **change}.items():
                archive.writestr(member, data)


FIT = ("identify", MODEL, "--out", "c.toml", "--measured")
PLAY = ("simulate", MODEL, "--out", "s.csv", "--input")
CASES = [
    # options
    ("check ok.csv --from abc", "--from 'abc' -- expected a valid number"),
    ("check ok.csv --from nan", "--from nan -- expected a finite time"),
    ("check ok.csv --from 3 --to 1", "0 samples from 3 to 1 s -- expected 2 or more inside 0 to 5.99 s"),
    ("check ok.csv --cutoff 0", "--cutoff 0 -- expected a frequency above 0 Hz"),
    ("check ok.csv --cutoff nan", "--cutoff nan -- expected a frequency above 0 Hz"),
    ("check ok.csv --cutoff 1000", "cut-off 1000 Hz -- expected 0.208 to 19.4 Hz"),
    ("check ok.csv --map x_in=x_out", "two columns of ok.csv are called 'x_out'"),
    ("check ok.csv --map x_in=", "--map x_in= -- expected a name after '='"),
    ("check ok.csv --scale speed=2", "--scale speed: ok.csv has no such channel -- expected one of x_in, x_out"),
    (f"{' '.join(FIT)} ok.csv --seed -1", "--seed '-1' -- expected greater than or equal to 0"),
    (f"{' '.join(FIT)} ok.csv --seed 1.5", "--seed '1.5' -- expected a valid integer"),
    (f"{' '.join(FIT)} ok.csv --method best", "--method 'best' -- expected one of 'fast', 'paper'"),
    (f"{' '.join(FIT)} ok.csv --cutoff -2", "--cutoff -2 -- expected a frequency above 0 Hz"),
    (f"{' '.join(FIT)} ok.csv --set alpha=nan", "--set alpha=nan -- expected a finite number"),
    (f"{' '.join(PLAY)} ok.csv --set alpha=inf", "--set alpha=inf -- expected a finite number"),
    (f"{' '.join(PLAY)} ok.csv --set alpha=-1", "parameter alpha = -1.0 1/rad"),
    (f"{' '.join(PLAY)} ok.csv --set beta=-5", "B = c + beta = -3.99944 -- expected B > 0"),
    ("simulate FeedforwardCompensator --map x_in=x_r --set law=1.5 --out s.csv --input ok.csv", "expected an integer"),
    ("simulate PairedTsmFriction --set sigma=1e300 --out s.csv --input friction.csv", "expected sigma and n near 1"),
    # logs
    ("check back.csv", "time goes back in row 51: 0.19 s after 0.48 s"),
    ("check nan.csv", "NaN or empty cell in row 51, column 'x_in'"),
    ("check one.csv", "one.csv has 1 samples -- expected 2 or more"),
    ("check huge.csv", "column 'x_in' (t = 0.01 s) -- expected a size up to 1e+100"),
    (f"{' '.join(PLAY)} in_mm.csv", "in_mm.csv: channel 'x_in' in m -- expected a unit such as rad"),
    (f"{' '.join(PLAY)} out_mm.csv", "out_mm.csv: channel 'x_out' in m -- expected a unit such as rad"),
    (f"{' '.join(FIT)} five.csv", "5 measured values in five for 5 free parameters"),
    (f"{' '.join(FIT)} still_in.csv", "no input of PairedTsmBacklash moves in still_in (x_in) -- expected motion"),
    (f"{' '.join(FIT)} still_out.csv", "channel 'x_out' is 0.3 in every row of still_out"),
    (f"{' '.join(FIT)} no_out.csv", "no output of PairedTsmBacklash -- expected one of x_out, x_h"),
    (f"{' '.join(FIT)} ok.csv --measured in_mm.csv", "in_mm.csv: channel 'x_in' in m"),
    (f"{' '.join(FIT)} ok.csv --holdout ok.csv", "is given 2 times -- expected each run once"),
    (f"{' '.join(FIT)} ok.csv --holdout short.csv", "held-out run short of 0.89 s -- expected more than the 2 s"),
    ("check folder.toml", "folder.toml: Is a directory -- expected a readable file"),
    ("check truncated.fmu", "holds zero bytes -- expected text"),
    ("check ok.csv --frm 3", "No such option: --frm"),
    # where results go
    (f"simulate {MODEL} --input ok.csv --out ok.csv", "--out ok.csv is a measured run"),
    (f"simulate {MODEL} --input ok.csv --out s.txt", "--out s.txt -- expected a name that ends in .csv"),
    (f"simulate {MODEL} --input ok.csv --out file/s.csv", "--out file/s.csv: file is no writable folder"),
    (f"identify {MODEL} --measured ok.csv --out ok.csv", "--out ok.csv is a measured run"),
    (f"identify {MODEL} --measured ok.csv --out c.json", "--out c.json -- expected a name that ends in .toml"),
    (f"identify {MODEL} --measured ok.csv --out folder.toml", "--out folder.toml is a folder"),
    (f"identify {MODEL} --measured ok.csv --out no/c.toml", "expected a folder that exists -- create no first"),
    (f"build {MODEL} --out file", "--out file is a file -- expected a folder"),
    (f"build {MODEL} --out file/x", "file is no writable folder"),
    ("demo --out file/x", "--out file/x: file is no writable folder"),
    ("reproduce --out file", "--out file is a file"),
    # names
    ("build Nope", "model 'Nope' -- expected one of SingleTsmDahl"),
    (f"simulate {MODEL}:mine --input ok.csv --out s.csv", "preset 'mine' of PairedTsmBacklash -- expected one of"),
    (f"simulate {MODEL}+creep+creep --input ok.csv --out s.csv", "expected each effect once a place"),
    ("reproduce --paper nope2020 --out r", "paper 'nope2020' -- expected one of iftomm2013"),
    ("run nope --out r", "'nope' -- expected one of mssp_feedforward"),
    ("run mssp_feedfoward --out r", "'mssp_feedfoward' -- expected one of mssp_feedforward"),
    (
        "identify other_version.toml --measured ok.csv --out c.toml",
        "other_version.toml: format = 99 -- expected format 1",
    ),
    ("simulate other_version.toml --input ok.csv --out s.csv", "other_version.toml: format = 99 -- expected format 1"),
    (f"identify {MODEL}+nope --measured ok.csv --out c.toml", "effect 'nope' -- expected one of coulomb"),
    (f"diagnose {MODEL} --measured nan.csv --out d", "NaN or empty cell in row 51, column 'x_in'"),
    (f"diagnose {MODEL} --measured ok.csv --out file", "--out file is a file -- expected a folder"),
    ("diagnose TendonDrive --measured angle.csv --out d", "channel 'Theta' in m -- expected a unit such as rad"),
    ("validate", "Missing argument 'FMU ...' -- expected what the help lists -- see 'tsm-fmu validate --help'"),
    ("run junk.ssp --out r", "junk.ssp"),
    ("export folder.toml --out a.fmu", "card folder.toml: a folder, a pipe or a device -- expected TOML"),
    ("export ok.csv --out a.fmu", "card ok.csv: Expected '=' after a key"),
    # FMUs
    ("simulate folder.fmu --input ok.csv --out s.csv", "FMU folder.fmu -- expected an existing .fmu file"),
    ("simulate library.fmu --input ok.csv --out s.csv", "(library.fmu) cannot be loaded"),
    ("simulate truncated.fmu --input ok.csv --out s.csv", "FMU truncated.fmu -- expected a zip archive"),
    ("simulate xml.fmu --input ok.csv --out s.csv", "FMU xml.fmu has no readable modelDescription.xml"),
    ("simulate guid.fmu --input ok.csv --out s.csv", "in modelDescription.xml -- expected"),
]


@pytest.mark.parametrize(("line", "message"), CASES, ids=[line for line, _ in CASES])
def test_bad_input_is_one_line_and_leaves_nothing(folder, monkeypatch, capsys, line, message):
    monkeypatch.chdir(folder)
    before = {p: p.read_bytes() for p in folder.glob("*.csv")}
    assert run(line.split()) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.err.startswith("tsm-fmu: ")
    assert said.err.count(" -- ") >= 2  # what -- expected -- what to do
    assert said.out == ""
    assert Path.cwd() == folder  # a library that cannot be loaded must not move the process
    after = {p: p.read_bytes() for p in folder.glob("*.csv") if not p.name.endswith(".incomplete.csv")}
    assert after == before
    assert not (folder / "c.toml").exists()
    assert not list(folder.glob(".*.part"))


def test_validate_lists_on_stdout_and_counts_on_stderr(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert run(["validate", "truncated.fmu", "none.fmu"]) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    assert "2 of 2 FMU files with a problem (truncated.fmu, none.fmu)" in said.err
    assert "none.fmu -- expected an existing file" in said.out


def test_paths_that_a_uri_escapes_work(folder, capsys):
    odd = folder / "sp ace#%+ü"
    (odd / "lög +.csv").write_bytes((folder / "ok.csv").read_bytes())
    out = odd / "ö #.csv"
    arguments = [str(odd / "ä #%20+.fmu"), "--input", str(odd / "lög +.csv"), "--out", str(out), "--json"]
    assert run(["simulate", *arguments]) == 0
    assert '"x_out"' in capsys.readouterr().out
    assert out.is_file()


def test_more_steps_than_memory_are_refused():
    with pytest.raises(InputError, match=r"step 1e-300 s .* expected at most 1e\+08 steps"):
        simulate_system(System((), ()), 20.0, 1e-300)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_numbers_whose_squares_vanish_are_described(folder):
    assert run(["check", str(folder / "tiny.csv"), "--json"]) == 0


@pytest.mark.skipif(os.name == "nt", reason="pipes of POSIX")
def test_a_reader_that_goes_away_is_no_error():
    list_it = subprocess.Popen(
        [sys.executable, "-m", "tsm_fmu", "list", "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert list_it.stdout is not None
    assert list_it.stderr is not None
    list_it.stdout.readline()
    list_it.stdout.close()
    assert "Traceback" not in list_it.stderr.read()
    assert list_it.wait() == 0


def mapped(process: int) -> str:
    """Names of the files that a process has loaded."""
    try:
        return Path(f"/proc/{process}/maps").read_text(encoding="utf-8")
    except OSError:
        return ""


@pytest.mark.skipif(sys.platform != "linux", reason="looks at what a process has loaded in /proc, which Linux has")
def test_ctrl_c_in_a_run_keeps_the_rows_and_says_where(tmp_path):
    """A real process and a real signal: one line on stderr, exit code 130, rows that parse."""
    command = [sys.executable, "-m", "tsm_fmu", "run", "mssp_feedforward", "--case", "periodic.law_1", "--stop", "2000"]
    started = subprocess.Popen(
        [*command, "--out", str(tmp_path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    deadline = time.monotonic() + 60.0
    while "Sum.so" not in mapped(started.pid) and time.monotonic() < deadline:
        time.sleep(0.05)  # until its FMUs are loaded
    time.sleep(1.0)  # into the simulation
    started.send_signal(signal.SIGINT)
    out, err = started.communicate(timeout=60)
    assert started.returncode == 130
    assert out == ""
    told = re.fullmatch(r"tsm-fmu: interrupted; (\d+) rows kept in \S+results\.incomplete\.csv\n", err)
    assert told is not None, err
    kept = (tmp_path / "results.incomplete.csv").read_text(encoding="utf-8").splitlines()
    assert len(kept) == 1 + int(told[1])  # how many depends on the machine
