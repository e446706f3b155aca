"""Of what a residual is a law: each family of effects by what its functions predict of it where they were not fitted.

An effect is one equation of its family; the functions here are many, so that they stand for laws that no effect has.
They are numbers of about unit size, without texts: for a formula see `library`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product

import numpy as np
from scipy.signal import lfilter

from ...effects import EFFECTS, shapes_of, sizes_of
from ...effects.about import Family
from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel
from ...regression.threads import together
from ..runs.motion_signals import Coordinates
from .library import LAGS, SPEEDS, folds
from .predictable import share_left_out

DAMPING = (1e-4, 1e-3, 1e-2, 1e-1, 1.0)
"""Ridge factors tried, relative to the samples."""
ROWS = 8000
"""Samples of all runs together that the regression sees; functions with a memory are made at full sampling."""
HATS = 14
"""Functions over the stroke that each sit at one place."""
WAYS, AFTER_REVERSAL, AFTER_REST = (0.002, 0.7), 14, 9
"""Ways since a reversal over which so many functions are spread that each sit at one of them, as parts of the stroke.

Closer to each other where they are short: a gap that is crossed, a spring that lets go, are bumps there, no decays. The
first of them also grow with the rest before the reversal.
"""
LAGGED = (0.01, 0.05, 0.2)
"""Time constants of a rate, as parts of the time between reversals."""
AMONG_FUNCTIONS = tuple(Kernel(module) for module in EFFECTS if module.ABOUT.among_functions)
SHAPES = {"stroke": (0.01, 0.05, 0.2), "time": (0.03, 0.3, 3.0), "number": (0.0, 1.0)}
"""Shapes of these effects, by scale: parts of the stroke, and of the time between reversals."""


def family_shares(
    residuals: Sequence[FloatArray], outputs: Sequence[FloatArray], functions: Functions, imitated: FloatArray
) -> dict[Family, float]:
    """Share of one channel's residual that each family's functions predict on parts that were left out.

    Parameters
    ----------
    residuals, outputs : sequence of ndarray, shape (n,)
        What the fitted model leaves and gives, one array a run.
    functions : Functions
        Of the motion at the same samples, for all channels.
    imitated : ndarray, shape (samples of all runs, k)
        What the model's parameters can do, which a fit has taken already.
    """
    rows = np.concatenate([np.arange(r.size) % functions.step == 0 for r in residuals])
    basis = np.linalg.qr(np.column_stack([functions.common, imitated[rows]]))[0]
    y = _outside(np.concatenate(residuals)[rows], basis)
    fold = folds([r.size for r in residuals])[rows]
    found: dict[Family, float] = {}
    for family, columns in functions.of_all(outputs).items():
        x = _outside(columns, basis)
        size = np.sqrt(np.mean(x**2, axis=0))
        x = x[:, size > 1e-6] / size[size > 1e-6]
        found[family] = float(share_left_out(x, y[:, None], fold, DAMPING)[0]) if x.size else 0.0
    return found


class Functions:
    """The functions of each family as columns, at every ``step``-th sample, run by run.

    Parameters
    ----------
    places : sequence of Coordinates
        One a run.
    step : int, optional
        By default what leaves about `ROWS` samples.
    """

    def __init__(self, places: Sequence[Coordinates], step: int | None = None) -> None:
        self.step = step or max(1, sum(c.x.size for c in places) // ROWS)
        self.runs = [_Run(c, self.step) for c in places]
        self.sizes = _Sizes(places)
        self.common = _joined([(np.ones(run.kept.z.size), run.kept.z, run.kept.s) for run in self.runs])
        ways: dict[Family, Callable[[_Sizes, _Run], list[FloatArray]]] = {
            "position": _position, "speed": _speed, "acceleration": _acceleration, "load": _load, "time": _time,
            "history": _history, "direction": _direction,
        }  # fmt: skip
        self._of_motion: dict[Family, FloatArray] = {}
        for family, way in ways.items():
            per_run = together(partial(way, self.sizes), self.runs)
            if per_run[0]:
                self._of_motion[family] = _joined(per_run)

    def of_all(self, outputs: Sequence[FloatArray]) -> dict[Family, FloatArray]:
        """Those of the motion, which all channels have in common, and of the sensor of one, by what its model gives."""
        y = np.concatenate(outputs)
        mean, size = float(y.mean()), float(y.std()) or 1.0
        per_run = [_sensor(self.sizes, run, (one - mean) / size) for run, one in zip(self.runs, outputs, strict=True)]
        of_sensor: dict[Family, FloatArray] = {"sensor": _joined(per_run)}
        return self._of_motion | of_sensor


def _joined(per_run: Sequence[Sequence[FloatArray]]) -> FloatArray:
    """Functions as columns, the runs one after the other."""
    return np.column_stack([np.concatenate(column) for column in zip(*per_run, strict=True)])


def _outside(columns: FloatArray, basis: FloatArray) -> FloatArray:
    return columns - basis @ (basis.T @ columns)


class _Run:
    """A run, and its coordinates where the functions are wanted."""

    def __init__(self, every: Coordinates, step: int) -> None:
        self.every, self.step = every, step
        self.kept = every.part(slice(None, None, step))

    def lag(self, values: FloatArray, time_constant: float) -> FloatArray:
        """`_lag` of values at every sample."""
        return self.at(_lag(values, self.every, time_constant))

    def rate(self, values: FloatArray) -> FloatArray:
        """Derivative by time of values at every sample."""
        return np.gradient(values, self.every.time)

    def at(self, values: FloatArray) -> FloatArray:
        """Values at every sample, where they are wanted."""
        return values[:: self.step]


class _Sizes:
    """What the coordinates are divided by."""

    def __init__(self, places: Sequence[Coordinates]) -> None:
        x = np.concatenate([c.x for c in places])
        self.low, self.span = float(x.min()), float(np.ptp(x)) or 1.0
        self.stroke = max(float(np.ptp(c.x)) for c in places) or 1.0
        self.v, self.a = (
            float(np.sqrt(np.mean(np.concatenate([getattr(c, n) for c in places]) ** 2))) or 1.0 for n in ("v", "a")
        )
        self.length = max(float(np.ptp(c.time)) for c in places) or 1.0
        self.travel = max(float(np.sum(np.abs(np.diff(c.x)))) for c in places) or 1.0
        self.pace = self.span / self.v
        loads = np.concatenate([_loads(c) for c in places])
        self.loads = np.maximum(np.max(np.abs(loads), axis=0), 1e-300)
        warm = np.concatenate([c.temperatures if c.temperatures.size else np.empty((c.x.size, 0)) for c in places])
        self.mild, self.warming = warm.mean(axis=0), np.maximum(np.ptp(warm, axis=0), 1e-300)


def _position(r: _Sizes, run: _Run) -> list[FloatArray]:
    c = run.kept
    x = (c.x - r.low) / r.span
    hats = _hats(x, HATS)
    return [*hats, *(c.z * hat for hat in hats), (x - 0.5) * c.v / r.v, (x - 0.5) ** 2 * c.v / r.v]


def _speed(r: _Sizes, run: _Run) -> list[FloatArray]:
    c = run.kept
    w, s = c.v / r.v, np.abs(c.v) / r.v
    return [
        w, w * s, w**3, c.s * np.sqrt(s), c.z * s, c.z * s * s, np.arcsinh(10.0 * w), np.arcsinh(40.0 * w),
        *(c.z * np.exp(-s / q) for q in SPEEDS), *(c.z * np.exp(-((s / q) ** 2)) for q in SPEEDS),
    ]  # fmt: skip


def _acceleration(r: _Sizes, run: _Run) -> list[FloatArray]:
    every, c = run.every.a / r.a, run.kept
    b = run.at(every)
    forth, faster = (c.v > 0.0).astype(float), (c.a * c.v > 0.0).astype(float)
    short, sized = np.tanh(b / 0.3), np.abs(np.tanh(b / 0.3))
    jerk = run.at(run.rate(every)) * r.pace
    return [
        b, jerk, np.abs(b), c.z * np.abs(b), short, c.z * sized, c.z * sized * faster, c.z * faster, short * forth,
        c.z * np.abs(b) * faster, b * forth, b**3 / 5.0, run.lag(every, 0.05 * r.pace), run.lag(every, 0.2 * r.pace),
    ]  # fmt: skip


def _loads(c: Coordinates) -> FloatArray:
    """Every load, tension and angle beside the motion, each once, shape (n, k)."""
    model_load = [] if c.load is None or any((c.load == y).all() for y in c.driven.T) else [c.load]
    return np.column_stack([*model_load, *c.driven.T]) if model_load or c.driven.size else np.empty((c.x.size, 0))


def _load(r: _Sizes, run: _Run) -> list[FloatArray]:
    return [f for load in (_loads(run.every) / r.loads).T for f in _load_laws(r, run, load)]


def _load_laws(r: _Sizes, run: _Run, every: FloatArray) -> list[FloatArray]:
    load, c = run.at(every), run.kept
    size, with_motion = np.abs(load), (load * c.v > 0.0).astype(float)
    levels = [size, load, load**2, np.sqrt(size), *(np.maximum(0.0, size - q) for q in (0.25, 0.5, 0.75))]
    with_side = [size * with_motion, size * np.tanh(10.0 * load * c.v / r.v)]
    return [
        load, size, load**2, np.tanh(10.0 * load), np.tanh(30.0 * load), *(c.z * f for f in (*levels, *with_side)),
        size * c.v / r.v, load * (c.x - r.low) / r.span, *(run.lag(every, part * r.length) for part in LAGS),
        run.lag(every**2, 0.1 * r.length),
    ]  # fmt: skip


def _time(r: _Sizes, run: _Run) -> list[FloatArray]:
    every, c = run.every, run.kept
    t, s = (c.time - c.time[0]) / r.length, np.abs(every.v) / r.v
    way = run.at(np.cumsum(np.abs(np.diff(every.x, prepend=every.x[0])))) / r.travel
    warm = [run.lag(s / (s + 0.1), part * r.length) for part in (0.1, 0.3)]
    fades = [t, t * t, np.exp(-t / 0.1), np.exp(-t / 0.3), way, np.exp(-way / 0.1), np.exp(-way / 0.4), *warm]
    fades += [*((c.temperatures - r.mild) / r.warming).T] if c.temperatures.size else []
    return [*fades, *(c.z * f for f in fades), *(c.v / r.v * f for f in fades[2:4])]


def _history(r: _Sizes, run: _Run) -> list[FloatArray]:
    every, c = run.every, run.kept
    shortest, longest = (part * r.stroke for part in WAYS)
    way = np.log(np.clip(c.since_reversal, shortest, longest) / shortest) / np.log(longest / shortest)
    after = _hats(way, AFTER_REVERSAL)
    log_dwell, u, w = np.log1p(c.dwell / 0.1), (every.x - r.low) / r.span, np.abs(every.v) / r.v
    lags = [part * r.length for part in LAGS]
    return [
        *(c.s * f for f in after), *(c.s * log_dwell * f for f in after[:AFTER_REST]), c.z * log_dwell,
        *(run.at(u) - run.lag(u, tau) for tau in lags), *(c.s - run.lag(every.s, tau) for tau in lags),
        *(c.z * (run.at(w) - run.lag(w, part * r.pace)) for part in LAGGED), *_of_effects("history", r, run),
    ]  # fmt: skip


def _of_effects(family: Family, r: _Sizes, run: _Run) -> Iterator[FloatArray]:
    """What effects of a family make that are among its functions, each of a size of one."""
    c, unit = run.every, {"stroke": r.stroke, "time": r.pace, "number": 1.0}
    for effect in (one for one in AMONG_FUNCTIONS if one.module.ABOUT.family == family):
        signals = [np.zeros(c.x.size) if v.name == "y" else getattr(c, v.name) for v in effect.inputs]
        inputs = np.column_stack(signals)
        shapes, sizes = shapes_of(effect.module), dict.fromkeys(sizes_of(effect.module), 1.0)
        for parts in product(*(SHAPES[shape.scale] for shape in shapes.values())):
            values = {n: q * unit[shape.scale] for (n, shape), q in zip(shapes.items(), parts, strict=True)}
            yield run.at(effect.simulate(effect.params(values=sizes | values), c.time, inputs)[:, 0])


def _direction(r: _Sizes, run: _Run) -> list[FloatArray]:
    c = run.kept
    s, forth = np.abs(c.v) / r.v, (c.v > 0.0).astype(float)
    both = [s, s * s, np.sqrt(s)]
    return [forth, np.abs(c.z), *both, *(forth * f for f in both)]


def _sensor(r: _Sizes, run: _Run, u: FloatArray) -> list[FloatArray]:
    time, rate = run.kept.time, run.rate(u) * r.pace
    return [run.at(u), run.at(rate), run.at(run.rate(rate)) * r.pace, run.at(rate) * (time - time[0]) / r.length]


def _hats(u: FloatArray, number: int) -> list[FloatArray]:
    """So many functions of 0 to 1, each of which is 1 at one place and 0 at all others."""
    return [np.maximum(0.0, 1.0 - np.abs(u * (number - 1) - k)) for k in range(number)]


def _lag(values: FloatArray, c: Coordinates, time_constant: float) -> FloatArray:
    """A first-order lag, from rest at the first value."""
    keep = float(np.exp(-float(np.median(np.diff(c.time))) / time_constant))
    slow, _ = lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])
    return np.asarray(slow)
