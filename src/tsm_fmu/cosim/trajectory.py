"""What a co-simulation recorded, and its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..logs.record import write_record
from ..models.contract import InputError


@dataclass(frozen=True)
class Trajectory:
    """Recorded signals of one run.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Time [s].
    columns : mapping of str to ndarray, shape (n,)
        By ``component.variable`` (by variable for a single FMU), in the unit that the FMU declares.
    units : mapping of str to str
        Unit of each column; ``1`` where the FMU declares none.
    incomplete : str
        Why the run stopped early; empty if it did not.
    messages : tuple of str
        What the FMUs logged above the status OK, and what was derived for them.
    """

    time: NDArray[np.float64]
    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str]
    incomplete: str = ""
    messages: tuple[str, ...] = ()

    def only(self, record: Sequence[str] | None) -> Trajectory:
        """The columns that ``record`` names, by ``component.variable`` or ``component``; all for None."""
        if record is None:
            return self
        kept = [n for n in self.columns if {n, n.partition(".")[0], n.partition("[")[0]} & set(record)]
        return replace(self, columns={n: self.columns[n] for n in kept}, units={n: self.units[n] for n in kept})


class SimulationStopped(InputError):
    """A co-simulation that stopped early; `trajectory` has the rows until then."""

    def __init__(self, message: str, trajectory: Trajectory) -> None:
        super().__init__(message)
        self.trajectory = trajectory

    def __reduce__(self) -> Any:
        return SimulationStopped, (str(self), self.trajectory)

    def keep(self, path: Path) -> SimulationStopped:
        """Write the rows as `write_trajectory` does; the same error, saying where they are."""
        return SimulationStopped(f"{self}{_keep(path, self.trajectory)}", self.trajectory)


class SimulationInterrupted(KeyboardInterrupt):
    """Ctrl-C during a co-simulation; `trajectory` has the rows until then."""

    def __init__(self, trajectory: Trajectory, message: str = "interrupted") -> None:
        super().__init__(message)
        self.trajectory = trajectory

    def __reduce__(self) -> Any:
        return SimulationInterrupted, (self.trajectory, str(self))

    def keep(self, path: Path) -> SimulationInterrupted:
        """Write the rows as `write_trajectory` does; the same error, saying where they are."""
        return SimulationInterrupted(self.trajectory, f"{self}{_keep(path, self.trajectory)}")


def _keep(path: Path, trajectory: Trajectory) -> str:
    """Write what was computed, if more than the row of the start was; say where."""
    if trajectory.time.size < 2:
        return ""
    return f"; {trajectory.time.size} rows kept in {write_trajectory(path, trajectory)}"


def write_trajectory(path: Path, trajectory: Trajectory) -> Path:
    """Write CSV (also .gz) or Parquet with header cells ``name [unit]``; return the path written.

    An incomplete run is marked in the file name: ``results.csv`` becomes ``results.incomplete.csv``, which a
    complete one removes.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    stem, dot, rest = path.name.partition(".")
    marked = path.with_name(f"{stem}.incomplete{dot}{rest}")
    if trajectory.incomplete:
        return write_record(marked, trajectory.time, trajectory.columns, trajectory.units)
    written = write_record(path, trajectory.time, trajectory.columns, trajectory.units)
    marked.unlink(missing_ok=True)
    return written
