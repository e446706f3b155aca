"""What the compiler is asked for, platform by platform: a compiler that notes its commands stands in for zig."""

from __future__ import annotations

import os
import shutil
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tsm_fmu.fmu.native import zig
from tsm_fmu.fmu.native.zig import binaries, c_compiler
from tsm_fmu.models.contract import InputError

SOURCES = {"all.c": b'#include "other.c"\n', "other.c": b"int answer = 42;\n"}
FOLDERS = {
    2: {"linux64": ".so", "win64": ".dll", "darwin64": ".dylib"},
    3: {"x86_64-linux": ".so", "x86_64-windows": ".dll", "x86_64-darwin": ".dylib", "aarch64-linux": ".so",
        "aarch64-darwin": ".dylib"},
}  # fmt: skip
"""Of the standard: FMI 2.0, 2.3 and FMI 3.0, 2.5.1.4.1 with the names of its table."""


@dataclass
class Compiler:
    """Writes libraries as large as the options make them, and notes each command."""

    sizes: dict[str, int] = field(default_factory=dict)
    commands: list[list[str]] = field(default_factory=list)
    seen: list[dict[str, bytes]] = field(default_factory=list)

    def __call__(self, command: list[str], cwd: Path, capture_output: bool, text: bool) -> SimpleNamespace:
        assert capture_output
        assert text
        self.commands.append(command)
        self.seen.append({p.name: p.read_bytes() for p in cwd.iterdir() if p.is_file()})
        out = cwd / command[command.index("-o") + 1]
        if "-c" in command:
            kind = "smallest" if "-inline-threshold=-10" in command else "small" if "-Os" in command else "fast"
            out.write_text(kind)
        else:
            kind = (cwd / command[command.index("-s") + 1]).read_text()
            header = bytearray(os.urandom(self.sizes.get(kind, 600)))
            header[0x3C:0x40] = (0x104).to_bytes(4, "little")
            out.write_bytes(bytes(header))
        return SimpleNamespace(returncode=0, stderr="")


@pytest.fixture
def compiler(monkeypatch: pytest.MonkeyPatch) -> Compiler:
    one = Compiler()
    monkeypatch.setattr(zig.subprocess, "run", one)
    monkeypatch.setattr(zig.os, "cpu_count", lambda: 1)  # one after the other
    return one


@pytest.mark.parametrize("fmi", [2, 3])
def test_each_platform_of_the_version_has_one_library_where_the_standard_has_it(compiler: Compiler, fmi: int) -> None:
    found = binaries(SOURCES, "all.c", "Wrist", fmi)
    assert list(found) == [f"binaries/{folder}/Wrist{ending}" for folder, ending in FOLDERS[fmi].items()]
    for compiling, linking in zip(compiler.commands[::2], compiler.commands[1::2], strict=True):
        target = compiling[compiling.index("-target") + 1]
        assert linking[linking.index("-target") + 1] == target
        for command in (compiling, linking):
            assert command[:4] == [sys.executable, "-m", "ziglang", "cc"]
        assert {"-std=c99", "-ffp-contract=off", "-fvisibility=hidden"} <= set(compiling)  # the bits of plain Python
        assert not {"-ffast-math", "-Ofast"} & set(compiling)
        assert {"-O2"} == {o for o in compiling if o.startswith("-O")}
        assert ("windows.c" if "windows" in target else "all.c") == compiling[compiling.index("-c") + 1]
        assert {"-shared", "-s"} <= set(linking)
        assert ("-lm" in linking) is ("linux" in target)
        assert ("-nostdlib" in linking) is ("windows" in target)
        assert target.endswith(".2.17") is ("linux" in target)
        assert linking[linking.index("-o") + 1].endswith(linking[linking.index("-s") + 1].removesuffix(".o") +
                                                         Path(linking[linking.index("-o") + 1]).suffix)  # fmt: skip
    assert len(compiler.commands) == 2 * len(found)
    for files in compiler.seen:
        assert files["all.c"] == SOURCES["all.c"]
        assert files["other.c"] == SOURCES["other.c"]
        assert b"all.c" in files["windows.c"]


