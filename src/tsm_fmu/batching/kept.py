"""Finished results on disk: what a batch that was killed goes on from."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..logs.whole_file import write_whole
from ..models.contract import InputError


class Kept:
    """The results of a batch, each on disk as soon as it is there, as plain data by the number of its item.

    Parameters
    ----------
    path : Path
        The file; removed by `finish`.
    identity : object
        All that the results depend on, as plain data: those of another batch do not count.

    Attributes
    ----------
    results : dict of int to mapping
        Found in the file, and added since.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """

    def __init__(self, path: Path, identity: object) -> None:
        self._path = path
        digest = hashlib.sha256(json.dumps(identity, default=str).encode()).hexdigest()
        self._first = json.dumps({"batch": digest})
        self.results: dict[int, Mapping[str, Any]] = {}
        self._known = self._read()
        self._begun = False
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as failure:
            raise InputError(
                f"{path.parent} -- expected a folder that can be written ({failure.strerror}) -- choose another place"
            ) from failure

    def add(self, number: int, result: Mapping[str, Any]) -> None:
        """Keep a result.

        Raises
        ------
        InputError
            The disk is full, or the folder is gone.
        """
        self.results[number] = result
        try:
            if not self._begun:  # not before: a batch that found no place to work leaves no file
                write_whole(self._path, "".join(f"{line}\n" for line in (self._first, *self._known)))
                self._begun = True
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps([number, result]) + "\n")
        except OSError as failure:
            raise InputError(
                f"{self._path} -- expected a file that can be written ({failure.strerror}) -- make room, and give the "
                f"command again: {len(self.results) - 1} results are kept"
            ) from failure

    def finish(self) -> None:
        """Remove the file: the table is written."""
        self._path.unlink(missing_ok=True)

    def _read(self) -> list[str]:
        """Whole lines of the same batch; they are the results."""
        try:
            first, *lines = self._path.read_text(encoding="utf-8").split("\n")
        except (OSError, UnicodeDecodeError):
            return []
        good = []
        for line in lines[:-1] if first == self._first else ():  # the last has no end if the process was killed
            try:
                number, result = json.loads(line)
                self.results[int(number)] = dict(result)
            except (ValueError, TypeError):
                break
            good.append(line)
        return good


def digest_of(path: Path) -> str:
    """SHA-256 of a file; empty where it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""
