"""What an effect would change in the channels of a fitted model: its response, and what of it nothing else imitates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from scipy.stats import qmc

from ...effects import shapes_of, sizes_of
from ...effects.about import Scale, Shape
from ...kernels.arrays import FloatArray
from ...kernels.attached import Attached
from ...kernels.chain import model_part
from ...kernels.kernel import Kernel, kernel
from ...models.contract import InputError
from ...regression.sensitivity import output_jacobian
from ..criteria import SHAPE_RANGE_RATIO
from ..runs.motion_signals import Coordinates, coordinates_of, load_channel
from .refit import Fitted

SHAPES = 7
"""Shapes tried for each shape parameter of an effect."""
EVENLY: tuple[Scale, ...] = ("position", "angle")
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

    def limits(self, attached: Attached) -> dict[str, tuple[float, float]]:
        """Range of the shape parameters by public name: beyond it the effect has another one's signature."""
        ranges = {name: self.extent.limits(shape) for name, shape in shapes_of(attached.module).items()}
        return {public(attached, name): ends for name, ends in ranges.items() if ends is not None}

    def columns(
        self, attached: Attached, shape: Mapping[str, float], steps: Sequence[float] | None = None
    ) -> tuple[list[FloatArray], list[float]]:
        """Response to each size parameter alone, and the step it was taken with.

        Parameters
        ----------
        attached : Attached
        shape : mapping of str to float
            Values of the shape parameters.
        steps : sequence of float, optional
            Steps of the size parameters; chosen so that the response is of the residual's size by default.
        """
        effect, target_size = Kernel(attached.module), float(np.sqrt(np.sum(self.flat(self.fitted.residuals) ** 2)))
        columns, taken = [], []
        for number, (name, role) in enumerate(sizes_of(attached.module).items()):
            if steps is not None:
                step = steps[number]
            else:
                step = role.first
                size = float(np.linalg.norm(self.response(attached, effect, {**shape, name: step})))
                if math.isfinite(size) and size > 0.0:
                    limit = _largest(effect, name)
                    step = math.copysign(min(max(abs(step) * target_size / size, 1e-9), limit), step)
            column = self.response(attached, effect, {**shape, name: step})
            columns.append(column if np.isfinite(column).all() else np.zeros_like(column))
            taken.append(step)
        return columns, taken

    def response(self, attached: Attached, effect: Kernel, values: Mapping[str, float]) -> FloatArray:
        """Change of all channels by an effect, as one weighted column."""
        try:
            p = effect.params(None, values)
        except InputError:
            return np.zeros(sum(r.targets.size for r in self.problem.runs))
        runs = range(len(self.problem.runs))
        return self.flat([self._change(attached, effect, p, k)[:, self.problem.columns] for k in runs])

    def _change(self, attached: Attached, effect: Kernel, p: Any, k: int) -> FloatArray:
        """Change of all outputs of a run by the effect."""
        run, signals, full = self.problem.runs[k], self.signals[k], self.full[k]
        part = model_part(self.kernel, self.problem.params(self.fitted.table[k]), run.inputs, full)
        channel = [v.name for v in self.kernel.outputs].index(attached.channel) if attached.channel else None
        port = self.base.roles.friction if channel is None else None
        before = port.read(part.parameters, part.inputs, part.outputs) if port else full[:, channel]
        if attached.on_lost_motion:
            before = self.base.roles.lost_motion[attached.channel](part.parameters, part.inputs, part.outputs)
        columns = [before if v.name == "y" else self._signal(attached, signals, k, v.name) for v in effect.inputs]
        try:
            after = effect.simulate(p, run.time, np.column_stack(columns))[:, 0]
        except InputError:
            return np.full_like(full, np.nan)
        change = np.zeros_like(full)
        if port:
            for j, column in enumerate(port.write(part.parameters, part.inputs, part.outputs, after)):
                change[:, j] = column - full[:, j]
        else:
            change[:, channel] = (before - after) if attached.on_lost_motion else (after - before)
        return change

    def _signal(self, attached: Attached, signals: Coordinates, k: int, name: str) -> FloatArray:
        run, inputs = self.problem.runs[k], [v.name for v in self.kernel.inputs]
        column = attached.drive(name)
        if column is not None:
            return run.inputs[:, inputs.index(column.column)]
        if name == "load" and not self.base.roles.load:
            return np.ones(run.time.size)  # as an effect takes one that it may be without
        if name == "drive":
            drive = self.base.roles.drive
            if drive in inputs:
                return run.inputs[:, inputs.index(drive)]
            outputs = [v.name for v in self.kernel.outputs]
            return self.full[k][:, outputs.index(drive)] if drive else np.zeros(run.time.size)
        value = getattr(signals, name)
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
        if shape.scale in ("angle", "number"):
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
