"""Finished points of a sweep on disk: what a killed one goes on from."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from .. import __version__
from ..models.contract import InputError
from .metric import Metric
from .ssp import Case
from .sweep import Axis, Point


class PointFile:
    """The finished points of a sweep, each on disk as soon as it is there; a killed sweep goes on from them.

    Parameters
    ----------
    path : Path
        The file; removed by `finish`.
    cases, axes, record
        As in `sweep`: points of another sweep do not count.

    Attributes
    ----------
    points : list of Point
        Found in the file, and added since.

    Raises
    ------
    InputError
        If the file cannot be written.
    """

    def __init__(
        self, path: Path, cases: Mapping[str, Case], axes: Sequence[Axis], record: Sequence[str] | None
    ) -> None:
        self._path = path
        self._identity = json.dumps({"sweep": _identity(cases, axes, record)})
        self.points = self._read()
        try:
            path.write_text("".join(f"{line}\n" for line in self._lines()), encoding="utf-8")
        except OSError as failure:
            raise InputError(
                f"{path} -- expected a file that can be written ({failure.strerror}) -- choose another place"
            ) from failure

    def add(self, point: Point) -> None:
        """Keep a point."""
        self.points.append(point)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(point)) + "\n")

    def finish(self) -> None:
        """Remove the file: the sweep is written."""
        self._path.unlink(missing_ok=True)

    def _lines(self) -> list[str]:
        return [self._identity, *(json.dumps(asdict(point)) for point in self.points)]

    def _read(self) -> list[Point]:
        try:
            first, *lines = self._path.read_text(encoding="utf-8").split("\n")
        except (OSError, UnicodeDecodeError):
            return []
        points: list[Point] = []
        for line in lines[:-1] if first == self._identity else ():  # the last has no end if the process was killed
            try:
                found = json.loads(line)
                points.append(Point(**{**found, "metrics": {k: Metric(**m) for k, m in found["metrics"].items()}}))
            except (ValueError, TypeError, KeyError, AttributeError):
                break
        return points


def _identity(cases: Mapping[str, Case], axes: Sequence[Axis], record: Sequence[str] | None) -> str:
    """Hash of all that the numbers of a sweep depend on."""
    fmus = {c.fmu for system, _ in cases.values() for c in system.components}
    content = {str(fmu.name): hashlib.sha256(fmu.read_bytes()).hexdigest() for fmu in sorted(fmus)}
    systems = [
        (
            name,
            [(c.name, c.fmu.name, sorted(c.parameters.items())) for c in system.components],
            [asdict(connection) for connection in system.connections],
            asdict(experiment),
        )
        for name, (system, experiment) in cases.items()
    ]
    whole = (__version__, content, systems, [asdict(axis) for axis in axes], record)
    return hashlib.sha256(json.dumps(whole, default=str).encode()).hexdigest()
