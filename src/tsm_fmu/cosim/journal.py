"""What a simulation leaves behind if its process ends in the middle of a call: the rows, and which call it was."""

from __future__ import annotations

import json
import mmap
import pickle
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .trajectory import Trajectory

CALLS = ("instantiate", "initialisation", "set of inputs", "doStep", "get of outputs", "terminate")
INSTANTIATE, INITIALISE, SET, STEP, GET, CLOSE = range(len(CALLS))

_NOW = struct.Struct("=qqqd")  # number of calls so far, FMU, call, time [s]

Mark = Callable[[int, float], None]
"""Say that a call (one of `CALLS`) begins, at a time [s]."""


def no_mark(call: int, time: float) -> None:
    """The `Mark` of a simulation without journal."""


class Journal:
    """Rows and the call that is running, in files of a folder; they are right at every moment, also after a crash."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._fmus: list[str] = []
        with (folder / "now.bin").open("wb+") as file:
            file.write(bytes(_NOW.size))
            file.flush()
            self._file = mmap.mmap(file.fileno(), _NOW.size)
        self.now = np.frombuffer(self._file, np.int64)
        """Number of calls so far, FMU, call; the fourth is the time as float64."""
        self._time = self.now.view(float)

    def index(self, fmu: str) -> int:
        """Number of an FMU that has a `marker`."""
        return self._fmus.index(fmu)

    def marker(self, fmu: str) -> Mark:
        """The `Mark` of an FMU."""
        index = len(self._fmus)
        self._fmus.append(fmu)
        (self._folder / "fmus.json").write_text(json.dumps(self._fmus), encoding="utf-8")

        def mark(call: int, time: float) -> None:
            self._time[3] = time
            self.now[:3] = self.now[0] + 1, index, call

        return mark

    def array(self, name: str, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """An array of zeros that is a file."""
        if 0 in shape:
            return np.zeros(shape, dtype=dtype)
        return np.memmap(self._folder / f"{name}.bin", dtype=dtype, mode="w+", shape=shape)

    def describe(self, rebuild: Callable[..., Trajectory], *arguments: Any) -> None:
        """Keep what makes a trajectory of the arrays: ``rebuild(*arguments, arrays)`` by the names of the files."""
        (self._folder / "columns.pickle").write_bytes(pickle.dumps((rebuild, arguments)))

    @staticmethod
    def calls(folder: Path) -> int:
        """Calls that were begun so far."""
        return _now(folder)[0]


def _now(folder: Path) -> tuple[int, int, int, float]:
    try:
        return _NOW.unpack((folder / "now.bin").read_bytes())
    except (OSError, struct.error):  # it has not begun
        return 0, 0, 0, 0.0


def recovered(folder: Path) -> tuple[str, Trajectory]:
    """The call that was running, in words, and the rows of the journal in a folder."""
    count, fmu, call, time = _now(folder)
    if count == 0:
        return "the simulation", Trajectory(np.empty(0), {}, {})
    name = json.loads((folder / "fmus.json").read_text(encoding="utf-8"))[fmu]
    at = f" at t = {time:g} s" if INITIALISE <= call < CLOSE else ""
    where = f"FMU {name}: {CALLS[call]}{at}"
    if not (folder / "columns.pickle").is_file():
        return where, Trajectory(np.empty(0), {}, {})
    rebuild, arguments = pickle.loads((folder / "columns.pickle").read_bytes())
    return where, rebuild(*arguments, lambda name, dtype: np.fromfile(folder / f"{name}.bin", dtype=dtype))