def test_only_the_platforms_that_are_asked_for_and_known_ones(compiler: Compiler) -> None:
    assert list(binaries(SOURCES, "all.c", "W", 2, ["win64"])) == ["binaries/win64/W.dll"]
    assert list(binaries(SOURCES, "all.c", "W", 3, ["aarch64-linux", "x86_64-linux"])) == [
        "binaries/aarch64-linux/W.so", "binaries/x86_64-linux/W.so"
    ]  # fmt: skip
    before = len(compiler.commands)
    for fmi, folder in ((2, "aarch64-linux"), (3, "linux64")):
        with pytest.raises(InputError) as wrong:
            binaries(SOURCES, "all.c", "W", fmi, [folder])
        known = ", ".join(FOLDERS[fmi])
        assert str(wrong.value) == f"platform {folder!r} of FMI {fmi} -- expected one of {known} -- choose one"
    assert len(compiler.commands) == before


@pytest.mark.parametrize(
    ("sizes", "tries"),
    [
        ({"fast": 99_999}, ["-O2"]),
        ({"fast": 100_000, "small": 99_999}, ["-O2", "-Os"]),
        ({"fast": 150_000, "small": 100_000}, ["-O2", "-Os", "-Os"]),
        ({"fast": 150_000, "small": 140_000, "smallest": 130_000}, ["-O2", "-Os", "-Os"]),
    ],
)
def test_a_library_of_a_tenth_of_a_megabyte_is_compiled_for_size(compiler: Compiler, sizes, tries) -> None:
    compiler.sizes |= sizes
    for folder in ("x86_64-linux", "aarch64-darwin"):
        compiler.commands.clear()
        (library,) = binaries(SOURCES, "all.c", "W", 3, [folder]).values()
        compiling = compiler.commands[::2]
        assert [o for command in compiling for o in command if o in ("-O2", "-Os")] == tries
        assert [("-DSMALL" in command) for command in compiling] == [False, True, True][: len(tries)]
        assert [("-inline-threshold=-10" in command) for command in compiling] == [False, False, True][: len(tries)]
        as_data = [("-fwritable-strings" in command) for command in compiling]
        assert as_data == [folder == "aarch64-darwin" and k > 0 for k in range(len(tries))]
        assert len(library) == {1: sizes["fast"], 2: sizes.get("small"), 3: sizes.get("smallest", 600)}[len(tries)]


def test_a_library_for_windows_has_no_time_in_it_and_all_else(compiler: Compiler) -> None:
    """The stamp is the fourth word after the PE signature's place, whose place stands at 0x3C."""
    bytes_of = bytes(range(1, 256)) * 2
    at = 0x9C
    library = bytes_of[:0x3C] + at.to_bytes(4, "little") + bytes_of[0x40:]
    without = zig._without_time(library)
    assert len(without) == len(library)
    assert [k for k in range(len(library)) if without[k] != library[k]] == [at + 8, at + 9, at + 10, at + 11]
    assert without[at + 8 : at + 12] == bytes(4)
    (made,) = binaries(SOURCES, "all.c", "W", 2, ["win64"]).values()
    assert made[0x104 + 8 : 0x104 + 12] == bytes(4)
    (linux,) = binaries(SOURCES, "all.c", "W", 2, ["linux64"]).values()
    assert linux[0x104 + 8 : 0x104 + 12] != bytes(4)  # random there: once in 4e9 runs this fails by chance


@pytest.mark.parametrize(
    ("stderr", "reason"),
    [
        ("a.c:3:1: warning: odd\na.c:7:2: error: expected ';'\nother error: no\n", "error: expected ';'"),
        ("\n  No module named ziglang\n", "No module named ziglang"),
        ("x" * 300, "x" * 200),
    ],
)
def test_a_compiler_that_fails_is_one_line(monkeypatch, stderr: str, reason: str) -> None:
    def failing(*_: Any, **__: Any) -> SimpleNamespace:
        return SimpleNamespace(returncode=1, stderr=stderr)

    monkeypatch.setattr(zig.subprocess, "run", failing)
    with pytest.raises(InputError) as wrong:
        binaries(SOURCES, "all.c", "W", 2, ["linux64"])
    assert str(wrong.value).startswith(f"C compiler failed for x86_64-linux-gnu.2.17 ({reason}) -- expected C that")


def test_this_machine_compiles_with_its_own_compiler_or_with_zig(monkeypatch) -> None:
    for there, expected in (
        ({"gcc": "/bin/gcc", "cc": "/bin/cc"}, ("/bin/gcc",)),
        ({"cc": "/bin/cc"}, ("/bin/cc",)),
        ({}, (sys.executable, "-m", "ziglang", "cc")),
    ):
        monkeypatch.setattr(shutil, "which", there.get)
        assert c_compiler() == expected
