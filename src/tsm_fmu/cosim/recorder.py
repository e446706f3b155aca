"""Which variables a run records, and the buffers they go to."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..models.contract import InputError
from .fmu_instance import FmuInstance
from .system import Wiring
from .trajectory import SimulationStopped, Trajectory

Selection = Mapping[str, tuple[str, str]]
"""Column name to (component, variable)."""


def select(wiring: Wiring, wanted: Sequence[str] | None) -> dict[str, tuple[str, str]]:
    """Resolve what to record: ``component.variable``, ``component`` (all its outputs), or None for all outputs.

    Raises
    ------
    InputError
        Unknown name, or a text variable.
    """
    found: dict[str, tuple[str, str]] = {}
    for address in wiring.descriptions if wanted is None else wanted:
        component, dot, variable = address.partition(".")
        description = wiring.descriptions.get(component)
        elements = (variable,) if description is None else description.elements(variable)
        if description is None or (dot and elements[0] not in description.ports):
            known = wiring.descriptions if description is None else [f"{component}.{n}" for n in description.ports]
            raise InputError(f"record {address!r} -- expected one of {', '.join(known)} -- correct the name")
        ports = description.outputs
        ports = [description.ports[n] for n in elements] if dot else [p for p in ports if p.kind != "String"]
        for port in ports:
            if port.kind == "String":
                raise InputError(
                    f"record {address!r} is a text -- expected a Real, Integer or Boolean variable -- leave it out"
                )
            found[f"{component}.{port.name}"] = (component, port.name)
    return found


def left_out(wiring: Wiring, wanted: Sequence[str] | None) -> list[str]:
    """Say which outputs of the components that are recorded as a whole no table of numbers can hold."""
    whole = [a for a in (wiring.descriptions if wanted is None else wanted) if a in wiring.descriptions]
    return [
        f"{component}.{name} is not recorded: {kind}, and the table holds numbers"
        for component in whole
        for name, kind in wiring.descriptions[component].left_out.items()
    ]


@dataclass(frozen=True)
class _Column:
    """Where a column of the results is: in which table, and which column of it."""

    name: str
    unit: str
    boolean: bool
    table: int
    place: int


class Recorder:
    """Copies output buffers row by row.

    Parameters
    ----------
    selection : mapping
        From `select`.
    instances : mapping of str to FmuInstance
        With the selected variables among their outputs.
    rows : int
        Rows that a run has at most.
    notes : sequence of str
        What the run's messages begin with.
    """

    def __init__(
        self,
        selection: Selection,
        instances: Mapping[str, FmuInstance],
        rows: int,
        notes: Sequence[str] = (),
    ) -> None:
        self._instances = instances
        self._notes = list(notes)
        blocks = [
            (instance.name, block)
            for instance in instances.values()
            for block in instance.outputs
            if block.values._type_ is not ctypes.c_char_p
        ]

        self._time = np.zeros(rows)
        self._row = np.zeros(1, np.int64)
        self._buffers = [np.frombuffer(block.values, dtype=np.dtype(block.values._type_)) for _, block in blocks]
        self._tables = [np.zeros((rows, b.size), b.dtype) for b in self._buffers]
        places = {(owner, n): (k, j) for k, (owner, b) in enumerate(blocks) for j, n in enumerate(b.names)}
        self._columns = []
        for name, address in selection.items():
            port = instances[address[0]].description.ports[address[1]]
            self._columns.append(_Column(name, port.unit or "1", port.kind == "Boolean", *places[address]))

    def store(self, time: float) -> None:
        """Copy the outputs as they are now into the next row."""
        row = self._row[0]
        self._time[row] = time
        for values, table in zip(self._buffers, self._tables, strict=True):
            table[row] = values
        self._row[0] = row + 1

    def addresses(self) -> list[tuple[int, int, int]]:
        """For each table: the address of the buffer, that of the first row, and the size of a row [bytes]."""
        pairs = zip(self._buffers, self._tables, strict=True)
        return [(b.ctypes.data, t.ctypes.data, b.nbytes) for b, t in pairs if b.size]

    def places(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Times of the rows, and their number as an array of one."""
        return self._time, self._row

    def note(self, text: str) -> None:
        """Add to what the run's messages begin with."""
        self._notes.append(text)

    def trajectory(self, incomplete: str = "") -> Trajectory:
        """Return the rows stored so far."""
        messages = (*self._notes, *(line for instance in self._instances.values() for line in instance.messages))
        rows = int(self._row[0])
        values = {c.name: self._tables[c.table][:rows, c.place] for c in self._columns}
        shown = {c.name: values[c.name].astype(bool) if c.boolean else values[c.name] for c in self._columns}
        units = {c.name: c.unit for c in self._columns}
        return Trajectory(self._time[:rows], shown, units, incomplete, messages)

    def finished(self) -> Trajectory:
        """Return the complete run.

        Raises
        ------
        SimulationStopped
            If a recorded value is not finite; the rows before it are kept.
        """
        run = self.trajectory()
        bad = {n: int(np.argmin(np.isfinite(v))) for n, v in run.columns.items() if not np.isfinite(v).all()}
        if not bad:
            return run
        name, row = min(bad.items(), key=lambda item: item[1])
        message = (
            f"{name} is {run.columns[name][row]} from t = {run.time[row]:g} s on -- expected finite numbers -- check "
            "the parameters, or choose a smaller step"
        )
        self._row[0] = row
        raise SimulationStopped(message, self.trajectory(message))
