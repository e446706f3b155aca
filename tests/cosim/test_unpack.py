"""Archives: size, paths, and folders that do not stay behind, whatever ends the process."""

import re
import subprocess
import sys
import tempfile
import tracemalloc
import zipfile
from pathlib import Path

import pytest

from tsm_fmu import InputError
from tsm_fmu.cosim import unpack
from tsm_fmu.cosim.description import describe
from tsm_fmu.cosim.unpack import unpacked
from tsm_fmu.fmu.validate import validate_fmu


def with_zeros(fmu: Path, path: Path, size: int) -> Path:
    """The unit with a member of zeros, which packs to a thousandth."""
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, old.read(name))
        with new.open("resources/zeros.bin", "w", force_zip64=True) as member:
            for _ in range(size // 10_000_000):
                member.write(bytes(10_000_000))
    return path


@pytest.fixture(scope="module")
def bomb(foreign, tmp_path_factory):
    return with_zeros(foreign["gain"], tmp_path_factory.mktemp("bomb") / "bomb.fmu", 300_000_000)


def test_an_archive_that_grows_without_measure_is_refused_and_not_read(bomb):
    expected = re.escape(f"FMU {bomb} unpacks to 0.301 GB, ") + r"\d+ times its size -- expected at most 2 GB"
    tracemalloc.start()
    with pytest.raises(InputError, match=expected), unpacked(bomb):
        pass
    with pytest.raises(InputError, match=expected):
        describe(bomb)
    assert [re.match(expected, line) is not None for line in validate_fmu(bomb)] == [True]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50_000_000


def test_what_is_allowed_by_name_is_validated_in_parts(foreign, tmp_path, monkeypatch):
    large = with_zeros(foreign["gain"], tmp_path / "large.fmu", 40_000_000)
    monkeypatch.setattr(unpack, "GROWTH_FROM", 0.01)
    assert any("times its size" in line for line in validate_fmu(large))
    monkeypatch.setenv(unpack.LIMIT_VARIABLE, "1")
    validate_fmu(foreign["gain"])  # imports its tools before memory is counted
    tracemalloc.start()
    assert not any("times its size" in line for line in validate_fmu(large))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 25_000_000
    monkeypatch.setenv(unpack.LIMIT_VARIABLE, "0.03")
    with pytest.raises(InputError, match=r"expected at most 0\.03 GB"):
        describe(large)
    monkeypatch.setenv(unpack.LIMIT_VARIABLE, "plenty")
    with pytest.raises(InputError, match=r"^TSM_FMU_UNPACK_GB 'plenty' -- expected a number of GB"):
        describe(large)


KILLED = """
import os, sys
from pathlib import Path
from tsm_fmu.cosim.unpack import unpacked
with unpacked(Path(sys.argv[1])) as folder:
    print(folder, flush=True)
    os.kill(os.getpid(), 9)
"""
ALIVE = KILLED.replace("os.kill(os.getpid(), 9)", "input()")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="folders are locked where fcntl is")
def test_a_folder_that_a_killed_process_left_is_removed_by_the_next_and_a_living_ones_is_not(
    foreign, tmp_path, monkeypatch
):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    arguments = [sys.executable, "-c", KILLED, str(foreign["gain"])]
    left = Path(subprocess.run(arguments, capture_output=True, text=True).stdout.strip())
    assert (left / "modelDescription.xml").is_file()
    arguments[2] = ALIVE
    with subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as living:
        assert living.stdout is not None
        used = Path(living.stdout.readline().strip())
        assert not left.exists()
        with unpacked(foreign["gain"]) as own:
            assert (used / "modelDescription.xml").is_file()
        living.communicate("\n")
    assert not used.exists()
    assert not own.exists()
