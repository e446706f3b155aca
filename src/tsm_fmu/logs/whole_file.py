"""Files that appear whole or not at all: an end at any moment leaves the earlier file, never half of the new one."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterable
from pathlib import Path

from ..models.contract import InputError

_PART = ".part"


def write_whole(path: str | os.PathLike[str], content: str | bytes) -> Path:
    """Write a file beside its place and rename it; the folder is made.

    Parts of the same file that killed processes left are removed.

    Parameters
    ----------
    path : path-like
        The file; one that is there is replaced.
    content : str or bytes
        Text is written as UTF-8.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        The place cannot be written, or has no room.
    """
    target = Path(path)
    data = content.encode() if isinstance(content, str) else content
    part = target.with_name(f".{target.name}.{os.getpid()}{_PART}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_parts_of_ended_processes(target)
        part.write_bytes(data)
        part.replace(target)
    except OSError as failure:
        reason = "its folder is a file" if isinstance(failure, FileExistsError) else failure.strerror
        raise InputError(
            f"{target} could not be written ({reason}) -- expected a writable place with room for it -- choose another"
        ) from failure
    except ValueError as failure:  # a zero byte in the name
        raise InputError(f"{str(target)!r}: {failure} -- expected the name of a file -- choose another") from failure
    finally:
        with contextlib.suppress(OSError, ValueError):
            part.unlink()
    return target


def check_folder(folder: str | os.PathLike[str]) -> Path:
    """Refuse a folder for results that could only fail at the end; nothing is made.

    Raises
    ------
    InputError
        It is a file, or it or the folder that would hold it cannot be written.
    """
    place = Path(folder)
    if "\0" in os.fspath(folder):
        raise InputError(f"--out {str(place)!r} has a zero byte -- expected the name of a folder -- choose another")
    if place.exists() and not place.is_dir():
        raise InputError(f"--out {place} is a file -- expected a folder -- choose another")
    there = nearest_folder(place)
    if not (there.is_dir() and os.access(there, os.W_OK | os.X_OK)):
        raise InputError(f"--out {place}: {there} is no writable folder -- expected one -- choose another place")
    return place


def nearest_folder(place: Path) -> Path:
    """What exists of a path: itself, or what would hold it."""
    while not place.exists():
        place = place.parent
    return place


def remove_earlier(folder: str | os.PathLike[str], names: Iterable[str]) -> None:
    """Remove results of an earlier run before new ones are written: an end in between leaves no mix of the two.

    Raises
    ------
    InputError
        A file cannot be removed.
    """
    for path in (Path(folder) / name for name in names):
        try:
            path.unlink(missing_ok=True)
        except NotADirectoryError:  # nothing is there either
            continue
        except OSError as failure:
            raise InputError(
                f"{path} could not be replaced ({failure.strerror}) -- expected a folder that can be written "
                "-- choose another"
            ) from failure


def _remove_parts_of_ended_processes(target: Path) -> None:
    pattern = re.compile(rf"\.{re.escape(target.name)}\.(\d+){re.escape(_PART)}")
    for found in os.scandir(target.parent):
        match = pattern.fullmatch(found.name)
        if match and not _runs(int(match[1])):
            with contextlib.suppress(OSError):
                os.unlink(found.path)


def _runs(process: int) -> bool:
    if os.name == "nt":  # os.kill(process, 0) would end it there
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True
