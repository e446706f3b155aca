"""Ends at random moments of each verb: no half file that reads as good, no traceback, and the next run works."""

import csv
import json
import multiprocessing
import os
import random
import re
import signal
import subprocess
import sys
import time
import zipfile

import pytest

import tsm_fmu as tsm
from tests.cli.test_no_room import MODEL
from tests.cli.test_no_room import lab as lab
from tsm_fmu.cli import identify
from tsm_fmu.cli.app import run
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.logs.table import read_table

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")

PRELOADED = ("tsm_fmu.cli", "tsm_fmu.verbs.identify", "tsm_fmu.verbs.diagnose", "tsm_fmu.verbs.track",
             "tsm_fmu.verbs.run", "tsm_fmu.verbs.sweep", "tsm_fmu.report.page", "numba", "bokeh.plotting")  # fmt: skip
LINES = {
    "sample": "sample sine --out new/log.csv",
    "check": f"check log.csv --model {MODEL} --out new/log.toml",
    "build": f"build {MODEL} PairedTsmFriction --out new",
    "identify": f"identify {MODEL} --measured log.csv --out new/card.toml --report new/report.html --single-start",
    "simulate": "simulate card.toml --input log.csv --out new/out.csv",
    "export": "export card.toml --flavour python --out new/unit.fmu",
    "run": "run theirs.ssp --stop 0.2 --out new",
    "report": "report new",
    "sweep": "sweep theirs.ssp --stop 0.2 --vary unit.x_0=0.01:0.02:3 --workers 1 --out new",
    "monte-carlo": "monte-carlo theirs.ssp --card unit=card.toml --signal unit.x_out --stop 0.2 --draws 5 --workers 1 "
    "--out new",
    "linearize": "linearize theirs.ssp --at 0.1 --input unit.x_in --output unit.x_out --out new",
    "step-study": "step-study theirs.ssp --stop 0.1 --halvings 2",
    "track": "track card.toml log.csv log1.csv log2.csv log3.csv log4.csv --out new",
    "batch": f"batch identify {MODEL} --table rigs.csv --workers 1 --out new",
    "app": "app --no-browser --port 0",
    "diagnose": f"diagnose {MODEL} --measured log.csv --out new",
    "demo": "demo --out new",
    "reproduce": "reproduce --paper mmt2015 --quick --out new",
}
LONG = {
    "monte-carlo": 1.5,
    "linearize": 1.0,
    "step-study": 0.8,
    "app": 1.5,
    "diagnose": 6.0,
    "demo": 4.0,
    "reproduce": 4.0,
}
"""Verbs that only begin here; seconds of which a moment is drawn. What they keep is tested where they are."""


def _verb(line, folder, said):
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from tsm_fmu.cli import main

    os.chdir(folder)
    out = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(out, 1)
    os.dup2(out, 2)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # as an interpreter has it when the program begins
    try:
        main(line.split())
    except SystemExit as left:
        sys.stdout.flush()
        os._exit(int(left.code or 0))


@pytest.fixture(scope="module")
def begin():
    """Starts a verb in a process that has loaded the package already; to be ended by a signal."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(PRELOADED))

    def started(line, folder, said):
        process = context.Process(target=_verb, args=(line, folder, said))
        process.start()
        return process

    return started


def assert_whole(folder):
    """Each file that is not hidden can be read to its end."""
    for path in (p for p in folder.rglob("*") if p.is_file() and not p.name.startswith(".")):
        if path.suffix in (".fmu", ".ssp"):
            assert zipfile.ZipFile(path).testzip() is None
        elif path.suffix == ".json":
            json.loads(path.read_text())
        elif path.name.startswith("card"):
            tsm.read_card(path)
        elif path.name == "track.csv":  # words among its numbers
            *rows, end = path.read_text().split("\n")
            assert end == ""
            assert len({len(row) for row in csv.reader(rows)}) == 1
        elif path.suffix in (".csv", ".parquet") and "claims" not in path.name:
            assert read_table(path).columns[0].values.size > 1
        elif path.suffix == ".html":
            assert path.read_text().rstrip().endswith("</html>")
        else:
            assert path.suffix in (".toml", ".csv", ".jsonl"), path


def results(folder):
    """Files of numbers, by name; FMUs, tables and cards do not depend on the moment."""
    endings = (".csv", ".fmu", ".ssp", ".toml")
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.suffix in endings}


@pytest.mark.parametrize("verb", LINES)
def test_an_end_at_any_moment_leaves_no_half_file_and_the_next_run_is_the_same(lab, tmp_path, begin, verb, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    draw = random.Random(f"moments of {verb}")
    line, said = LINES[verb], tmp_path / "said.txt"
    for name in ("log.csv", "card.toml", "theirs.ssp", "rigs.csv"):
        (tmp_path / name).write_bytes((lab / name).read_bytes())
    head, *rows = (lab / "log.csv").read_text().splitlines(keepends=True)
    for cut in range(1, 5):
        (tmp_path / f"log{cut}.csv").write_text(head + "".join(rows[cut:]))
    new = tmp_path / "new"
    new.mkdir()
    if verb == "report":
        (new / "card.toml").write_bytes((lab / "card.toml").read_bytes())
    expected, longest = {}, LONG.get(verb, 0.0)
    if verb not in LONG:
        started = time.monotonic()
        whole = begin(line, tmp_path, said)
        whole.join(120)
        longest = time.monotonic() - started
        assert whole.exitcode == 0, said.read_text()
        expected = results(new)
    for number in (draw.choice((signal.SIGINT, signal.SIGTERM)), signal.SIGKILL):
        (new / "log.toml").unlink(missing_ok=True)  # check replaces no file that a user may have corrected
        said.unlink(missing_ok=True)
        process = begin(line, tmp_path, said)
        while not said.exists():  # until then it is the test's process, not the verb's
            time.sleep(0.005)
        time.sleep(draw.uniform(0.03, longest))
        if process.is_alive():
            os.kill(process.pid, number)
        process.join(60)
        text = said.read_text()
        assert process.exitcode in ((-number, 0) if number == signal.SIGKILL else (130, 0, -number)), text
        assert "Traceback" not in text
        if process.exitcode == 130:
            assert re.search(r"^tsm-fmu: interrupted", text, re.MULTILINE)
        assert_whole(new)
    if verb in LONG:
        return
    (new / "log.toml").unlink(missing_ok=True)
    again = begin(line, tmp_path, said)
    again.join(120)
    assert again.exitcode == 0, said.read_text()
    assert results(new) == expected
    assert not [p for p in new.rglob("*") if ".part" in p.name or ".incomplete" in p.name or p.suffix == ".jsonl"]


INTERRUPTED_WHILE_CLEANING = """
import os, signal, time
from tsm_fmu.cli import app, main

