"""Which effects could be missing, and how far each would go: one linear step from the refitted baseline.

The response of a candidate is its effect applied to the baseline's own signals, at a size that matches the
gap, for a spread of its shape parameters. What of it the baseline's parameters and the nuisance freedom cannot
imitate is what the log can show of this effect; how much of the residual that part explains ranks the candidates
for the full refit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from scipy.optimize import nnls
from scipy.stats import qmc

from ..chain import attach
from ..chain_source import Attached
from ..effects import EFFECTS
from ..identify.problem import BoolArray, FloatArray
from ..kernel import Kernel, kernel
from ..models.contract import InputError
from .coordinates import Coordinates, coordinates_of
from .study import Fitted, thinned

SHAPES = 7
"""Shapes tried for an effect with shape parameters."""
ROWS = 3000
"""Samples of all runs together that the linear step looks at."""
SIZE = 0.1
"""A hidden effect of this part of the channel's spread must be visible, or the log does not excite it."""
VISIBLE = 16.0
"""Twice the log likelihood that an effect of that size must gain to count as visible."""


OF_A_TURN = ("drum_periodic", "winding_crossover")
TURN = 3.0
"""Travel [rad] below which harmonics of an angle are any smooth function of the position."""


@dataclass(frozen=True)
class Screened:
    """What one linear step says of a candidate.

    Attributes
    ----------
    attached : Attached
        Effect and place.
    gain : float
        Twice the log likelihood gained over the baseline, less the cost of its parameters.
    visible : float
        Twice the log likelihood that an effect of `SIZE` would gain on these runs.
    values : dict of str to float
        Parameters of the effect at the best shape, by public name of the chain.
    travelled : bool
        Whether the motion goes far enough for an effect that is tied to turns.
    """

    attached: Attached
    gain: float
    visible: float
    values: dict[str, float]
    travelled: bool = True

    @property
    def excited(self) -> bool:
        return self.visible >= VISIBLE and self.travelled


def possible(model: str, channels: Sequence[str], attached: Sequence[str], inputs: Sequence[str]) -> list[Attached]:
    """Every effect at every place of the model where it can be seen in the channels."""
    base, found = kernel(model), []
    motion_units = ("rad", "m")
    units = {v.name: v.quantity.unit for v in base.outputs}
    for module in EFFECTS:
        places = [module.NAME] if "friction" in module.PLACES else []
        if "output" in module.PLACES:
            allowed = [c for c in channels if units[c] in motion_units or not getattr(module, "MOTION_ONLY", False)]
            places += [f"{module.NAME}@{c}" for c in allowed]
        for text in places:
            try:
                one = attach(base, text)
            except InputError:
                continue
            wants_bend = "bend" in module.Inputs._fields and "Theta" not in inputs
            on_friction = not one.channel and module.NAME == "offset_drift"  # the same as on a channel
            if one.spec not in attached and not wants_bend and not on_friction and (one.channel or "@" not in text):
                if "@" not in text and one.channel:
                    continue
                found.append(one)
    return found


def screen(
    fitted: Fitted, candidates: Sequence[Attached], floor: FloatArray, counted: BoolArray,
    said: Callable[[str], None] = lambda _: None,
) -> list[Screened]:  # fmt: skip
    """Rank candidates by one linear step from a fitted baseline.

    Parameters
    ----------
    fitted : Fitted
    candidates : sequence of Attached
    floor : ndarray, shape (channels,)
        Noise floor of each channel, in its unit.
    counted : ndarray of bool, shape (channels,)
        Channels whose gap counts.
    said : callable
        Told what is being done.
    """
    bench, found = _Bench(fitted, floor, counted), []
    for number, candidate in enumerate(candidates, 1):
        said(f"screen {number}/{len(candidates)}: {candidate.spec}")
        found.append(bench.screened(candidate))
    return sorted(found, key=lambda s: -s.gain)


def places_of(fitted: Fitted) -> list[Coordinates]:
    """Coordinates of each run of a fit, the load measured or as the model estimates it."""
    model, problem = fitted.problem.kernel, fitted.problem
    load = getattr(kernel(model.name).module, "LOAD", "")
    inputs, outputs = [v.name for v in model.inputs], [v.name for v in model.outputs]
    found = []
    for k, run in enumerate(problem.runs):
        signal = None
        if load in inputs:
            signal = run.inputs[:, inputs.index(load)]
        elif load in outputs:
            signal = model.simulate(problem.params(fitted.table[k]), run.time, run.inputs)[:, outputs.index(load)]
        found.append(coordinates_of(model, run, signal, fitted.values.get("motion.x_pre")))
    return found


