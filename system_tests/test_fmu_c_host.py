"""The Python flavour in a host written in C: threads, order of calls, log, and what it says where it cannot load."""

import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel

from . import c_host

NAME = "PairedTsmBacklash"
X_IN, X_OUT = 5, 6
START = ("instantiate", "setup", "enter", "exit")
Call = Callable[..., list[str]]


@pytest.fixture(scope="session")
def program(tmp_path_factory) -> Path:
    try:
        c_host.libpython()
        return c_host.compiled(tmp_path_factory.mktemp("c_host"))
    except c_host.Missing as missing:
        pytest.skip(str(missing))


@pytest.fixture(scope="session")
def folder(fmus, tmp_path_factory) -> Path:
    return Path(fmpy.extract(str(fmus(NAME)), str(tmp_path_factory.mktemp("unit") / NAME)))


@pytest.fixture
def host(program, folder) -> Call:
    """``host(call, ...)``: lines that the program printed."""

    def lines(*calls: str, where: Path = folder, **options: str) -> list[str]:
        done = c_host.run(program, where, *calls, **options)
        assert done.returncode == 0, (done.returncode, done.stdout[-2000:], done.stderr[-2000:])
        return done.stdout.splitlines()

    return lines


def expected_sum(steps: int) -> float:
    """What a thread of the C host adds up."""
    k = kernel(NAME)
    n = np.arange(steps)
    inputs = np.concatenate([[0.0], 0.5 * ((n % 2000) - 1000) / 1000])
    return float(k.simulate(k.params(), np.arange(steps + 1) / 1024, inputs[:, None], compiled=False)[1:, 0].sum())


def test_threads_with_an_instance_each_compute_the_same(host):
    lines = host(f"threads=5,1500,{X_IN},{X_OUT}")
    assert len(lines) == 5
    for line in lines:
        assert re.fullmatch(r"thread 0 [\d.]+ us \S+", line)
        assert float(line.split()[-1]) == pytest.approx(expected_sum(1500), rel=1e-12)


def test_thirty_runs_of_threads_end_well(host):
    """The state of each thread is kept until the process ends: nothing may stumble over it then."""
    found = {tuple(line.split()[-1] for line in host(f"threads=4,50,{X_IN},{X_OUT}")) for _ in range(30)}
    assert len(found) == 1


