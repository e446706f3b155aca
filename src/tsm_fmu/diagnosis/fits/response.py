"""What an effect would change in the channels of a fitted model: its response, and what of it nothing else imitates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import ModuleType

import numpy as np
from scipy.stats import qmc

from ...effects import shapes_of, sizes_of
from ...effects.about import Scale, Shape
from ...kernels.arrays import FloatArray
from ...kernels.attached import Attached
from ...kernels.chain import ModelPart, model_part
from ...kernels.kernel import Kernel, kernel
from ...kernels.serving import filling
from ...models.contract import InputError, flat
from ...regression.sensitivity import output_jacobian
from ..criteria import SHAPE_RANGE_RATIO
from ..runs.motion_signals import Coordinates, coordinates_of, load_channel
from .refit import Fitted

SHAPES = 7
"""Shapes tried for each shape parameter of an effect."""
PROPORTIONAL = 1e-9
"""A response off by no more, over its largest value, grows with its size."""
EVENLY: tuple[Scale, ...] = ("position", "angle", "share")
"""Scales over which shapes are spread evenly, and not over the logarithm."""


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
        self.extent = _Extent(shaped_by or self.signals)
        self.full = [self.problem.every_output(k, row) for k, row in enumerate(fitted.table)]
        columns = normalised(output_jacobian(fitted.problem, fitted.table, weights))
        u, singular, _ = np.linalg.svd(columns, full_matrices=False)
        self.basis = u[:, singular > 1e-9 * singular[0]] if singular.size else u

    def flat(self, per_run: Sequence[FloatArray]) -> FloatArray:
        """Runs one after the other, channels weighted, as one column."""
        return np.concatenate([(r * self.weights).ravel() for r in per_run])

    def outside(self, columns: FloatArray) -> FloatArray:
        """What of columns the free parameters of the fit cannot imitate."""
        return columns - self.basis @ (self.basis.T @ columns)

    def shapes(self, module: ModuleType) -> list[dict[str, float]]:
        """Values of an effect's shape parameters: spread over what these runs could show."""
        shapes = shapes_of(module)
        if not shapes:
            return [{}]
        count = max(SHAPES * min(len(shapes), 3), *(shape.tries for shape in shapes.values()))
        draws = qmc.Halton(len(shapes), rng=7).random(count)
        return [
            {n: self.extent.at_quantile(shape, float(q)) for (n, shape), q in zip(shapes.items(), row, strict=True)}
            for row in draws
        ]  # fmt: skip

    def limits(self, acting: Acting) -> dict[str, tuple[float, float]]:
        """Range of an effect's parameters by public name: beyond it the effect has another one's signature."""
        module = acting.attached.module
        ranges = {name: self.extent.limits(shape) for name, shape in shapes_of(module).items()}
        signal = float(np.sqrt(np.mean(np.concatenate(acting.before) ** 2)))
        sizes = {name: size.most_of_signal * signal for name, size in sizes_of(module).items() if size.most_of_signal}
        ranges |= {name: (-most, most) for name, most in sizes.items()}
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
        self.channel = names.index(attached.channel) if attached.channel else None
        self.port = None if attached.channel else responses.base.roles.friction
        self.parts = [
            model_part(responses.kernel, problem.params(row), run.inputs, full)
            for row, run, full in zip(fitted.table, problem.runs, responses.full, strict=True)
        ]
        self.before = [self._before(part, full) for part, full in zip(self.parts, responses.full, strict=True)]
        self.time = np.concatenate([run.time for run in problem.runs])
        inputs = [
            np.column_stack([self.before[k] if v.name == "y" else self._signal(k, v.name) for v in self.effect.inputs])
            for k in range(len(problem.runs))
        ]
        self.inputs = np.concatenate(inputs)
        self.edges = np.cumsum([0, *(run.time.size for run in problem.runs)])
        self.size = float(np.sqrt(np.sum(responses.flat(fitted.residuals) ** 2)))
        self._linear: dict[str, bool] = {}
        """By size parameter, whether the response grows with it: what holds for one shape holds for all."""

    def columns(
        self, shape: Mapping[str, float], steps: Sequence[float] | None = None
    ) -> tuple[list[FloatArray], list[float]]:
        """Response to each size parameter alone, and the step it was taken with.

        Parameters
        ----------
        shape : mapping of str to float
            Values of the shape parameters.
        steps : sequence of float, optional
            Steps of the size parameters; chosen so that the response is of the residual's size by default.
        """
        columns, taken = [], []
        for number, (name, role) in enumerate(sizes_of(self.attached.module).items()):
            if steps is not None:
                step = steps[number]
                column = self.response({**shape, name: step})
            else:
                first = self.response({**shape, name: role.first})
                step = self._of_residual_size(name, role.first, float(np.linalg.norm(first)))
                column = self._grown(shape, name, first, role.first, step)
            columns.append(column if np.isfinite(column).all() else np.zeros_like(column))
            taken.append(step)
        return columns, taken

    def _of_residual_size(self, name: str, first: float, response: float) -> float:
        """Step of a size parameter at which its response is about as large as the residual."""
        if not (math.isfinite(response) and response > 0.0):
            return first
        return math.copysign(min(max(abs(first) * self.size / response, 1e-9), _largest(self.effect, name)), first)

    def _grown(self, shape: Mapping[str, float], name: str, first: FloatArray, at: float, step: float) -> FloatArray:
        """Response to a step of a size parameter, from that to its first one where it grows with it."""
        grown = first * (step / at)
        if self._linear.get(name):
            return grown
        column = self.response({**shape, name: step})
        most = float(np.abs(column).max())
        if math.isfinite(most) and most > 0.0:
            self._linear.setdefault(name, bool((np.abs(column - grown) <= PROPORTIONAL * most).all()))
        return column

    def response(self, values: Mapping[str, float]) -> FloatArray:
        """Change of all channels by the effect, as one weighted column."""
        problem, weights = self.responses.problem, self.responses.weights
        try:
            p = self.effect.params(None, values)
        except InputError:
            return np.zeros(len(self.time) * len(weights))
        y = np.full((len(self.time), len(self.effect.outputs)), np.nan)
        if np.isfinite(self.inputs).all():
            table = np.tile(np.array(flat(p), dtype=float), (len(problem.runs), 1))
            spans = np.column_stack([self.edges[:-1], self.edges[1:], self.edges[:-1]])
            filling(self.effect, table)(table, spans, self.time, self.inputs, y)
        after = [y[a:b, 0] for a, b in pairwise(self.edges)]
        return self.responses.flat([self._change(k, one)[:, problem.columns] for k, one in enumerate(after)])

    def _before(self, part: ModelPart, full: FloatArray) -> FloatArray:
        """What the effect changes, before it."""
        if self.port:
            return self.port.read(part.parameters, part.inputs, part.outputs)
        if self.attached.on_lost_motion:
            return self.responses.base.roles.lost_motion[self.attached.channel](
                part.parameters, part.inputs, part.outputs
            )
        return full[:, self.channel]

    def _change(self, k: int, after: FloatArray) -> FloatArray:
        """Change of all outputs of a run by the effect."""
        part, full = self.parts[k], self.responses.full[k]
        change = np.zeros_like(full)
        if self.port:
            for j, column in enumerate(self.port.write(part.parameters, part.inputs, part.outputs, after)):
                change[:, j] = column - full[:, j]
        else:
            change[:, self.channel] = (self.before[k] - after) * (1.0 if self.attached.on_lost_motion else -1.0)
        return change

    def _signal(self, k: int, name: str) -> FloatArray:
        run, base = self.responses.problem.runs[k], self.responses.base
        inputs = [v.name for v in self.responses.kernel.inputs]
        column = self.attached.drive(name)
        if column is not None:
            return run.inputs[:, inputs.index(column.column)]
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