class _Bench:
    """The linearised baseline, on which candidates are tried."""

    def __init__(self, fitted: Fitted, floor: FloatArray, counted: BoolArray) -> None:
        self.counted = counted
        effective, rmse = fitted.effective, fitted.rmse
        fitted = fitted.at(thinned(fitted.problem.runs, ROWS, ROWS // 10))
        self.fitted, self.effective = fitted, effective
        self.problem = fitted.problem
        self.kernel = self.problem.kernel
        self.sigma = np.maximum(floor, 0.1 * rmse)
        self.spread = fitted.spread
        self.share = np.sqrt(effective / sum(r.time.size for r in self.problem.runs))
        self.residual = self._flat(fitted.residuals)
        columns = jacobian(fitted, self.sigma / self.share)
        u, singular, _ = np.linalg.svd(columns, full_matrices=False)
        self.basis = u[:, singular > 1e-9 * singular[0]] if singular.size else u
        self.left = self._outside(self.residual)
        self.signals = places_of(fitted)
        self.full = [self._full_outputs(k) for k in range(len(self.problem.runs))]

    def _flat(self, per_run: Sequence[FloatArray]) -> FloatArray:
        """Weighted so that its square sum is twice the log likelihood lost, with autocorrelation allowed for."""
        return np.concatenate([(r / self.sigma * self.share).ravel() for r in per_run])

    def _outside(self, columns: FloatArray) -> FloatArray:
        return columns - self.basis @ (self.basis.T @ columns)

    def _full_outputs(self, k: int) -> FloatArray:
        run = self.problem.runs[k]
        return self.kernel.simulate(self.problem.params(self.fitted.table[k]), run.time, run.inputs)

    def screened(self, attached: Attached) -> Screened:
        effect = Kernel(attached.module)
        sizes = sizes_of(attached.module)
        best, visible = (-math.inf, {}), 0.0
        for shape in self._shapes(effect, sizes):
            columns, steps = self._columns(attached, effect, sizes, shape)
            if not columns:
                continue
            matrix = np.column_stack(columns)
            outside = self._outside(matrix)
            for column, whole in zip(outside.T, matrix.T, strict=True):
                strength = np.sum(whole**2)
                if strength > 0.0:
                    visible = max(visible, float(np.sum(column**2) / strength) * self._at_size(whole))
            gain, amounts = self._explained(effect, sizes, outside)
            gain -= 2.0 * len(effect.parameters)
            if gain > best[0]:
                values = {**shape, **{n: a * h for n, a, h in zip(sizes, amounts, steps, strict=True)}}
                best = (gain, values)
        values = {_public(attached, n): v for n, v in best[1].items()}
        span = max(float(np.ptp(c.x)) for c in self.signals)
        travelled = attached.module.NAME not in OF_A_TURN or span > TURN
        return Screened(attached, best[0], visible, values, travelled)

    def _explained(self, effect: Kernel, sizes: Sequence[str], outside: FloatArray) -> tuple[float, FloatArray]:
        scale = np.linalg.norm(outside, axis=0)
        used = outside / np.where(scale > 1e-9, scale, np.inf)
        signed = {v.name: v.quantity.lo < 0.0 for v in effect.parameters}
        both = [
            used[:, i : i + 1] * sign for i, n in enumerate(sizes) for sign in ((1.0, -1.0) if signed[n] else (1.0,))
        ]
        owner = [(i, sign) for i, n in enumerate(sizes) for sign in ((1.0, -1.0) if signed[n] else (1.0,))]
        matrix = np.column_stack(both)
        amounts, _ = nnls(matrix.T @ matrix + 1e-9 * np.eye(matrix.shape[1]), matrix.T @ self.left)
        found = np.zeros(len(sizes))
        for (i, sign), amount in zip(owner, amounts, strict=True):
            found[i] += sign * amount / scale[i] if scale[i] > 1e-9 else 0.0
        after = self.left - outside @ found
        count = self.sigma.size
        before = np.maximum(np.sum(self.left.reshape(-1, count) ** 2, axis=0), 1e-300)
        closed = np.maximum(np.sum(after.reshape(-1, count) ** 2, axis=0), 1e-6 * before)
        return float(np.sum((self.effective * np.log(before / closed))[self.counted])), found

    def _at_size(self, whole: FloatArray) -> float:
        """Twice the log likelihood of this response when it is `SIZE` of the channel's spread."""
        power = (whole.reshape(-1, self.sigma.size) ** 2).sum(axis=0)
        channel = int(np.argmax(power))
        rows = whole.size / self.sigma.size
        return float(rows * (SIZE * self.spread[channel] / self.sigma[channel] * self.share[channel]) ** 2)

    # -- responses

    def _columns(
        self, attached: Attached, effect: Kernel, sizes: Sequence[str], shape: Mapping[str, float]
    ) -> tuple[list[FloatArray], list[float]]:
        columns, steps = [], []
        for name in sizes:
            step = 1e-3 if name in ("g", "eps", "d", "w", "k", "compliance") else 1e-2
            low, high = next((v.quantity.lo, v.quantity.hi) for v in effect.parameters if v.name == name)
            sign = -1.0 if high == 0.0 else 1.0
            column = np.zeros(0)
            for _ in range(1):
                column = self._response(attached, effect, {**shape, name: sign * step})
                size = float(np.sqrt(np.sum(column**2) / max(np.sum(self.residual**2), 1e-300)))
                if not math.isfinite(size) or size == 0.0:
                    break
                step = float(
                    np.clip(step / size, 1e-9, 0.5 * (high if high > 0.0 else -low) if math.isfinite(high) else 1e9)
                )
            column = self._response(attached, effect, {**shape, name: sign * step})
            columns.append(column if np.isfinite(column).all() else np.zeros_like(column))
            steps.append(sign * step)
        return columns, steps

    def _response(self, attached: Attached, effect: Kernel, values: Mapping[str, float]) -> FloatArray:
        parts = []
        try:
            p = effect.params(None, values)
        except InputError:
            return np.zeros(self.residual.size)
        for k, run in enumerate(self.problem.runs):
            parts.append(self._change(attached, effect, p, k)[:, self.problem.columns])
            del run
        return self._flat(parts)

    def _change(self, attached: Attached, effect: Kernel, p: Any, k: int) -> FloatArray:
        """Change of all outputs of a run by the effect."""
        run, signals, full = self.problem.runs[k], self.signals[k], self.full[k]
        module = kernel(self.kernel.name).module
        mp = module.Params(*self.problem.params(self.fitted.table[k])[: len(module.Params._fields)])
        mu, mo = module.Inputs(*run.inputs.T[: len(module.Inputs._fields)]), module.Outputs(*full.T)
        channel = [v.name for v in self.kernel.outputs].index(attached.channel) if attached.channel else None
        before = module.friction_in(mp, mu, mo) if channel is None else full[:, channel]
        columns = [before if v.name == "y" else self._signal(signals, k, v.name) for v in effect.inputs]
        try:
            after = effect.simulate(p, run.time, np.column_stack(columns))[:, 0]
        except InputError:
            return np.full_like(full, np.nan)
        change = np.zeros_like(full)
        if channel is None:
            for j, column in enumerate(module.with_friction(mp, mu, mo, after)):
                change[:, j] = column - full[:, j]
        else:
            change[:, channel] = after - before
        return change

    def _signal(self, signals: Coordinates, k: int, name: str) -> FloatArray:
        run, inputs = self.problem.runs[k], [v.name for v in self.kernel.inputs]
        if name == "bend":
            return run.inputs[:, inputs.index("Theta")]
        if name == "drive":
            drive = getattr(kernel(self.kernel.name).module, "DRIVE", "")
            if drive in inputs:
                return run.inputs[:, inputs.index(drive)]
            outputs = [v.name for v in self.kernel.outputs]
            return self.full[k][:, outputs.index(drive)] if drive else np.zeros(run.time.size)
        value = getattr(signals, name)
        return np.zeros(run.time.size) if value is None else value

    def _shapes(self, effect: Kernel, sizes: Sequence[str]) -> list[dict[str, float]]:
        """Values of the shape parameters: spread over what these runs could show."""
        shapes = [v for v in effect.parameters if v.name not in sizes]
        if not shapes:
            return [{}]
        draws = qmc.Halton(len(shapes), rng=7).random(SHAPES)
        return [
            {v.name: self._drawn(v.name, v.quantity.unit, v.start, float(q)) for v, q in zip(shapes, row, strict=True)}
            for row in draws
        ]

    def _drawn(self, name: str, unit: str, start: float, q: float) -> float:
        speed = float(np.sqrt(np.mean(np.concatenate([c.v for c in self.signals]) ** 2))) or 1.0
        acceleration = float(np.sqrt(np.mean(np.concatenate([c.a for c in self.signals]) ** 2))) or 1.0
        span = max(float(np.ptp(c.x)) for c in self.signals) or 1.0
        length = max(float(np.ptp(c.time)) for c in self.signals)
        travel = max(float(np.sum(np.abs(np.diff(c.x)))) for c in self.signals) or 1.0
        if name == "L":
            return travel * 10.0 ** (1.3 * q - 1.0)
        ranges = {
            "{x}/s": speed * 10.0 ** (1.6 * q - 1.3),
            "{x}/s2": acceleration * 10.0 ** (1.5 * q - 1.0),
            "{x}": span * 10.0 ** (2.2 * q - 2.5),
            "1/({y})": 10.0 ** (2.0 * q) / span,
            "s": length * 10.0 ** (2.5 * q - 2.5),
            "{load}": 10.0 ** (1.5 * q - 2.0) * self._load_size(),
        }
        if unit == "1":
            return start * 2.0 ** (2.0 * q - 1.0)
        if unit == "rad":
            return 0.35 * (q + 0.1) if name == "w" else math.pi * q
        return ranges.get(unit, start)

    def _load_size(self) -> float:
        loads = [c.load for c in self.signals if c.load is not None]
        return float(np.max(np.abs(np.concatenate(loads)))) if loads else 1.0


def jacobian(fitted: Fitted, sigma: FloatArray) -> FloatArray:
    """Sensitivities of all channels to the free parameters, scaled by 1/sigma, one column each."""
    problem, columns = fitted.problem, []
    for field in problem.shared:
        j = problem.fields.index(field)
        h = 1e-4 * max(abs(fitted.table[0, j]), 1e-3)
        if fitted.table[0, j] + h > problem.parameters[field].max:
            h = -h
        parts = []
        for k in range(len(problem.runs)):
            row = fitted.table[k].copy()
            row[j] += h
            parts.append(((problem.outputs(k, row) - problem.outputs(k, fitted.table[k])) / h / sigma).ravel())
        columns.append(np.nan_to_num(np.concatenate(parts)))
    for field in problem.own:
        j = problem.fields.index(field)
        for k in range(len(problem.runs)):
            parts = [np.zeros(r.targets.size) for r in problem.runs]
            row = fitted.table[k].copy()
            row[j] += 1e-6
            parts[k] = ((problem.outputs(k, row) - problem.outputs(k, fitted.table[k])) / 1e-6 / sigma).ravel()
            columns.append(np.nan_to_num(np.concatenate(parts)))
    rows = sum(r.targets.size for r in problem.runs)
    matrix = np.column_stack(columns) if columns else np.zeros((rows, 0))
    norms = np.linalg.norm(matrix, axis=0)
    return matrix[:, norms > 0.0] / norms[norms > 0.0]


@cache
def sizes_of(module: ModuleType) -> tuple[str, ...]:
    """Parameters that alone take an effect out of neutral; the others shape it."""
    effect = Kernel(module)
    rng = np.random.default_rng(5)
    time = np.arange(400) * 1e-2
    grid = np.linspace(0.0, 12.0, time.size)
    signals = np.column_stack([np.interp(grid, np.arange(13), rng.normal(size=13)) for _ in effect.inputs])
    still = effect.simulate(module.NEUTRAL, time, signals)
    found = []
    for v in effect.parameters:
        step = -0.1 if v.quantity.hi == 0.0 else 0.05
        try:
            p = effect.params(None, {v.name: v.start + step})
        except InputError:
            continue
        if not np.array_equal(effect.simulate(p, time, signals), still):
            found.append(v.name)
    return tuple(found)


def _public(attached: Attached, name: str) -> str:
    return attached.prefix.replace("__", ".") + name
