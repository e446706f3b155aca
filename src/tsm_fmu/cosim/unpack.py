"""Unpack an FMU to a temporary folder that every FMU can be loaded from.

PythonFMU units crash when the path has characters that a URI escapes (``#``, ``%``, ``+``, blanks, umlauts),
so the folder's own name is plain, and the system's folder for temporary files is used only if it is.
"""

from __future__ import annotations

import re
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from ..models.contract import InputError

_PLAIN = re.compile(r"[A-Za-z0-9_./:\\~-]+")


@contextmanager
def unpacked(archive: Path, kind: str = "FMU") -> Iterator[Path]:
    """Yield a folder with the contents of an FMU or SSP (``kind``); it is removed at the end.

    Raises
    ------
    InputError
        If the archive is damaged, a member would land outside the folder, or no plain folder exists.
    """
    folder = _plain_folder()
    try:
        try:
            with zipfile.ZipFile(archive) as members:
                for name in members.namelist():
                    path = PurePosixPath(name.replace("\\", "/"))
                    if path.is_absolute() or ".." in path.parts or ":" in name:
                        raise InputError(
                            f"{kind} {archive} has the member {name!r} -- expected paths inside it -- do not use it"
                        )
                members.extractall(folder)
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, RuntimeError) as failure:
            reason = " ".join(str(failure).split())
            raise InputError(
                f"{kind} {archive} cannot be unpacked ({reason}) -- expected an undamaged zip archive -- get it again"
            ) from failure
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _plain_folder() -> Path:
    for parent in (None, "/tmp", "/var/tmp", "C:\\Users\\Public"):
        place = Path(parent or tempfile.gettempdir()).resolve()
        if place.is_dir() and _PLAIN.fullmatch(str(place)):
            return Path(tempfile.mkdtemp(prefix="tsm_fmu_", dir=place))
    raise InputError(
        f"temporary folder {tempfile.gettempdir()!r} -- expected a path of letters, digits, '_' and '-', from which "
        "FMUs can be loaded -- set TMPDIR to one"
    )