class Kept:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        sum(range(10000))

@app.command("clean")
def clean():
    Kept()
    time.sleep(30.0)
    print("never told of it")

main(["clean"])
"""


def test_an_interrupt_in_a_finalizer_is_not_lost(tmp_path):
    """Python prints and forgets what `__del__` raises; a user's Ctrl-C must neither be shown so nor forgotten."""
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_WHILE_CLEANING], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "tsm-fmu: interrupted\n")


def test_an_interrupted_identification_keeps_its_best_and_says_that_it_is_none(lab, monkeypatch, capsys, tmp_path):
    """A script that goes on by the exit code must not take the values for the optimum."""
    seen = []

    class Stopping:
        def __enter__(self):
            return self.update

        def __exit__(self, *_):
            pass

        def update(self, at):
            seen.append(at)
            if len(seen) == 3:
                raise KeyboardInterrupt

    monkeypatch.setattr(identify, "_progress", Stopping)
    kept = tmp_path / "kept.toml"
    assert run(["identify", "PairedTsmBacklash", "--measured", str(lab / "log.csv"), "--out", str(kept)]) == 130
    assert capsys.readouterr().err.endswith(f"tsm-fmu: interrupted; the best until then is kept in {kept}\n")
    assert tsm.read_card(kept).provenance.method.endswith(", interrupted")


def test_a_diagnosis_interrupted_on_the_way_to_a_better_model_says_so(tmp_path, lab, monkeypatch, capsys):
    found = Diagnosis("none", answer="Nothing is missing.", complete=False)
    monkeypatch.setattr("tsm_fmu.verbs.diagnose.diagnose", lambda *_, **__: found)
    line = ["diagnose", MODEL, "--measured", str(lab / "log.csv"), "--out", str(tmp_path), "--improve"]
    assert run(line) == 130
    said = capsys.readouterr()
    assert said.out.startswith("Nothing is missing.")
    way = "interrupted on the way to a better model"
    assert said.err.endswith(f"tsm-fmu: {way}; the diagnosis is kept in {tmp_path}\n")


INTERRUPTED_IN_COMPILED_CODE = """
import os, signal, time
import numpy.lib._npyio_impl as npz
from scipy.stats import qmc
from tsm_fmu.cli import app, main
from tsm_fmu.regression.seeds import load_direction_numbers

read = npz.NpzFile.__getitem__

def interrupted(archive, key):
    npz.NpzFile.__getitem__ = read
    os.kill(os.getpid(), signal.SIGINT)
    sum(range(10000))
    return read(archive, key)

@app.command("draw")
def draw(held: bool = False):
    npz.NpzFile.__getitem__ = interrupted
    try:
        load_direction_numbers() if held else qmc.Sobol(2)
        time.sleep(30.0)
    except KeyboardInterrupt:
        print(qmc.Sobol(2, scramble=False).random_base2(2).tolist())
        raise

main(GIVEN)
"""


@pytest.mark.parametrize("held", [True, False])
def test_an_interrupt_in_compiled_code_that_cannot_raise_is_not_lost(tmp_path, held):
    """Cython shows as a traceback and forgets what arrives while scipy reads Sobol's numbers."""
    code = INTERRUPTED_IN_COMPILED_CODE.replace("GIVEN", repr(["draw", *["--held"] * held]))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    drawn = "[[0.0, 0.0], [0.5, 0.5], [0.75, 0.25], [0.25, 0.75]]\n"
    assert (done.returncode, done.stdout, done.stderr) == (130, drawn, "tsm-fmu: interrupted\n")