def test_a_library_that_is_unloaded_and_loaded_again_starts_afresh(host):
    run = (*START, f"set={X_IN},0.5", "step=0,0.1", f"get={X_OUT}", "terminate", "free")
    lines = host(*run, "reload", f"threads=3,40,{X_IN},{X_OUT}", "reload", *run)
    first, second = lines[: len(lines) // 2 - 1], lines[len(lines) // 2 + 2 :]
    assert lines[len(first) : -len(second)] == [line for line in lines if line.startswith("thread 0")]
    assert first == second
    k = kernel(NAME)
    expected = k.simulate(k.params(), np.array([0.0, 0.1]), np.array([[0.0], [0.5]]), compiled=False)[1, 0]
    assert [float(line.split()[1]) for line in first if line.startswith("value")] == [expected]


def test_an_instance_passed_from_thread_to_thread_keeps_no_memory_for_each(host):
    (line,) = host(f"passing=1200,{X_IN},{X_OUT}")
    worst, memory, total = re.fullmatch(r"passing (\d) (-?\d+) B (\S+)", line).groups()  # type: ignore[union-attr]
    assert worst == "0"
    assert int(memory) < 200  # of the last 600 threads, which do not keep their state
    assert float(total) == pytest.approx(expected_sum(1200), rel=1e-12)


@pytest.mark.parametrize("logging", [0, 1])
def test_refused_steps_keep_no_memory(host, logging):
    line = host(f"logging={logging}", *START, "refused=40000")[-1]
    worst, memory = re.fullmatch(r"refused (\d) (-?\d+) B", line).groups()  # type: ignore[union-attr]
    assert worst == "2"
    assert int(memory) < 24  # a text is 200


def test_without_logging_what_goes_wrong_reaches_the_host_and_nothing_else(host):
    lines = host("logging=0", *START, "step=0,0", "step=0,0.1")
    told = [line for line in lines if line.startswith("log ")]
    assert told == [
        f"log one 2 logStatusDiscard {NAME}: step size 0.0 s at t = 0.0 s -- expected a positive finite number -- "
        "correct it"
    ]
    assert lines[-1] == "step=0,0.1 0"


@pytest.mark.parametrize("logging", [0, 1])
def test_a_host_without_a_logger_is_not_called(host, logging):
    lines = host("logger=0", f"logging={logging}", *START, "step=0,0", "enter", "step=0,0.1", "terminate", "free")
    assert lines[-5:] == ["step=0,0 2", "enter 0", "step=0,0.1 2", "terminate 0", "free 0"]


def test_the_first_line_of_the_log_says_which_python_it_is_and_which_is_needed(host):
    first = host("logging=1", *START)[1]
    running = ".".join(map(str, sys.version_info[:3]))
    assert first.startswith(f"log one 0 logAll {NAME}: runs on Python {running}. Needs Python 3.10 or later")


@pytest.mark.parametrize(
    ("calls", "expected"),
    [
        (("setup", "exit"), "exitInitializationMode in an instance that is instantiated"),
        (("setup", "enter", "enter", "exit"), "enterInitializationMode in an instance that is in initialisation mode"),
        (("setup", "enter", "exit", "enter"), "enterInitializationMode in an instance that is running"),
        (("setup", "enter", "exit", "terminate"), "step -- expected before the end of the simulation"),
        (("setup", "enter"), "step -- expected after the end of initialisation"),
    ],
)
def test_a_step_after_a_call_out_of_order_is_refused_until_a_reset(host, calls, expected):
    lines = host("instantiate", *calls, "step=0,0.1", "reset", *START[1:], "step=0,0.1", "terminate", "free")
    assert "step=0,0.1 2" in lines
    assert any(line.startswith("log ") and expected in line for line in lines)
    assert lines[-3:] == ["step=0,0.1 0", "terminate 0", "free 0"]


def test_another_model_description_is_refused_at_instantiation(host, folder, tmp_path):
    mixed = tmp_path / "mixed"
    shutil.copytree(folder, mixed)
    description = mixed / "modelDescription.xml"
    guid = fmpy.read_model_description(str(folder)).guid
    description.write_text(description.read_text().replace(f'guid="{guid}"', 'guid="other"'))
    lines = host(*["instantiate"] * 50, where=mixed)
    assert lines.count("instantiate 4") == 50
    assert f"guid other in modelDescription.xml -- expected {guid} -- build the FMU again" in lines[0]


def test_resource_locations_as_a_file_uri_and_as_a_path(host, folder):
    calls = (*START, "set=5,0.25", "step=0,0.1", "get=6")
    assert host(*calls) == host(*calls, uri=f"{folder}/resources")


def test_without_libpython_the_loader_says_what_the_readme_says(host):
    readme = (Path(__file__).parents[1] / "fmus" / "README.md").read_text()
    assert "undefined symbol: _Py_NoneStruct" in readme
    with pytest.raises(AssertionError, match=r"\(3, 'cannot load: .*undefined symbol: _Py_NoneStruct"):
        host("instantiate", python="-")


def test_the_archive_says_what_the_library_needs(fmus):
    """The newest symbol versions, read here with the system's own tool."""
    if not shutil.which("objdump"):
        pytest.skip("no objdump here: install binutils")
    with zipfile.ZipFile(fmus(NAME)) as archive:
        library = Path(archive.extract(f"binaries/linux64/{NAME}.so", fmus(NAME).parent / "library"))
        text = archive.read("modelDescription.xml").decode()
    listed = subprocess.run(["objdump", "-T", library], capture_output=True, text=True, check=True).stdout
    for symbols, said in (("GLIBC", "glibc "), ("GLIBCXX", "GLIBCXX_")):
        versions = {tuple(map(int, v.split("."))) for v in re.findall(rf"\b{symbols}_([\d.]+)", listed)}
        assert f"{said}{'.'.join(map(str, max(versions)))} " in text
