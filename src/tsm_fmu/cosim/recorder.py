"""Which variables a run records, and the buffers they go to."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence

import numpy as np

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
        self, selection: Selection, instances: Mapping[str, FmuInstance], rows: int, notes: Sequence[str] = ()
    ) -> None:
        self._selection, self._instances = selection, instances
        self._notes = list(notes)
        self._time = np.empty(rows)
        self._row = 0
        self._tables = [
            (instance.name, block.names, np.frombuffer(block.values, dtype=np.dtype(block.values._type_)), table)
            for instance in instances.values()
            for block in instance.outputs
            if block.values._type_ is not ctypes.c_char_p
            for table in [np.empty((rows, len(block.names)), dtype=np.dtype(block.values._type_))]
        ]

    def store(self, time: float) -> None:
        """Copy the outputs as they are now into the next row."""
        row = self._row
        self._time[row] = time
        for _, _, values, table in self._tables:
            table[row] = values
        self._row = row + 1

    def note(self, text: str) -> None:
        """Add to what the run's messages begin with."""
        self._notes.append(text)

    def trajectory(self, incomplete: str = "") -> Trajectory:
        """Return the rows stored so far."""
        stored = {
            (component, name): table[: self._row, k]
            for component, names, _, table in self._tables
            for k, name in enumerate(names)
        }
        ports = {n: self._instances[c].description.ports[v] for n, (c, v) in self._selection.items()}
        columns = {
            name: stored[address].astype(bool) if ports[name].kind == "Boolean" else stored[address]
            for name, address in self._selection.items()
        }
        messages = (*self._notes, *(line for instance in self._instances.values() for line in instance.messages))
        units = {n: p.unit or "1" for n, p in ports.items()}
        return Trajectory(self._time[: self._row], columns, units, incomplete, messages)

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
        self._row = row
        raise SimulationStopped(message, self.trajectory(message))
