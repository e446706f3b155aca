"""What an effect would change in the channels of a fitted model: its response, and what of it nothing else imitates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...effects import shapes_of, sizes_of, starts_of
from ...kernels.arrays import FloatArray
from ...kernels.attached import Attached
from ...kernels.chain import ModelPart, model_part
from ...kernels.kernel import Kernel, kernel
from ...kernels.serving import filling
from ...models.contract import flat
from ...regression.sensitivity import output_jacobian
from ..criteria import SHAPE_RANGE_RATIO
from ..runs.motion_signals import Coordinates, coordinates_of, load_channel
from .extent import Extent
from .refit import Fitted

SIMULATED_ROWS = 500_000
"""Samples of responses that are simulated at once."""
COMPARED_ROWS = 3000
"""Samples of all runs together, drawn at random, at which responses are compared; those with a memory run over all."""
PROPORTIONAL = 1e-9
"""A response off by no more, over its largest value, grows with its size."""


def places_of(fitted: Fitted) -> list[Coordinates]:
    """Coordinates of each run of a fit, the load measured or as the model estimates it."""
    model, problem = fitted.problem.kernel, fitted.problem
    load = load_channel(model)
    inputs, outputs = [v.name for v in model.inputs], [v.name for v in model.outputs]
    found = []
    for k, run in enumerate(problem.runs):
        signal = None
        if load in inputs:
            signal = run.inputs[:, inputs.index(load)]
        elif load in outputs:
            signal = problem.every_output(k, fitted.table[k])[:, outputs.index(load)]
        found.append(coordinates_of(model, run, signal, fitted.values.get("motion.x_pre")))
    return found


class Responses:
    """Responses of effects on a fitted model.

    Parameters
    ----------
    fitted : Fitted
    weights : ndarray, shape (channels,)
        Factor of each channel in the columns.
    shaped_by : sequence of Coordinates, optional
        Motion from whose extent the shapes are drawn; that of the runs by default.
    """

    def __init__(self, fitted: Fitted, weights: FloatArray, shaped_by: Sequence[Coordinates] | None = None) -> None:
        self.fitted, self.weights = fitted, weights
        self.problem = fitted.problem
        self.kernel = self.problem.kernel
        self.base = kernel(self.kernel.name)
        self.signals = places_of(fitted)
        self.extent = Extent(shaped_by or self.signals)
        self.full = [self.problem.every_output(k, row) for k, row in enumerate(fitted.table)]
        sizes = [one.shape[0] for one in self.full]
        self.rows = _drawn(sizes, COMPARED_ROWS)
        self.basis = _basis(_of_samples(moves_left_open(fitted, weights), sizes, self.rows))

    def at_fewer(self, most: int) -> Responses:
        """The same, compared at no more than so many of their samples."""
        sizes = [rows.size for rows in self.rows]
        kept, few = _drawn(sizes, most), copy(self)
        few.rows = [rows[one] for rows, one in zip(self.rows, kept, strict=True)]
        few.basis = _basis(_of_samples(self.basis, sizes, kept))
        return few

    def flat(self, per_run: Sequence[FloatArray]) -> FloatArray:
        """Runs one after the other, channels weighted, as one column: the samples at which responses are compared."""
        return np.concatenate([(r[rows] * self.weights).ravel() for r, rows in zip(per_run, self.rows, strict=True)])

    @property
    def edges(self) -> NDArray[np.intp]:
        """Where each run begins in a column, and the end."""
        return np.cumsum([0, *(rows.size * len(self.weights) for rows in self.rows)])

    def outside(self, columns: FloatArray) -> FloatArray:
        """What of columns, along the last axis, the free parameters of the fit cannot imitate."""
        imitated = (columns @ self.basis) @ self.basis.T
        return np.subtract(columns, imitated, out=imitated)

    def tries(self, acting: Acting) -> list[dict[str, float]]:
        """Sizes of an effect on the motion that a search begins from too, by public name."""
        if not acting.on_input:
            return []
        stroke = max(float(np.ptp(one.x)) for one in self.signals)
        sizes = sizes_of(acting.attached.module).items()
        return [{public(acting.attached, name): part * stroke} for name, size in sizes for part in size.tries]

    def limits(self, acting: Acting) -> dict[str, tuple[float, float]]:
        """Range of an effect's parameters by public name: beyond it the effect has another one's signature."""
        module = acting.attached.module
        ranges = {name: self.extent.limits(shape) for name, shape in shapes_of(module).items()}
        signal = float(np.sqrt(np.mean(np.concatenate(acting.before) ** 2)))
        sizes = {name: size.most_of_signal * signal for name, size in sizes_of(module).items() if size.most_of_signal}
        ranges |= {name: (-most, most) for name, most in sizes.items()}
        # a run that differs from the others by far more than it changes itself says nothing of what changes it
        states = {name: self.extent.states(start) for name, start in starts_of(module).items()}
        ranges |= {name: (min(tried), SHAPE_RANGE_RATIO * max(tried)) for name, tried in states.items()}
        return {public(acting.attached, name): ends for name, ends in ranges.items() if ends is not None}

    def acting(self, attached: Attached) -> Acting:
        """An effect at its place, to be given shapes and sizes."""
        return Acting(self, attached)


class Acting:
    """An effect that acts on the signals of a fitted model, in all runs at once.

    Parameters
    ----------
    responses : Responses
    attached : Attached
    """

    def __init__(self, responses: Responses, attached: Attached) -> None:
        self.responses, self.attached, self.effect = responses, attached, Kernel(attached.module)
        fitted, problem, names = responses.fitted, responses.problem, [v.name for v in responses.kernel.outputs]
        self.on_input = attached.channel in [v.name for v in responses.kernel.inputs]
        self.channel = names.index(attached.channel) if attached.channel and not self.on_input else None
        self.port = None if attached.channel else responses.base.roles.friction
        parts = [
            model_part(responses.kernel, problem.params(row), run.inputs, full)
            for row, run, full in zip(fitted.table, problem.runs, responses.full, strict=True)
        ]
        before = (
            [c.x for c in responses.signals]
            if self.on_input
            else [self._before(part, full) for part, full in zip(parts, responses.full, strict=True)]
        )
        self.before = [one[rows] for one, rows in zip(before, responses.rows, strict=True)]
        self.full = [one[rows] for one, rows in zip(responses.full, responses.rows, strict=True)]
        self.parts = [
            model_part(responses.kernel, problem.params(row), run.inputs[rows], full)
            for row, run, full, rows in zip(fitted.table, problem.runs, self.full, responses.rows, strict=True)
        ]
        inputs = [
            np.column_stack([before[k] if v.name == "y" else self._signal(k, v.name) for v in self.effect.inputs])
            for k in range(len(problem.runs))
        ]
        time = [run.time for run in problem.runs]
        self.compared: list[NDArray[np.intp] | slice] = [*responses.rows]
        if not attached.module.State._fields:  # without memory: what is not compared need not be simulated
            inputs, time = ([a[rows] for a, rows in zip(one, responses.rows, strict=True)] for one in (inputs, time))
            self.compared = [slice(None)] * len(responses.rows)
        self.inputs, self.time = np.concatenate(inputs), np.concatenate(time)
        self.edges = np.cumsum([0, *(one.size for one in time)])
        self.defined = bool(np.isfinite(self.inputs).all())
        holds = self.port and responses.base.roles.held_load and fitted.values["hold"] == 1.0
        self.whole = _WholeChain(responses, attached) if (holds or self.on_input) and self.defined else None
        self.size = float(np.sqrt(np.sum(responses.flat(fitted.residuals) ** 2)))
        self._linear: dict[str, bool] = {}
        """By size parameter, whether the response grows with it: what holds for one shape holds for all."""

    def columns(
        self, shapes: Sequence[Mapping[str, float]], steps: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Response to each size parameter alone, and the step it was taken with.

        Parameters
        ----------
        shapes : sequence of mapping of str to float
            Values of the shape parameters.
        steps : ndarray, shape (shapes, sizes), optional
            Steps of the size parameters; chosen so that the response is of the residual's size by default.

        Returns
        -------
        columns : ndarray, shape (shapes, sizes, n)
            As `Responses.flat`; zero where the effect gives no numbers.
        steps : ndarray, shape (shapes, sizes)
        """
        columns, taken = [], []
        for number, (name, role) in enumerate(sizes_of(self.attached.module).items()):
            if steps is not None:
                step = steps[:, number]
                column = self.responses_to([{**one, name: h} for one, h in zip(shapes, step.tolist(), strict=True)])
            else:
                first = self.responses_to([{**one, name: role.first} for one in shapes])
                step = self._of_residual_size(name, role.first, np.sqrt(np.einsum("ij,ij->i", first, first)))
                column = self._grown(shapes, name, first, role.first, step)
            column[~np.isfinite(column).all(axis=1)] = 0.0
            columns.append(column)
            taken.append(step)
        return side_by_side(columns), np.stack(taken, axis=1)

    def _of_residual_size(self, name: str, first: float, responses: FloatArray) -> FloatArray:
        """Steps of a size parameter at which its responses, of these sizes now, are about as large as the residual."""
        shown = np.isfinite(responses) & (responses > 0.0)
        steps = abs(first) * self.size / np.where(shown, responses, 1.0)
        return np.where(shown, np.copysign(np.clip(steps, 1e-9, _largest(self.effect, name)), first), first)

    def _grown(
        self, shapes: Sequence[Mapping[str, float]], name: str, first: FloatArray, at: float, steps: FloatArray
    ) -> FloatArray:
        """Responses to steps of a size parameter, from those to its first one where they grow with it."""
        grown = first * (steps / at)[:, None]
        for one, step, column in zip(shapes, steps.tolist(), grown, strict=True):
            if name in self._linear:
                break
            stepped = self.responses_to([{**one, name: step}])[0]
            most = float(np.abs(stepped).max())
            if math.isfinite(most) and most > 0.0:
                self._linear[name] = bool((np.abs(stepped - column) <= PROPORTIONAL * most).all())
        if self._linear.get(name):
            return grown
        return self.responses_to([{**one, name: step} for one, step in zip(shapes, steps.tolist(), strict=True)])

    def responses_to(self, values: Sequence[Mapping[str, float]]) -> FloatArray:
        """Change of all channels by the effect, weighted, at several sets of its values, shape (sets, n)."""
        table, used = self.effect.allowed(values)  # to values that the effect refuses: no response
        found = np.zeros((len(values), sum(rows.size for rows in self.responses.rows) * len(self.responses.weights)))
        if self.whole:
            for i, row in zip(used, table, strict=True):
                found[i] = self.whole.change(row)
            return found
        at_once = max(1, SIMULATED_ROWS // self.time.size)
        if len(values) == len(used) <= at_once:
            return self._changes(self._after(table))
        for first in range(0, len(used), at_once):
            found[used[first : first + at_once]] = self._changes(self._after(table[first : first + at_once]))
        return found

    def _after(self, table: FloatArray) -> FloatArray:
        """What the effect makes at each row of a table of its parameters, shape (rows of the table, samples)."""
        runs, total = len(self.edges) - 1, self.time.size
        y = np.full((len(table) * total, len(self.effect.outputs)), np.nan)
        if self.defined:
            one = np.column_stack([self.edges[:-1], self.edges[1:], self.edges[:-1]])
            spans = np.tile(one, (len(table), 1))
            spans[:, 2] += np.repeat(np.arange(len(table)) * total, runs)
            every = np.repeat(table, runs, axis=0)
            filling(self.effect, every)(every, spans, self.time, self.inputs, y)
        return y[:, 0].reshape(len(table), total)

    def _changes(self, after: FloatArray) -> FloatArray:
        """Change of all channels where they are compared, weighted, shape (rows of the table, n)."""
        columns, weights = self.responses.problem.columns, self.responses.weights.tolist()
        found = np.empty((len(after), sum(rows.size for rows in self.responses.rows), len(columns)))
        first = 0
        for k, (a, b) in enumerate(pairwise(self.edges)):
            now = after[:, a:b][:, self.compared[k]]
            last = first + now.shape[1]
            for c, (j, weight) in enumerate(zip(columns, weights, strict=True)):
                np.multiply(weight, self._change(k, j, now), out=found[:, first:last, c])
            first = last
        return found.reshape(len(after), -1)

    def _before(self, part: ModelPart, full: FloatArray) -> FloatArray:
        """What the effect changes, before it."""
        if self.port:
            return self.port.read(part.parameters, part.inputs, part.outputs)
        if self.attached.on_lost_motion:
            return self.responses.base.roles.lost_motion[self.attached.channel](
                part.parameters, part.inputs, part.outputs
            )
        return full[:, self.channel]

    def _change(self, k: int, output: int, after: FloatArray) -> FloatArray | float:
        """Change of an output of a run, where it is compared, by what the effect makes there."""
        if self.port:
            part = self.parts[k]
            written = self.port.write(part.parameters, part.inputs, part.outputs, after)
            return written[output] - self.full[k][:, output]
        if output != self.channel:
            return 0.0
        return (self.before[k] - after) * (1.0 if self.attached.on_lost_motion else -1.0)

    def _signal(self, k: int, name: str) -> FloatArray:
        run, base = self.responses.problem.runs[k], self.responses.base
        inputs = [v.name for v in self.responses.kernel.inputs]
        column = self.attached.drive(name)
        if column is not None:
            return run.inputs[:, inputs.index(column.column)]
        if name not in self.attached.takes or (name in self.attached.module.ABOUT.at_outputs and not base.roles.load):
            return np.zeros(run.time.size)
        if name == "load" and not base.roles.load:
            return np.ones(run.time.size)  # as an effect takes one that it may be without
        if name == "drive":
            drive = base.roles.drive
            if drive in inputs:
                return run.inputs[:, inputs.index(drive)]
            outputs = [v.name for v in self.responses.kernel.outputs]
            return self.responses.full[k][:, outputs.index(drive)] if drive else np.zeros(run.time.size)
        value = getattr(self.responses.signals[k], name)
        return np.zeros(run.time.size) if value is None else value


class _WholeChain:
    """An effect of which only the chain as a whole says what it does: one on an input of the model, or on the friction
    of a model that holds its load, where what is held comes back to the next sample.

    Parameters
    ----------
    responses : Responses
    attached : Attached
    """

    def __init__(self, responses: Responses, attached: Attached) -> None:
        self.responses, fitted = responses, responses.fitted
        self.kernel = fitted.task.kernel((*fitted.effects, attached.spec))
        names = [v.name for v in self.kernel.parameters]
        known = {n: v for n, v in {**fitted.task.values, **fitted.values}.items() if n in names}
        self.table = np.tile(flat(self.kernel.params(None, known)), (len(responses.problem.runs), 1))
        for name, values in fitted.per_run.items():
            self.table[:, names.index(name)] = values
        self.columns = [names.index(public(attached, v.name)) for v in Kernel(attached.module).parameters]
        runs = [run.with_lead for run in responses.problem.runs]
        self.time, self.inputs = (np.concatenate(one) for one in zip(*runs, strict=True))
        ends = np.cumsum([time.size for time, _ in runs])
        first = ends - [time.size for time, _ in runs]
        self.spans = np.column_stack([first, ends, first])
        self.compared = [
            end - run.time.size + rows
            for end, run, rows in zip(ends, responses.problem.runs, responses.rows, strict=True)
        ]
        self.before = self._channels(self.table)

    def change(self, values: Sequence[float]) -> FloatArray:
        """Change of all channels where they are compared, by values of the effect, weighted."""
        table = self.table.copy()
        table[:, self.columns] = values
        return self._channels(table) - self.before

    def _channels(self, table: FloatArray) -> FloatArray:
        y = np.empty((self.time.size, len(self.kernel.outputs)))
        filling(self.kernel, table)(table, self.spans, self.time, self.inputs, y)
        found = y[np.concatenate(self.compared)][:, self.responses.problem.columns]
        return (found * self.responses.weights).ravel()


def _drawn(sizes: Sequence[int], most: int) -> list[NDArray[np.intp]]:
    """Numbers of the samples of each run at which responses are compared, so many of all runs together.

    Not every n-th: that may meet each stroke at the same place.
    """
    share = min(1.0, most / sum(sizes))
    rng = np.random.default_rng(7)
    return [np.sort(rng.choice(size, math.ceil(share * size), replace=False)) for size in sizes]


def _of_samples(columns: FloatArray, sizes: Sequence[int], rows: Sequence[NDArray[np.intp]]) -> FloatArray:
    """What belongs to some samples of each run, of columns by sample of all runs, of these sizes, and channel."""
    at = np.concatenate([first + one for first, one in zip(np.cumsum([0, *sizes]), rows, strict=False)])
    channels, width = len(columns) // sum(sizes), columns.shape[1]  # no column where all parameters are fixed
    return columns.reshape(sum(sizes), channels, width)[at].reshape(at.size * channels, width)


def moves_left_open(fitted: Fitted, weights: FloatArray) -> FloatArray:
    """What the free parameters of a fit can do, shape (samples of all runs and channels, columns), channels weighted.

    With a prior only what its own runs tell more of than those behind the prior: those hold the rest.
    """
    problem, known = fitted.problem, fitted.problem.known
    columns = output_jacobian(problem, fitted.table, weights)
    if known is None:
        return columns
    values = fitted.table[0, [problem.fields.index(f) for f in known.fields]]
    rows = np.zeros((len(known.fields), columns.shape[1]))
    held = known.rows(weights) / known.unit(values)
    for k, field in enumerate(known.fields):
        if field in problem.shared:
            rows[:, problem.shared.index(field)] = held[:, k]
    both = _basis(np.vstack([columns, rows]))[: len(columns)]
    u, share, _ = np.linalg.svd(both, full_matrices=False)
    return u[:, share**2 > 0.5]


def _basis(columns: FloatArray) -> FloatArray:
    """Orthonormal columns that span the same."""
    u, singular, _ = np.linalg.svd(normalised(columns), full_matrices=False)
    return u[:, singular > 1e-9 * singular[0]] if singular.size else u


def normalised(columns: FloatArray) -> FloatArray:
    """Columns of length one; those that are zero are left out."""
    norms = np.linalg.norm(columns, axis=0)
    return columns[:, norms > 0.0] / norms[norms > 0.0]


def side_by_side(arrays: Sequence[FloatArray]) -> FloatArray:
    """Arrays along a new second axis; a single one, the usual case and large, is not copied."""
    return np.stack(arrays, axis=1) if len(arrays) > 1 else arrays[0].reshape(len(arrays[0]), 1, *arrays[0].shape[1:])


def public(attached: Attached, name: str) -> str:
    """Public name, in a chain, of an effect's parameter."""
    return attached.prefix.replace("__", ".") + name


def _largest(effect: Kernel, name: str) -> float:
    quantity = effect.by_name[name].quantity
    bound = quantity.hi if quantity.hi > 0.0 else -quantity.lo
    return 0.5 * bound if math.isfinite(bound) else 1e9
