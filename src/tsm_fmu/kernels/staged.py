"""A model with effects, simulated piece by piece over whole records by what is compiled of the model and each effect.

A chain is one step after another in each sample (chain_source.py). Where nothing that an effect changes comes back to
what was before it, each piece can as well run over the whole record: the same operations on the same numbers, so the
same bits, and no chain has to be compiled. What several simulations have in common is simulated once: in a Jacobian
only the pieces behind a changed parameter. An effect on the friction that reads the load which the model estimates from
that friction is not of this kind.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..effects import coordinates, coordinates_of_speed
from .arrays import FloatArray
from .attached import Attached
from .chain_source import Writer
from .kernel import Kernel, compiled_loops, plain_run, read_only
from .ports import READ, WRITE, port

Numbers = NDArray[np.int64]


@dataclass(frozen=True)
class Block:
    """Outputs of a piece: ``at[i]`` is the first row of the i-th simulation, shared by those that have it in common."""

    values: FloatArray
    at: list[int]


Signal = tuple[Block, int] | FloatArray
"""A column of a block, or a number for each simulation."""


class Staged:
    """A chain as pieces.

    Parameters
    ----------
    writer : Writer
        Of its text; it does not feed back.
    chained : Kernel
        The chain.
    """

    def __init__(self, writer: Writer, chained: Kernel) -> None:
        self.base, self.writer, self.module = writer.base, writer, chained.module
        self.rows = 0  # simulated so far
        self.inputs = {f"u.{v.name}": j for j, v in enumerate(chained.inputs)}
        self.columns = {f"p.{v.field}": j for j, v in enumerate(chained.parameters)}

    def can_simulate(self, table: FloatArray) -> bool:
        """Whether no model holds a load for a table of parameters: held, it comes back to the next sample."""
        return not (self.writer.can_hold and (table[:, self.columns["p.hold"]] == 1.0).any())

    def run(
        self, table: FloatArray, spans: Numbers, t: FloatArray, u: FloatArray, y: FloatArray, at: Numbers
    ) -> None:  # fmt: skip
        """As `kernel.compiled_run`; where a simulation stops, plain Python goes through it once more and says why."""
        alive = self.fill(table[at[0] :], spans[at[0] :], t, u, y)
        at[0] = len(table) - 1 if all(alive) else at[0] + alive.index(False)
        if not all(alive):
            plain_run(self.module)(table, spans, t, u, y, at)

    def fill(self, table: FloatArray, spans: Numbers, t: FloatArray, u: FloatArray, y: FloatArray) -> list[bool]:
        """Fill ``y`` likewise, with NaN for a simulation that stops; False for these."""
        self.rows += int(np.sum(spans[:, 1] - spans[:, 0]))
        simulations = _Simulations(spans, t, u)
        outputs = self._outputs(table, simulations)
        for i, (first, end, to) in enumerate(spans.tolist()):
            rows = y[to : to + end - first]
            if not simulations.alive[i]:
                rows[:] = np.nan
                continue
            for j, (block, column) in enumerate(outputs):
                rows[:, j] = block.values[block.at[i] : block.at[i] + len(rows), column]
        return simulations.alive

    def _outputs(self, table: FloatArray, run: _Simulations) -> list[tuple[Block, int]]:
        """In the order of one step: effects on inputs, the model, effects on its friction, effects on its outputs."""
        w, base = self.writer, self.base
        known: dict[str, Any] = {name: (run.given, j) for name, j in self.inputs.items()}
        known |= {name: table[:, j] for name, j in self.columns.items()}
        if w.moves:
            known |= _named("m", coordinates.Motion, self._motion(run, known))
        load = "0.0" if not w.load or w.load_is_output else f"u.{w.load}"
        driving = {name: known[f"u.{name}"] for name in w.inputs}
        for a in w.attached:
            if a in w.ways:
                speed = driving[a.channel]
                way = run.combined(_way, [speed, run.clock])
                left = self._effect(run, known, table, a, way, load)
                driving[a.channel] = run.combined(_speed_of, [speed, way, left, run.clock])
            elif a.channel in driving:
                driving[a.channel] = self._effect(run, known, table, a, driving[a.channel], load)
        own, given = table[:, : len(base.parameters)], list(driving.values())
        outputs = run.stage(base.module, own, given)
        if w.friction:
            outputs = self._with_friction(run, known, table, given, outputs, load)
        if w.load_is_output:
            load = f"o.{w.load}"
        known |= _named("o", base.module.Outputs, outputs)
        found = {name: (outputs, j) for j, name in enumerate(base.module.Outputs._fields)}
        for a in w.attached:
            if a.channel in found:
                before = found[a.channel]
                if not a.on_lost_motion:
                    found[a.channel] = self._effect(run, known, table, a, before, load)
                    continue
                lost = run.stage(port(base, a.channel), own, [*given, *_columns(outputs)]), 0
                lost = run.combined(lambda lo, o, y: lo + (o - y), [lost, known[f"o.{a.channel}"], before])
                after = self._effect(run, known, table, a, lost, load)
                found[a.channel] = run.combined(lambda x, y, lo: x - (y - lo), [before, after, lost])
        return list(found.values())

    def _motion(self, run: _Simulations, known: dict[str, Any]) -> Block:
        w = self.writer
        numbers: dict[str, Any] = {
            f: _value(run, known, w.motion_parameter(f)) for f in coordinates.MotionParams._fields
        }
        if w.position:
            parameters = np.column_stack([numbers[f] for f in coordinates.Params._fields])
            return run.stage(coordinates, parameters, [known[f"u.{w.position}"]])
        measured = "a" in w.inputs
        parameters = np.column_stack([numbers["x_pre"], numbers["tau_a"], np.full(len(run.alive), float(measured))])
        a = known["u.a"] if measured else np.zeros(len(run.alive))
        return run.stage(coordinates_of_speed, parameters, [known["u.v"], a])

    def _with_friction(
        self, run: _Simulations, known: dict[str, Any], table: FloatArray, given: list[Signal], outputs: Block,
        load: str,
    ) -> Block:  # fmt: skip
        own, seen = table[:, : len(self.base.parameters)], [*given, *_columns(outputs)]
        before = f = run.stage(port(self.base, READ), own, seen), 0
        for _, a in self.writer.friction:
            f = self._effect(run, known, table, a, f, load)
        after = run.stage(port(self.base, WRITE), own, [*seen, before, f])
        if self.writer.load_is_output:  # such a chain solves for the load, and stops where there is none
            for block in (outputs, after):
                run.stop_without(block, self.base.module.Outputs._fields.index(self.writer.load))
        return after

    def _effect(
        self, run: _Simulations, known: dict[str, Any], table: FloatArray, a: Attached, y: Signal, load: str
    ) -> tuple[Block, int]:
        texts = self.writer.signals(a, "y", load)
        parameters = table[:, [self.columns[f"p.{a.prefix}{name}"] for name in a.module.Params._fields]]
        signals = [y if text == "y" else _value(run, known, text) for text in texts]
        return run.stage(a.module, parameters, signals), a.module.Outputs._fields.index("y")


class _Simulations:
    """Simulations of one call, piece by piece; those that stop drop out of ``alive``."""

    def __init__(self, spans: Numbers, t: FloatArray, u: FloatArray) -> None:
        self.first, ends, _ = spans.T.tolist()
        self.lengths = [end - first for first, end in zip(self.first, ends, strict=True)]
        self.given, self.time = Block(read_only(u), self.first), read_only(t)
        self.clock = Block(self.time[:, None], self.first), 0
        self.alive = [True] * len(spans)

    def stage(self, module: ModuleType, parameters: FloatArray, signals: Sequence[Signal]) -> Block:
        """Outputs of a kernel whose inputs are signals."""
        sims, to, at = self._distinct(parameters, signals)
        columns, starts, arrays = np.ones((2, len(signals)), dtype=np.int64), [], []
        for j, signal in enumerate(signals):
            if isinstance(signal, np.ndarray):
                columns[:, j], values, begin = 0, read_only(signal[:, None]), range(len(signal))
            else:
                columns[0, j], values, begin = signal[1], signal[0].values, signal[0].at
            arrays.append(values)
            starts.append([begin[i] for i in sims])
        first = [self.first[i] for i in sims]
        ends = [a + self.lengths[i] for a, i in zip(first, sims, strict=True)]
        spans = np.array([first, ends, to[:-1], *starts], dtype=np.int64).T.copy()
        y, k, stopped = np.empty((to[-1], len(module.Outputs._fields))), np.zeros(1, dtype=np.int64), set()
        run, table = compiled_loops(module), np.ascontiguousarray(parameters[sims])
        while k[0] < len(sims):
            try:
                run(table, spans, self.time, tuple(arrays), columns, y, k)
                break
            except (ValueError, ArithmeticError):
                stopped.add(to[k[0]])
                k[0] += 1
        if stopped:
            self.alive = [alive and a not in stopped for alive, a in zip(self.alive, at, strict=True)]
        return Block(read_only(y), at)

    def stop_without(self, block: Block, column: int) -> None:
        """Stop what has numbers in a column that are not finite."""
        finite = np.isfinite(block.values[:, column])
        if not finite.all():
            ends = [a + length for a, length in zip(block.at, self.lengths, strict=True)]
            good = [finite[a:b].all() for a, b in zip(block.at, ends, strict=True)]
            self.alive = [bool(alive and ok) for alive, ok in zip(self.alive, good, strict=True)]

    def combined(self, work: Callable[..., FloatArray], signals: Sequence[tuple[Block, int]]) -> tuple[Block, int]:
        """A signal made sample by sample of others."""
        sims, to, at = self._distinct(np.empty((len(self.first), 0)), signals)
        y = np.empty((to[-1], 1))
        for a, i in zip(to, sims, strict=False):
            ends = [(block.at[i], block.at[i] + self.lengths[i]) for block, _ in signals]
            parts = [block.values[b:e, column] for (block, column), (b, e) in zip(signals, ends, strict=True)]
            y[a : a + self.lengths[i], 0] = work(*parts)
        return Block(read_only(y), at), 0

    def _distinct(
        self, parameters: FloatArray, signals: Sequence[Signal]
    ) -> tuple[list[int], list[int], list[int]]:  # fmt: skip
        """One of each kind of simulation, where the rows of each begin and all end, and where those of all begin."""
        constants = [s for s in signals if isinstance(s, np.ndarray)]
        numbers = np.column_stack([parameters, *constants]) if constants else np.ascontiguousarray(parameters)
        bits, width = numbers.tobytes(), numbers.shape[1] * numbers.itemsize  # -0.0 is not 0.0
        blocks = {id(s[0]): s[0].at for s in signals if not isinstance(s, np.ndarray)}
        places = zip(self.first, self.lengths, *blocks.values(), strict=True)
        kinds: dict[Any, int] = {}
        sims, to, at = [], [0], [-1] * len(self.first)
        for i, place in enumerate(places):
            if not self.alive[i]:
                continue
            kind = bits[i * width : (i + 1) * width], place
            if kind not in kinds:
                kinds[kind] = to[-1]
                sims.append(i)
                to.append(to[-1] + self.lengths[i])
            at[i] = kinds[kind]
        return sims, to, at


def _way(v: FloatArray, t: FloatArray) -> FloatArray:
    """Way of a speed, from the start."""
    return np.cumsum(np.concatenate([[0.0], v[1:] * np.diff(t)]))


def _speed_of(v: FloatArray, way: FloatArray, left: FloatArray, t: FloatArray) -> FloatArray:
    """Speed of what an effect leaves of the way of a speed."""
    found = v.copy()
    found[1:] -= np.diff(way - left) / np.diff(t)
    return found


def _columns(block: Block) -> list[Signal]:
    return [(block, j) for j in range(block.values.shape[1])]


def _named(prefix: str, fields: Any, block: Block) -> dict[str, Signal]:
    return {f"{prefix}.{name}": (block, j) for j, name in enumerate(fields._fields)}


def _value(run: _Simulations, known: dict[str, Any], text: str) -> Signal:
    """A signal by its text in the chain: a field, or a number."""
    return known[text] if text in known else np.full(len(run.alive), float(text))
