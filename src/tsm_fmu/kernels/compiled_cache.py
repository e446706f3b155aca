"""Compiled kernels kept on disk, so that a second run of a command compiles nothing.

numba keeps a compiled function by the date of its own file, and would not see that a function it calls has changed.
So the folder's name holds a hash of the text of all kernels: whatever changes there starts an empty folder. Kernels
from elsewhere, which the hash does not hold, and all kernels where there is no folder to write to, are compiled anew
in each process.
"""

from __future__ import annotations

import hashlib
import importlib
import linecache
import os
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from types import ModuleType

PACKAGES = ("models", "effects")
"""Where kernels and what they call are written."""
OWN = tuple(f"{(__package__ or '').rpartition('.')[0]}.{package}." for package in PACKAGES)
VARIABLE = "TSM_FMU_CACHE"
"""Environment variable with another folder for what is kept; empty for none."""
SETTING = "CACHE_DIR"
"""numba's, read when a function is decorated."""
_SETTING_LOCK = threading.RLock()
_IMPORT_LOCK = threading.RLock()
"""Threads that tell importlib to look again take places from its list that one of them has taken already."""
KEPT_DAYS = 30.0
"""Compiled forms of kernels as they no longer are go after this time without use."""


@cache
def folder() -> Path | None:
    """Folder for the compiled form of the kernels as they are now; None where nothing can be written."""
    root = cache_root()
    if root is None:
        return None
    found = root / kernels_state(Path(__file__).parents[1])
    try:
        if not found.is_dir():
            found.mkdir(parents=True)
            _forget_old(found.parent)
        found.touch()
    except OSError:
        return None
    return found if os.access(found, os.W_OK) else None


def cache_root() -> Path | None:
    """Folder of all that is kept for later processes; None where nothing is to be. It need not exist."""
    chosen = os.environ.get(VARIABLE)
    if chosen == "":
        return None
    return Path(chosen) if chosen else _usual() / "tsm-fmu"


def written(name: str, text: str) -> str:
    """Name for ``compile``: a file with the generated text, which numba needs to keep its compiled form; else a label.

    Parameters
    ----------
    name : str
        The file's name.
    text : str
    """
    place = folder()
    if place is None:
        return f"<{name}>"
    path = place / f"{name}.py"
    try:
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            with NamedTemporaryFile("w", dir=place, suffix=".tmp", delete=False, encoding="utf-8") as file:
                file.write(text)
            os.replace(file.name, path)  # at once: another process may do the same
    except OSError:
        return f"<{name}>"
    return str(path)


def module(package: ModuleType, name: str, text: str) -> ModuleType:
    """A generated module of a package, imported from its file here; without a file where there is no folder.

    What is kept of compiled functions names the modules of their types: they must be importable in another process.
    """
    place, file = folder(), written(name, text)
    if place is None or file == f"<{name}>":
        return _without_file(package, name, text)
    with _IMPORT_LOCK:
        if str(place) not in package.__path__:
            package.__path__.append(str(place))
        importlib.invalidate_caches()
        return importlib.import_module(f"{package.__name__}.{name}")


def named(kind: str, text: str) -> str:
    """Name of a generated module by its text: numba would not see that the text behind a name has changed."""
    return f"{kind}_{hashlib.sha256(text.encode()).hexdigest()[:12]}"


def _without_file(package: ModuleType, name: str, text: str) -> ModuleType:
    found = ModuleType(f"{package.__name__}.{name}")
    found.__package__ = package.__name__
    found.__file__ = f"<{name}>"
    linecache.cache[found.__file__] = (len(text), None, text.splitlines(keepends=True), found.__file__)
    # with this file's own annotations as texts, those of a driven chain would be looked up in no module
    code = compile(text, found.__file__, "exec", dont_inherit=True)
    exec(code, found.__dict__)  # noqa: S102  our own text, names from the registry
    return found


def own(module: str) -> bool:
    """Whether functions of a module, by its full name, may be kept: of our kernels, and found by another process."""
    return module.startswith(OWN) and module in sys.modules


@contextmanager
def kept(module: str, own_file: bool = False) -> Iterator[bool]:
    """A module's functions decorated inside are kept in the folder; False if they cannot be.

    ``own_file``: they call nothing outside their file, whose date numba looks at; they need not be kernels.
    """
    from numba import config

    place = folder()
    if place is None or not (own_file or own(module)):
        yield False
        return
    with _SETTING_LOCK:  # threads compile beside each other, and the setting is everybody's
        before = getattr(config, SETTING)
        setattr(config, SETTING, str(place))
        try:
            yield True
        finally:
            setattr(config, SETTING, before)


def _usual() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def kernels_state(here: Path) -> str:
    """Hash of the text of every kernel of a package's folder and of what compiles it."""
    import numba

    digest = hashlib.sha256(f"{sys.version} numba {numba.__version__}".encode())
    for package in PACKAGES:
        for path in sorted((here / package).rglob("*.py")):
            digest.update(path.relative_to(here).as_posix().encode() + path.read_bytes())
    digest.update((here / "kernels" / "kernel.py").read_bytes())
    return digest.hexdigest()[:16]


def _forget_old(place: Path) -> None:
    """Remove the folders of kernels that nobody has used for long."""
    for other in place.iterdir():
        if other.is_dir() and time.time() - other.stat().st_mtime > KEPT_DAYS * 86400.0:
            shutil.rmtree(other, ignore_errors=True)