class _Extent:
    """Sizes of a motion, from which shape parameters are drawn."""

    def __init__(self, signals: Sequence[Coordinates]) -> None:
        loads = [c.load for c in signals if c.load is not None]
        span = max(float(np.ptp(c.x)) for c in signals) or 1.0
        speed, acceleration = (
            float(np.sqrt(np.mean(np.concatenate([getattr(c, n) for c in signals]) ** 2))) or 1.0 for n in ("v", "a")
        )
        self.lowest = min(float(np.min(c.x)) for c in signals)
        self.highest = max(float(np.max(c.x)) for c in signals)
        self.scales: dict[Scale, float] = {
            "stroke": span,
            "per stroke": 1.0 / span,
            "travel": max(float(np.sum(np.abs(np.diff(c.x)))) for c in signals) or 1.0,
            "speed": speed,
            "acceleration": acceleration,
            "time": max(float(np.ptp(c.time)) for c in signals),
            "load": float(np.max(np.abs(np.concatenate(loads)))) if loads else 1.0,
        }

    def at_quantile(self, shape: Shape, q: float) -> float:
        """Value of a shape parameter at the quantile ``q`` of its range."""
        if shape.scale == "turns":
            return (self.highest - self.lowest or 1.0) / (2.0 * math.pi * (shape.lo + (shape.hi - shape.lo) * q))
        if shape.scale in EVENLY:
            share = shape.lo + (shape.hi - shape.lo) * q
            return self.lowest + (self.highest - self.lowest) * share if shape.scale == "position" else share
        return self.scales.get(shape.scale, 1.0) * shape.lo * (shape.hi / shape.lo) ** q

    def limits(self, shape: Shape) -> tuple[float, float] | None:
        """Range that a refit may use; None for that of the declaration."""
        if shape.scale in ("angle", "share", "number"):
            return None
        lo, hi = self.at_quantile(shape, 0.0), self.at_quantile(shape, 1.0)
        if shape.scale == "turns":
            return hi, lo  # a drum of fewer turns is no drum: any smooth function of the position
        if shape.scale in EVENLY:
            middle, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
            return middle - SHAPE_RANGE_RATIO * half, middle + SHAPE_RANGE_RATIO * half
        return lo / SHAPE_RANGE_RATIO, hi * SHAPE_RANGE_RATIO


def normalised(columns: FloatArray) -> FloatArray:
    """Columns of length one; those that are zero are left out."""
    norms = np.linalg.norm(columns, axis=0)
    return columns[:, norms > 0.0] / norms[norms > 0.0]


def public(attached: Attached, name: str) -> str:
    """Public name, in a chain, of an effect's parameter."""
    return attached.prefix.replace("__", ".") + name


def _largest(effect: Kernel, name: str) -> float:
    quantity = next(v.quantity for v in effect.parameters if v.name == name)
    bound = quantity.hi if quantity.hi > 0.0 else -quantity.lo
    return 0.5 * bound if math.isfinite(bound) else 1e9
