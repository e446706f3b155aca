"""Unpack an FMU to a temporary folder that every FMU can be loaded from.

PythonFMU units crash when the path has characters that a URI escapes (``#``, ``%``, ``+``, blanks, umlauts),
so the folder's own name is plain, and the system's folder for temporary files is used only if it is.

A folder is removed at the end of its context. One that a killed process left is removed by the next process: each
holds a lock on its folders as long as it lives.
"""

from __future__ import annotations

import contextlib
import os
import platform
import re
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path, PurePosixPath

from ..models.contract import InputError

try:
    import fcntl
except ImportError:  # Windows removes nothing that a killed process left
    fcntl = None

_PLAIN = re.compile(r"[A-Za-z0-9_./:\\~-]+")
_SYSTEM = {"Windows": "win", "Darwin": "darwin"}.get(platform.system(), "linux")
_PREFIX, _LOCK = "tsm_fmu_", ".in_use"
LIMIT_VARIABLE = "TSM_FMU_UNPACK_GB"
MOST_UNPACKED = 2.0
"""More than this [GB] is not unpacked, unless the variable above allows more."""
MOST_GROWTH, GROWTH_FROM = 100.0, 0.1
"""Nor what grows by more than this factor, from this size on [GB]: zeros, not a library."""


_UNUSED = re.compile(
    r"(documentation|sources|terminalsAndIcons|extra/org\.fmi-standard\.fmi-ls-ref)/"
    r"|binaries/(\w+-)?(?P<system>darwin|linux|win)[^/]*/"
)
"""Members of an FMU that no simulation reads, and binaries, which are looked at once more: see `_needed`."""


@contextmanager
def unpacked(archive: Path, kind: str = "FMU") -> Iterator[Path]:
    """Yield a folder with an FMU or SSP (``kind``); it is removed at the end.

    Of an FMU what a simulation here may read: no documentation, sources, icons, reference results, nor binaries of
    other systems. Writing files is most of what a short run costs.

    Raises
    ------
    InputError
        If the archive is damaged or too large, a member would land outside the folder, or no plain folder exists.
    """
    parent = _plain_parent()
    _remove_left_by_dead(parent)
    folder = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=parent))
    with contextlib.ExitStack() as stack:
        stack.callback(shutil.rmtree, folder, ignore_errors=True)
        if fcntl is not None:
            lock = stack.enter_context((folder / _LOCK).open("w"))
            fcntl.flock(lock, fcntl.LOCK_EX)
        with opened(archive, kind) as members:
            members.extractall(folder, [n for n in members.namelist() if kind != "FMU" or _needed(n)])
        yield folder


@contextmanager
def opened(archive: Path, kind: str = "FMU") -> Iterator[zipfile.ZipFile]:
    """Yield the archive, its members known to land inside a folder and to be of sensible size.

    Raises
    ------
    InputError
        As `unpacked`; also for damage that is found while the context reads.
    """
    try:
        with zipfile.ZipFile(archive) as members:
            _check_names(archive, kind, members.namelist())
            _check_size(archive, kind, sum(member.file_size for member in members.infolist()))
            yield members
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, RuntimeError) as failure:
        reason = " ".join(str(failure).split())
        raise InputError(
            f"{kind} {archive} cannot be unpacked ({reason}) -- expected an undamaged zip archive -- get it again"
        ) from failure


def _needed(member: str) -> bool:
    found = _UNUSED.match(member)
    return found is None or found["system"] == _SYSTEM  # 32 bits too: they may serve a library of 64


def _check_names(archive: Path, kind: str, names: list[str]) -> None:
    for name in names:
        path = PurePosixPath(name.replace("\\", "/"))
        if path.is_absolute() or ".." in path.parts or ":" in name:
            raise InputError(f"{kind} {archive} has the member {name!r} -- expected paths inside it -- do not use it")


def _check_size(archive: Path, kind: str, size: int) -> None:
    allowed = os.environ.get(LIMIT_VARIABLE, "")
    try:
        limit = float(allowed or MOST_UNPACKED)
    except ValueError:
        raise InputError(f"{LIMIT_VARIABLE} {allowed!r} -- expected a number of GB -- correct or unset it") from None
    has, grown = size / 1e9, size / max(1, archive.stat().st_size)
    if has > limit or (not allowed and has > GROWTH_FROM and grown > MOST_GROWTH):
        raise InputError(
            f"{kind} {archive} unpacks to {has:.3g} GB, {grown:.0f} times its size -- expected at most {limit:g} GB "
            f"and {MOST_GROWTH:g} times -- do not use it, or set {LIMIT_VARIABLE} if it is right"
        )


def _plain_parent() -> Path:
    for parent in (None, "/tmp", "/var/tmp", "C:\\Users\\Public"):
        place = Path(parent or tempfile.gettempdir()).resolve()
        if place.is_dir() and _PLAIN.fullmatch(str(place)):
            return place
    raise InputError(
        f"temporary folder {tempfile.gettempdir()!r} -- expected a path of letters, digits, '_' and '-', from which "
        "FMUs can be loaded -- set TMPDIR to one"
    )


@cache
def _remove_left_by_dead(parent: Path) -> None:
    """Remove the folders of processes that are gone, once in each process."""
    if fcntl is None:
        return
    for lock in parent.glob(f"{_PREFIX}*/{_LOCK}"):
        with contextlib.suppress(OSError), lock.open() as file:  # another user's, or in use
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(lock.parent, ignore_errors=True)
