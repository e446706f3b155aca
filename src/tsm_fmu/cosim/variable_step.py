"""Communication steps chosen by their error, with rollback: step doubling.

Each step is taken once as a whole and once as two halves from the same state. The exchange is of first order, so that
the difference is the error of the halves, which stay. A step whose error is too large is rolled back and halved; one
whose error is small enough is followed by one of twice the length. Steps are the communication step divided by powers
of two, so that every communication point is met and a run has the rows of one with a fixed step.

A reversal of a motion within a step is followed down to the shortest step and located where a line through the mean
speeds of two half steps is zero: there friction changes its sign, and a long step would apply the wrong one for its
whole length.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..logs.units import same_quantity
from ..models.contract import InputError
from .exchange import Advance
from .fmu_instance import FmuFailure, FmuInstance
from .system import Wiring

Array = NDArray[np.float64]

FINEST = 10
"""The shortest step is the communication step over two to this power."""
LONGER = 0.2
"""From this share of the allowed error on, the next step is twice as long: its error is four times as large."""
AT_REST = 1e-9
"""A motion less than this share of its largest value has no direction."""
NAMED = 12
"""So many reversals are named one by one."""


def check_variable_step(wiring: Wiring, tolerance: float) -> None:
    """Refuse what cannot be rolled back.

    Raises
    ------
    InputError
        FMUs that cannot save their state or change their step, or a tolerance that is none.
    """
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"step error {tolerance!r} -- expected a number between 0 and 1 -- correct it")
    for what, able in (
        ("save its state", lambda d: d.model.coSimulation.canGetAndSetFMUstate),
        ("take steps of different length", lambda d: d.variable_step),
    ):
        if unable := [f"{name} ({d.path.name})" for name, d in wiring.descriptions.items() if not able(d)]:
            raise InputError(
                f"variable step: {', '.join(unable)} cannot {what} -- expected FMUs that can -- leave the step fixed"
            )


class VariableStep:
    """Advances a system over communication steps in parts that keep an error.

    Parameters
    ----------
    advance : callable
        One step of the whole system.
    instances : sequence of FmuInstance
        What it moves.
    wiring : Wiring
        Says which outputs are handed on; their errors count, or those of all outputs where none is.
    tolerance : float
        Largest error of a step, relative to the largest value of each signal so far.

    Attributes
    ----------
    accepted, rolled_back, limited : int
        Steps that stayed, steps that were undone, and steps of the shortest length that stayed with a larger error.
    shortest, longest : float
        Of the steps that stayed [s].
    reversals : list of (str, float)
        ``component.variable`` and time [s].
    """

    def __init__(self, advance: Advance, instances: Sequence[FmuInstance], wiring: Wiring, tolerance: float) -> None:
        self._advance, self._instances, self._tolerance = advance, instances, tolerance
        for instance in instances:
            instance.do_step.goes_back = True
        self._buffers = [
            (i, block, np.frombuffer(block.values, block.values._type_))
            for i in instances
            for block in i.outputs
            if block.real
        ]
        self._numbers = [b for i in instances for b in i.outputs if b.values._type_ is not ctypes.c_char_p]
        sources = {link.source for link in wiring.links}
        names = [(i.name, n) for i, block, _ in self._buffers for n in block.names]
        counted = np.array([n in sources for n in names], bool)
        self._counted = counted if counted.any() else np.ones(len(names), bool)
        units = [wiring.descriptions[owner].ports[n].unit for owner, n in names]
        self._motions = np.array([bool(u) and any(same_quantity(u, m) for m in ("rad", "m")) for u in units], bool)
        self._names = [".".join(n) for n in names]
        self._largest: Array = np.zeros(len(names))
        self._speeds: dict[str, tuple[float, float]] = {}
        self._level, self._grows = 0, False
        self.accepted = self.rolled_back = self.limited = 0
        self.shortest, self.longest = math.inf, 0.0
        self.reversals: list[tuple[str, float]] = []

    def __call__(self, time: float, step: float) -> None:
        """Advance from ``time`` by ``step`` [s]."""
        whole, done = 2**FINEST, 0
        while done < whole:
            part = whole >> self._level
            if not self._tried(time + step * done / whole, step * part / whole):
                self._level += 1
                continue
            done += part
            if any(i.ended_at is not None for i in self._instances):
                return
            if self._level and self._grows and done % (2 * part) == 0:
                self._level -= 1

    def _tried(self, time: float, step: float) -> bool:
        """Take a step twice; whether the halves may stay. They are undone if not."""
        last = self._level == FINEST
        begin = self._values()
        states, kept = [i.save_state() for i in self._instances], self._kept()
        try:
            try:
                self._advance(time, step)
                whole = self._values()
                self._back(states, kept)
                self._advance(time, 0.5 * step)
                middle = self._values()
                self._advance(time + 0.5 * step, 0.5 * step)
                end = self._values()
            except FmuFailure:
                if last or any(i.lost for i in self._instances):
                    raise
                self._back(states, kept)  # an FMU discarded the step: it may take a shorter one
                self.rolled_back += 1
                return False
            error = self._error(begin, whole, end)
            turned = self._turned(begin, middle, end)
            if not last and (error > 1.0 or turned.any()):
                self._back(states, kept)
                self.rolled_back += 1
                return False
        finally:
            for instance, state in zip(self._instances, states, strict=True):
                instance.free_state(state)
        self._accept(time, step, (begin, middle, end), error)
        return True

    def _accept(self, time: float, step: float, points: tuple[Array, Array, Array], error: float) -> None:
        begin, middle, end = points
        self.accepted += 1
        self.limited += error > 1.0
        self.shortest, self.longest = min(self.shortest, step), max(self.longest, step)
        self._grows = error < LONGER
        self._largest = np.maximum.reduce([self._largest, np.abs(begin), np.abs(middle), np.abs(end)])
        speeds = 2.0 * (middle - begin) / step, 2.0 * (end - middle) / step
        for at, speed in zip((time + 0.25 * step, time + 0.75 * step), speeds, strict=True):
            for k in np.flatnonzero(self._motions & (0.5 * step * np.abs(speed) > AT_REST * self._largest)):
                was_at, was = self._speeds.get(self._names[k], (at, 0.0))
                now = float(speed[k])
                if was * now < 0.0:
                    self.reversals.append((self._names[k], was_at + (at - was_at) * was / (was - now)))
                self._speeds[self._names[k]] = at, now

    def _error(self, begin: Array, whole: Array, end: Array) -> float:
        size = np.maximum.reduce([self._largest, np.abs(begin), np.abs(end)])
        error = np.abs(end - whole)
        relative = np.divide(error, self._tolerance * size, out=np.zeros_like(error), where=size != 0.0)
        found = float(np.max(relative[self._counted], initial=0.0))
        return found if math.isfinite(found) else math.inf

    def _turned(self, begin: Array, middle: Array, end: Array) -> NDArray[np.bool_]:
        """Motions that turn back within a step."""
        floor = AT_REST * self._largest
        first, second = middle - begin, end - middle
        return self._motions & (np.abs(first) > floor) & (np.abs(second) > floor) & (first * second < 0.0)

    def _values(self) -> Array:
        return np.concatenate([np.zeros(0), *(b for _, _, b in self._buffers)])

    def _kept(self) -> list[bytes]:
        return [bytes(block.values) for block in self._numbers]

    def _back(self, states: Sequence[Any], kept: Sequence[bytes]) -> None:
        for instance, state in zip(self._instances, states, strict=True):
            instance.restore_state(state)
            instance.ended_at = None
        for block, content in zip(self._numbers, kept, strict=True):
            memoryview(block.values).cast("B")[:] = content

    def notes(self) -> list[str]:
        """What a user should know of the steps that were taken."""
        if not self.accepted:
            return []
        limit = f"; {self.limited} of the shortest keep a larger error" if self.limited else ""
        found = [
            f"variable step: {self.accepted} steps of {self.shortest:.3g} to {self.longest:.3g} s, {self.rolled_back} "
            f"rolled back{limit}"
        ]
        named = ", ".join(f"{name} at {at:.6g} s" for name, at in self.reversals[:NAMED])
        if self.reversals:
            more = f" and {len(self.reversals) - NAMED} more" if len(self.reversals) > NAMED else ""
            found.append(f"reversals: {named}{more}")
        return found
