"""A communication step as tables for the compiled loop, and what happens where an FMU stops it."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..batching.stopping import StopRequest
from .exchange import Part, Transfer
from .fmi_calls import WARNING, Block
from .fmu_instance import FmuInstance
from .recorder import Recorder

Refusal = Callable[[int, float, float], None]
"""What a status above Warning means, given it, the time and the step: `FmuFailure`, or nothing if the run may go on."""

CHUNK_SECONDS = 0.05
"""How long the loop runs before Ctrl-C and the progress bar have their turn."""
_TYPES = {
    ctypes.c_double: "F64", ctypes.c_float: "F32", ctypes.c_int8: "I8", ctypes.c_int16: "I16", ctypes.c_int32: "I32",
    ctypes.c_int64: "I64", ctypes.c_uint8: "U8", ctypes.c_uint16: "U16", ctypes.c_uint32: "U32",
    ctypes.c_uint64: "I64", ctypes.c_bool: "BOOL",
}  # fmt: skip


@dataclass(frozen=True)
class Stimulus:
    """Values of a Real input at each step, in place of what is connected to it or added to that.

    Attributes
    ----------
    component, variable : str
        The input.
    values : ndarray of float64, shape (steps,)
        In the unit of the input.
    add : bool
    """

    component: str
    variable: str
    values: NDArray[np.float64]
    add: bool = False


Given = tuple[FmuInstance, Stimulus]


def can_compile(transfers: Mapping[str, Sequence[Transfer]]) -> bool:
    """Whether the loop can hand these on: no texts, values that become others, or 64 bits without sign as Real."""
    return all(
        _typed(t[0]) and _typed(t[2]) and t[6] is None and not _wide(t) for own in transfers.values() for t in own
    )


def _wide(transfer: Transfer) -> bool:
    return transfer[2]._type_ is ctypes.c_uint64 and transfer[0]._type_ in (ctypes.c_double, ctypes.c_float)


def _typed(buffer: Any) -> bool:
    return buffer._type_ in _TYPES


@dataclass
class _Tables:
    ops: list[tuple[int, ...]] = field(default_factory=list)
    refusals: list[Refusal | None] = field(default_factory=list)
    moves: list[tuple[int, ...]] = field(default_factory=list)
    scales: list[tuple[float, float]] = field(default_factory=list)

    def add(self, *op: int, refusal: Refusal | None = None) -> None:
        self.ops.append(op)
        self.refusals.append(refusal)


class Program:
    """The steps of a system, ready to run in machine code; equal to `exchange` to the last bit.

    Parameters
    ----------
    parts : sequence of Part
        Components in order, with what their inputs get.
    jacobi : bool
        All inputs first, then all steps, then all outputs.
    recorder : Recorder
        Gets the rows.
    clock : (float, float)
        Start time and communication step [s].
    given : sequence of (FmuInstance, Stimulus)
        Inputs that get values of their own at each step, after what is connected to them.
    """

    def __init__(
        self,
        parts: Sequence[Part],
        jacobi: bool,
        recorder: Recorder,
        clock: tuple[float, float],
        given: Sequence[Given] = (),
    ) -> None:
        from . import compiled_loop as loop

        self._code = loop
        tables = _Tables()

        def inputs(part: Part) -> None:
            self._inputs(tables, part, given)

        def step(part: Part) -> None:
            instance = part[0]
            kind = loop.STEP_3 if instance.do_step.fmi3 else loop.STEP_2
            tables.add(kind, *instance.do_step.addresses(), refusal=instance.after_step)

        def outputs(part: Part) -> None:
            instance = part[0]
            for block in instance.outputs:
                self._values(tables, block, partial(_after_get, instance, block))

        groups = [[part] for part in parts] if not jacobi else [list(parts)]
        for group in groups:
            for do in (inputs, step, outputs):
                for part in group:
                    do(part)
        wide = [(*op, *(0,) * (loop.OP_WIDTH - len(op))) for op in tables.ops]
        self._refusals = tables.refusals
        self._ops = np.array(wide, np.int64).reshape(-1, loop.OP_WIDTH)
        self._moves = np.array(tables.moves, np.int64).reshape(-1, 4)
        self._scales = np.array(tables.scales, float).reshape(-1, 2)
        self._clock = np.array(clock)
        self._recorder = recorder
        self._rows = np.array(recorder.addresses(), np.int64).reshape(-1, 3)
        self._kept_alive = (parts, given)
        self._loop = loop.compiled_loop(not any(instance.python for instance, _ in parts))
        self._chunk = 1

    def _inputs(self, tables: _Tables, part: Part, given: Sequence[Given]) -> None:
        instance, transfers = part
        first = len(tables.moves)
        for target, i, source, j, gain, offset, _ in transfers:
            tables.moves.append((*self._place(target, i), *self._place(source, j)))
            tables.scales.append((gain, offset))
        if transfers:
            tables.add(self._code.MOVE, first, len(tables.moves))
        for owner, stimulus in given:
            if owner is instance:
                what = self._code.ADD if stimulus.add else self._code.GIVE
                place = self._place(*instance.port(stimulus.variable, "inputs"))
                tables.add(what, *place, stimulus.values.ctypes.data)
        for block in instance.inputs:
            self._values(tables, block, partial(_after_set, instance, block))

    def _values(self, tables: _Tables, block: Block, refusal: Refusal) -> None:
        addresses = block.addresses() if block.counted else block.addresses()[:-1]
        tables.add(self._code.VALUES_3 if block.counted else self._code.VALUES_2, *addresses, refusal=refusal)

    def _place(self, buffer: Any, index: int) -> tuple[int, int]:
        size = ctypes.sizeof(buffer._type_)
        return ctypes.addressof(buffer) + index * size, getattr(self._code, _TYPES[buffer._type_])

    def run(self, begin: int, end: int, decimation: int, asked: StopRequest) -> int:
        """Take steps from number ``begin`` on, at most until before ``end``; return how many are done in all.

        It comes back after `CHUNK_SECONDS`, when the user wants to stop, and after a step in which an FMU asked to end
        the simulation; that step is not recorded.

        Raises
        ------
        FmuFailure
            If an FMU refuses a call.
        """
        at = np.array([begin, 0, min(end, begin + self._chunk)])
        since = perf_counter()
        ended = False
        while True:
            status = self._loop(
                self._ops, self._moves, self._scales, self._rows, self._clock, at, 0 if ended else decimation,
                *self._recorder.places(), asked.flag,
            )  # fmt: skip
            k, op = int(at[0]), int(at[1])
            if op == self._code.DONE:
                break
            refusal = self._refusals[op]
            assert refusal is not None
            step = float(self._clock[1])
            refusal(status, float(self._clock[0]) + k * step, step)
            at[1:] = op + 1, k + 1  # the rest of this step, and no other
            ended = True
        taken = perf_counter() - since
        longer = self._chunk * CHUNK_SECONDS / max(taken, 1e-6)
        self._chunk = max(1, min(int(longer), 10 * self._chunk))
        return k


def _after_set(instance: FmuInstance, block: Block, status: int, time: float, step: float) -> None:
    instance.after_set(block, status, time)


def _after_get(instance: FmuInstance, block: Block, status: int, time: float, step: float) -> None:
    instance.after_get(block, status, time + step)


assert WARNING == 1  # as the compiled loop has it
