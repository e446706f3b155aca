"""Logs, mappings and jobs of one run of the page, in a folder that goes when the page is closed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from ..kernels.kernel import Kernel
from ..logs.record import Record, read_record
from ..logs.table import read_table
from ..logs.whole_file import write_whole
from ..models import MODELS
from ..models.contract import InputError
from ..verbs.check import check, propose
from .job import Job, Maps, Request

_ON_THE_PAGE = "choose its name and write its unit in the table of columns"


@dataclass
class Session:
    """What the page works on; every number comes from the verbs."""

    folder: Path
    logs: dict[str, Path] = field(default_factory=dict)
    maps: dict[str, dict[str, str]] = field(default_factory=dict)
    jobs: list[Job] = field(default_factory=list)

    def add_log(self, name: str, data: bytes) -> dict[str, Any]:
        """Keep a dropped log and say what columns it has.

        Raises
        ------
        InputError
            It cannot be read, or one of that name is there.
        """
        plain = PureWindowsPath(PurePosixPath(name).name).name
        if plain in ("", ".", "..", "log.toml", *self.logs) or "\0" in plain:
            raise InputError(f"log {plain!r} -- expected a new name for each log -- rename the file")
        path = self.folder / "logs" / plain
        write_whole(path, data)
        try:
            columns = read_table(path).columns
        except InputError as wrong:
            path.unlink()
            raise _by_name(wrong, path) from None
        self.logs[plain], self.maps[plain] = path, {}
        return {"name": plain, "columns": [{"name": c.name, "unit": c.unit or ""} for c in columns]}

    def map_log(self, name: str, mapping: Maps) -> dict[str, Any]:
        """Take a mapping of columns and say what the log then holds and cannot show.

        Raises
        ------
        InputError
            An unknown log, or a mapping that does not give a record; the mapping before it stays.
        """
        record = self._record(name, mapping)
        checked = check(record)
        self.maps[name] = dict(mapping)
        units = {"time": "s", **record.units}
        return {"summary": checked.summary(), "channels": units, "notes": list(record.notes)}

    def picture(self, name: str) -> str:
        """A page with the channels of a log as it is mapped now, what is wrong shaded."""
        return check(self._record(name, self.maps[name])).figure().page()

    def proposal(self, name: str, model: str) -> dict[str, str]:
        """Column to ``name [unit]`` for a model, as far as the log lets guess."""
        guesses = propose(self._log(name), model).guesses
        return {g.column: f"{g.name} [{g.unit}]" if g.unit else g.name for g in guesses}

    def start(
        self, verb: str, model: str, runs: Sequence[str], holdout: Sequence[str], reference: Sequence[str] = ()
    ) -> Job:
        """Start a fit or a diagnosis; reference runs are for a diagnosis.

        Raises
        ------
        InputError
            Another verb, no run, or an unknown log.
        """
        if verb not in ("identify", "diagnose"):
            raise InputError(f"verb {verb!r} -- expected identify or diagnose -- choose one")
        if not runs:
            raise InputError("no log to fit -- expected at least one -- choose it in the list")
        number = len(self.jobs)
        fitted, judged, without = (
            [(self._log(name), self.maps[name]) for name in names] for names in (runs, holdout, reference)
        )
        job = Job(number, Request(verb, model, fitted, judged, without, self.folder / f"job-{number}"))
        job.start()
        self.jobs.append(job)
        return job

    def close(self) -> None:
        """End what still runs."""
        for job in self.jobs:
            job.end()

    def _record(self, name: str, mapping: Maps) -> Record:
        path = self._log(name)
        try:
            return read_record(path, mapping=mapping)
        except InputError as wrong:
            raise _by_name(wrong, path) from None

    def _log(self, name: str) -> Path:
        if name not in self.logs:
            raise InputError(f"log {name!r} -- expected one of {', '.join(self.logs) or '(none)'} -- drop it first")
        return self.logs[name]


def _by_name(wrong: InputError, path: Path) -> InputError:
    """The error with the name of the log as it was dropped, and what to do on the page instead of on a command line."""
    parts = str(wrong).replace(f"{path.parent}/", "").split(" -- ")
    parts[1:] = [_ON_THE_PAGE if "--map" in part else part for part in parts[1:]]
    return InputError(re.sub(r"^--map:? ", "", " -- ".join(parts)))


def models() -> list[dict[str, Any]]:
    """Models with the variables that a log may hold."""
    return [
        {
            "name": k.name,
            "presets": list(k.presets),
            "variables": [
                {"name": v.name, "unit": v.quantity.display or v.quantity.unit} for v in (*k.inputs, *k.outputs)
            ],
        }
        for k in map(Kernel, MODELS)
        if k.inputs and k.outputs
    ]
