"""The C compiler: `ziglang`, a package that brings clang and the libraries of every platform along.

Nothing is fetched: what a platform needs is in the package as source and compiled at the first use of that platform,
then kept in the user's cache folder.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Collection, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from platform import machine
from tempfile import TemporaryDirectory

from ...models.contract import InputError

FLAGS = (
    "-std=c99", "-ffp-contract=off", "-fvisibility=hidden", "-fno-sanitize=all", "-fno-math-errno", "-g0",
    "-fomit-frame-pointer",
)  # fmt: skip
"""Without contraction and fast-math: the bits are those of plain Python."""

GLIBC = "2.17"
"""Oldest C library of Linux that the binaries run with."""


FAST = ("-O2", "-mllvm", "-inline-threshold=1000")
"""A step in one piece costs two thirds of one in several functions."""

LIMIT = 100_000
"""Size of a library [B] from which on the model's own equations are compiled for size too."""

SMALL = ("-Os", "-DSMALL", "-fno-asynchronous-unwind-tables", "-fno-unwind-tables", "-D_FORTIFY_SOURCE=0")
"""Options from there on."""

SMALLEST = (*SMALL, "-mllvm", "-inline-threshold=-10")
"""Options where it still reaches the limit: fewer copies of small functions."""

WINDOWS = "windows.c"
"""Stands around the sources there, see it."""
_UCRT = tuple(f"-lapi-ms-win-crt-{part}-l1-1-0" for part in "convert heap math private runtime stdio string".split())


_MACOS = ("-Wl,-x", "-Wl,-headerpad,0x0")  # neither names of static functions nor a page of free space
_TEXTS_AS_DATA = ("-fwritable-strings",)  # pages of 16 kB: texts fill up that of the data


@dataclass(frozen=True)
class Platform:
    """One binary of an FMU: zig's target, folder by FMI version, ending, options of the linker.

    ``main`` is compiled in place of the unit's own file, ``small`` are further options where size counts.
    """

    target: str
    folders: Mapping[int, str]
    ending: str
    linking: tuple[str, ...]
    main: str = ""
    small: tuple[str, ...] = ()


PLATFORMS = (
    Platform(f"x86_64-linux-gnu.{GLIBC}", {2: "linux64", 3: "x86_64-linux"}, ".so", ("-lm",)),
    Platform("x86_64-windows-gnu", {2: "win64", 3: "x86_64-windows"}, ".dll", ("-nostdlib", *_UCRT), WINDOWS),
    Platform("x86_64-macos", {2: "darwin64", 3: "x86_64-darwin"}, ".dylib", _MACOS),
    Platform(f"aarch64-linux-gnu.{GLIBC}", {3: "aarch64-linux"}, ".so", ("-lm",)),
    Platform("aarch64-macos", {3: "aarch64-darwin"}, ".dylib", _MACOS, small=_TEXTS_AS_DATA),
)


def loaded_here(fmi: int = 2) -> tuple[str, ...]:
    """Folder of the library that this machine loads; empty, which means all of them, where there is none for it.

    Parameters
    ----------
    fmi : int
        2 or 3.
    """
    system = {"linux": "linux", "win32": "windows", "darwin": "macos"}.get(sys.platform)
    processor = {"AMD64": "x86_64", "arm64": "aarch64"}.get(machine(), machine())
    return tuple(
        p.folders[fmi] for p in PLATFORMS if fmi in p.folders and p.target.split("-")[:2] == [processor, system]
    )


def binaries(
    sources: Mapping[str, bytes], main: str, name: str, fmi: int, folders: Collection[str] = ()
) -> dict[str, bytes]:
    """Shared libraries of an FMU for all platforms of its FMI version, by archive path.

    Parameters
    ----------
    sources : mapping of str to bytes
        C files by name.
    main : str
        The one to compile; it includes the others.
    name : str
        Of the libraries: the model identifier.
    fmi : int
        2 or 3.
    folders : collection of str
        Platforms by their folder in ``binaries``; default all.

    Raises
    ------
    InputError
        An unknown platform, or a compiler that is missing or refuses.
    """
    known = {p.folders[fmi]: p for p in PLATFORMS if fmi in p.folders}
    for folder in folders:
        if folder not in known:
            raise InputError(f"platform {folder!r} of FMI {fmi} -- expected one of {', '.join(known)} -- choose one")
    wanted = [known[folder] for folder in folders or known]
    with TemporaryDirectory(prefix="tsm_fmu_c_") as place:
        for file, data in sources.items():
            (Path(place) / file).write_bytes(data)
        (Path(place) / WINDOWS).write_bytes(resources.files("tsm_fmu.fmu.native").joinpath("c", WINDOWS).read_bytes())
        with ThreadPoolExecutor(min(len(wanted), os.cpu_count() or 1)) as pool:
            found = pool.map(lambda p: (_place(p, name, fmi), _library(p, Path(place), main, name)), wanted)
            return dict(found)


def _place(platform: Platform, name: str, fmi: int) -> str:
    return f"binaries/{platform.folders[fmi]}/{name}{platform.ending}"


def _library(platform: Platform, folder: Path, main: str, name: str) -> bytes:
    library = _compiled(platform, folder, main, name, *FAST)
    for options in (SMALL, SMALLEST):
        if len(library) >= LIMIT:
            library = _compiled(platform, folder, main, name, *options, *platform.small)
    return library


def _compiled(platform: Platform, folder: Path, main: str, name: str, *optimised: str) -> bytes:
    # zig puts the output's name, not its folder, into the library
    out = folder / platform.target / f"{name}{platform.ending}"
    out.parent.mkdir(exist_ok=True)
    built = str(out.with_suffix(".o").relative_to(folder))
    _run(platform, folder, *FLAGS, *optimised, "-c", platform.main or main, "-o", built)
    _run(platform, folder, "-shared", "-s", built, *platform.linking, "-o", str(out.relative_to(folder)))
    return _without_time(out.read_bytes()) if platform.ending == ".dll" else out.read_bytes()


def _without_time(library: bytes) -> bytes:
    """A library for Windows without the time at which it was linked: the same bytes at each build."""
    place = int.from_bytes(library[0x3C:0x40], "little") + 8
    return library[:place] + bytes(4) + library[place + 4 :]


def _run(platform: Platform, folder: Path, *options: str) -> None:
    command = [*zig(), "-target", platform.target, *options]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        raise InputError(
            f"C compiler failed for {platform.target} ({_first_error(done.stderr)}) -- expected C that compiles -- "
            "install ziglang again"
        )


def _first_error(text: str) -> str:
    found = re.search(r"error: .*", text)
    return found.group(0) if found else text.strip()[:200]


def zig() -> tuple[str, ...]:
    """Command of zig's C compiler."""
    return (sys.executable, "-m", "ziglang", "cc")


def c_compiler() -> tuple[str, ...]:
    """Command of a C compiler for this machine: its own, else zig's."""
    own = shutil.which("gcc") or shutil.which("cc")
    return (own,) if own else zig()
