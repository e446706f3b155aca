"""Every sort of damage is found and told in one line."""

import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from tsm_fmu.cli.app import run
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.validate import validate_fmu
from tsm_fmu.kernels.kernel import kernel

XML = "modelDescription.xml"


@pytest.fixture(scope="module")
def fmu(tmp_path_factory) -> Path:
    return build_fmu(kernel("PairedTsmBacklash"), tmp_path_factory.mktemp("validate"))


def changed(fmu: Path, target: Path, change: Callable[[dict[str, bytes]], None]) -> Path:
    with zipfile.ZipFile(fmu) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    change(files)
    with zipfile.ZipFile(target, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return target


def replaced(name: str, old: bytes, new: bytes) -> Callable[[dict[str, bytes]], None]:
    def change(files: dict[str, bytes]) -> None:
        (path,) = [p for p in files if p.endswith(name)]
        assert old in files[path]
        files[path] = files[path].replace(old, new)

    return change


def without(name: str) -> Callable[[dict[str, bytes]], object]:
    return lambda files: [files.pop(path) for path in list(files) if path.endswith(name)]


def test_an_undamaged_fmu_has_no_problem(fmu):
    assert validate_fmu(fmu) == []


def test_packing_again_is_no_damage(fmu, tmp_path):
    assert validate_fmu(changed(fmu, tmp_path / "again.fmu", lambda files: None)) == []


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda files: files.pop(XML), f"has no {XML} -- expected one at the top"),
        (lambda files: files.update({XML: b""}), f"{XML} of .* is not XML"),
        (lambda files: files.update({XML: files[XML][:700]}), f"{XML} of .* is not XML"),
        (replaced(XML, b'unit="1/rad"', b'unit="1/red"'), "FMPy: .*1/red"),
        (replaced(XML, b'causality="input" variability="continuous"', b'causality="inlet"'), "FMPy: .*inlet"),
        (replaced(XML, b'<Unknown index="7" dependencies="6" />', b""), "fmu-manipulation-toolbox: .*x_out"),
        (replaced(XML, b'start="10.1062"', b'start="11.5"'), "guid .* does not belong to the content"),
        (replaced("paired_tsm_backlash.py", b"p.c * u.x_in", b"2.0 * u.x_in"), "does not belong to the content"),
        (replaced(XML, b'guid="', b'guid="0'), "expected a UUID"),
        (lambda files: [files.pop(f) for f in list(files) if f.startswith("binaries/")], "no library named"),
        (replaced("slavemodule.txt", b"PairedTsmBacklash", b"Another"), "slavemodule.txt names 'Another_"),
        (without("fmi-ls-manifest.xml"), "fmi-ls-manifest.xml is missing -- expected reference results"),
        (without("PairedTsmBacklash_out.csv"), "PairedTsmBacklash_out.csv is missing -- expected what the manifest"),
        (replaced("PairedTsmBacklash_out.csv", b"0.5,", b"0.51,"), "has not the checksum of the manifest"),
        (
            replaced("PairedTsmBacklash_out.csv", b'"x_h"', b'"x_k"'),
            "columns time, x_out, x_k -- expected time, x_out,",
        ),
        (replaced("PairedTsmBacklash_in.csv", b"\n0.5,", b"\n0.5,7,"), "has 3 cells in line 34 -- expected 2"),
        (replaced("PairedTsmBacklash_in.csv", b"\n0.5,", b"\n0.5,x"), r"in.csv, line 34, is 'x.*expected a finite"),
        (replaced("PairedTsmBacklash_in.csv", b"\n0.5,", b"\n0.6,"), "has not a row at every 0.015625 s"),
        (replaced("validation.exp", b'stopTime="', b'stopTime="1'), "has not a row at every 0.015625 s up to 1"),
        (replaced("validation.exp", b"</Experiments>", b""), "validation.exp is not XML"),
        (replaced("fmi-ls-manifest.xml", b"experiment/", b"testcase/"), "lists no experiment"),
        (replaced("validation.exp", b"Stimuli", b"Stimulus"), "experiment validation names no Stimuli"),
        (replaced("parameters.ssv", b"10.1062", b"10.2"), "parameters.ssv differs in alpha"),
    ],
)
def test_damage_is_found(fmu, tmp_path, change, expected):
    problems = validate_fmu(changed(fmu, tmp_path / "damaged.fmu", change))
    assert any(re.search(expected, line) for line in problems), problems
    assert not [line for line in problems if "\n" in line or "Traceback" in line]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "expected an existing file -- build it with 'tsm-fmu build'"),
        (b"", "cannot be unpacked .* expected an undamaged zip"),
        (b"PK\x03\x04 not really", "cannot be unpacked"),
    ],
)
def test_files_that_are_no_archives(tmp_path, content, expected):
    path = tmp_path / "x.fmu"
    if content is not None:
        path.write_bytes(content)
    (line,) = validate_fmu(path)
    assert re.search(expected, line)


def test_a_cut_or_flipped_archive_never_raises(fmu, tmp_path):
    data, path = fmu.read_bytes(), tmp_path / "x.fmu"
    for size in (100, len(data) // 2, len(data) - 10):
        path.write_bytes(data[:size])
        assert validate_fmu(path)
    for place in range(1000, len(data), len(data) // 7):
        path.write_bytes(data[:place] + bytes([data[place] ^ 0x5A]) + data[place + 1 :])
        assert validate_fmu(path)


@pytest.mark.parametrize("ending", [".so", "license.txt", "slavemodule.txt"])
def test_a_damaged_member_is_the_only_problem_that_is_told(fmu, tmp_path, ending):
    """No tool gets to unpack it."""
    with zipfile.ZipFile(fmu) as archive:
        member = next(i for i in archive.infolist() if i.filename.endswith(ending))
    data, place = (
        bytearray(fmu.read_bytes()),
        member.header_offset + 30 + len(member.filename) + member.compress_size // 2,
    )
    data[place] ^= 0x5A
    (tmp_path / "x.fmu").write_bytes(bytes(data))
    (line,) = validate_fmu(tmp_path / "x.fmu")
    assert "cannot be unpacked" in line


def test_a_folder_is_no_fmu(tmp_path):
    assert "expected an existing file" in validate_fmu(tmp_path)[0]


def test_verb_validate(fmu, tmp_path, capsys):
    assert run(["validate", str(fmu)]) == 0
    assert "no problem" in capsys.readouterr().out
    missing = str(tmp_path / "missing.fmu")
    assert run(["validate", str(fmu), missing, "--json"]) == 2
    found = json.loads(capsys.readouterr().out)["problems"]
    assert found[str(fmu)] == []
    assert len(found[missing]) == 1


def test_verb_build(tmp_path, capsys):
    assert run(["build", "PairedTsmBacklash", "--out", str(tmp_path / "new"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "fmus": {"PairedTsmBacklash": str(tmp_path / "new" / "PairedTsmBacklash.fmu")}
    }


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["Backlash"], "model 'Backlash' -- expected one of "),
        (["--flavour", "both", "--fmi", "3"], "--flavour both with --fmi 3 -- PythonFMU writes FMI 2.0 only"),
        (["--fmi", "3"], "--flavour python with --fmi 3 -- PythonFMU writes FMI 2.0 only"),
        (["--fmi", "1"], "--fmi 1 -- expected 2 or 3"),
        (["--flavour", "rust"], "'rust'"),
        (["--out", __file__], "is a file -- expected a folder"),
    ],
)
def test_verb_build_refuses(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert run(["build", *arguments]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert not list(tmp_path.iterdir())
