"""Random logs, mappings, cards and results: no traceback, no hang, one line and exit code 2 where they are refused."""

import os
import warnings

import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from tsm_fmu.cli.app import run

FEW = settings(
    max_examples=100, deadline=None, database=None, suppress_health_check=list(HealthCheck), print_blob=True
)  # fmt: skip
numbers = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True).map(str), st.integers(-(10**6), 10**6).map(str),
    st.sampled_from(["", "oops", "1,5", "1e400", "0x1p3", "2026-05-04T12:00:00.5", "12:00:01", "\x00", '"', "NaN"]),
)  # fmt: skip
cells = st.one_of(
    st.sampled_from([
        "time [s]", "time", "t", "Time (s)", "x_in [rad]", "x_out (deg)", "tau_in [N.m]", "F", "[9**9**9**9]",
        "x [2**2**2**9 m]", "y [m**999999999]", "", "s", "rad", "#", "a]b[c",
    ]),
    st.text(max_size=12),
)  # fmt: skip
ends = st.sampled_from(["\n", "\r", "\r\n", "\n\n"])


@st.composite
def logs(draw):
    """A table with faults: of the dialect, of the header, of some cells; a good one is in it by far too seldom."""
    separator, end, width = draw(st.sampled_from([",", ";", "\t", "|", " "])), draw(ends), draw(st.integers(1, 4))
    head = draw(st.lists(cells, min_size=width, max_size=width))
    if draw(st.booleans()):
        head[0] = "time [s]"
    scale = draw(st.sampled_from([1.0, 1e300, 1e-300, 1e9, -1.0, 0.0]))
    rows = [[f"{k * scale!r}", *(f"{k * k % 7}.5" for _ in head[1:])] for k in range(draw(st.integers(0, 12)))]
    for _ in range(draw(st.integers(0, 2))):
        if rows:
            draw(st.sampled_from(rows))[draw(st.integers(0, width - 1))] = draw(numbers)
    lines = draw(st.lists(st.text(max_size=20), max_size=2)) + [separator.join(row) for row in [head, *rows]]
    text = end.join(lines).encode(draw(st.sampled_from(["utf-8", "utf-16", "utf-16-le", "latin-1"])), "replace")
    return text + draw(st.binary(max_size=3))


def answered(arguments, capfd):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        code = run([str(argument) for argument in arguments])
    said = capfd.readouterr()
    assert code in (0, 2), said.err
    assert "Traceback" not in said.err
    assert code == 0 or said.err.rstrip("\n").rpartition("\n")[2].startswith("tsm-fmu: ")


@pytest.mark.parametrize("name", ["own.csv", "own.csv.gz", "own.parquet"])
def test_logs(tmp_path, capfd, name):
    path = tmp_path / name

    @seed(1717)
    @FEW
    @given(logs(), st.lists(st.tuples(cells, cells), max_size=2))
    def fuzz(content, maps):
        path.write_bytes(content)
        options = [f"--map={log}={target}" for log, target in maps]
        answered(["check", path, *options], capfd)

    fuzz()


def test_tables_of_names_and_deep_nesting(tmp_path, capfd):
    log, card, result = tmp_path / "own.csv", tmp_path / "card.toml", tmp_path / "out" / "diagnosis.json"
    log.write_text("time [s],x_in [rad]\n0,1\n1,2\n2,1\n")
    result.parent.mkdir()
    for depth in (50, 1000, 4000):
        for text in (f"a = {'[' * depth}{']' * depth}\n", f"{'a.' * depth}a = 1\n", f"[{'a.' * depth}a]\nb = 1\n"):
            card.write_text(text)
            answered(["simulate", card, "--input", log, "--out", tmp_path / "s.csv"], capfd)
            (tmp_path / "log.toml").write_text(text)
            answered(["check", log], capfd)
            (tmp_path / "log.toml").unlink()
        for text in ("[" * depth + "]" * depth, '{"a":' * depth + "1" + "}" * depth):
            result.write_text(text)
            answered(["report", result.parent], capfd)


def test_paths_that_are_no_logs(tmp_path, capfd, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "own.csv").write_text("time [s],x_in [rad]\n0,1\n1,2\n2,1\n")
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "a.csv").symlink_to(tmp_path / "b.csv")
    (tmp_path / "b.csv").symlink_to(tmp_path / "a.csv")
    for path, message in (
        (tmp_path / "pipe.csv", "is a pipe or a device -- expected a regular file"),
        ("/dev/zero", "is a pipe or a device"),
        (tmp_path / "a.csv", "symbolic links -- expected a readable file"),
        ("a\x00b.csv", "-- expected the name of a file, without zero bytes"),
        ("~nobody_at_all/own.csv", "-- check the path"),
        (tmp_path, "directory -- expected a readable file"),
    ):
        assert run(["check", str(path)]) == 2
        said = capfd.readouterr().err
        assert message in said or "expected a known user" in said
        assert said.count("\n") == 1
        assert said.count(" -- ") == 2
    assert run(["check", "~/own.csv"]) == 0
    for times in ("0,1\n1e300,2\n2e300,1\n", "0,1\n1e-300,2\n2e-300,1\n"):
        (tmp_path / "own.csv").write_text("time [s],x_in [rad]\n" + times)
        assert run(["check", "~/own.csv"]) == 2
        assert "s between samples -- correct the unit of time" in capfd.readouterr().err
