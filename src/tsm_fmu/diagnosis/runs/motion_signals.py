"""Where a run is at each sample: the coordinates over which a residual is looked at, and that effects are driven by."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...effects import coordinates
from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel
from ...regression.problem import FitRun
from ..criteria import REST_SPEED_SHARE
from .drivers import drives_of

MOTION = Kernel(coordinates)


@dataclass(frozen=True)
class Coordinates:
    """Coordinates of one run, arrays of shape (n,).

    Attributes
    ----------
    x, v, a, s, z : ndarray
        Position, speed, acceleration, direction and presliding state of the input motion.
    x_pre : ndarray
        Presliding distance of z, the same everywhere.
    since_reversal : ndarray
        Travel since the last reversal, in the unit of x.
    dwell : ndarray
        Length of the last stand-still [s], from its end on.
    load : ndarray or None
    time : ndarray
    driven : ndarray, shape (n, k)
        Further loads, tensions and angles that the runs hold.
    temperatures : ndarray, shape (n, k)
    """

    x: FloatArray
    v: FloatArray
    a: FloatArray
    s: FloatArray
    z: FloatArray
    x_pre: FloatArray
    since_reversal: FloatArray
    dwell: FloatArray
    load: FloatArray | None
    time: FloatArray
    driven: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    temperatures: FloatArray = field(default_factory=lambda: np.empty((0, 0)))

    def part(self, rows: slice) -> Coordinates:
        """A copy at some of the samples."""
        return replace(self, **{name: y[rows] for name, y in vars(self).items() if y is not None and y.size})


def coordinates_of(kernel: Kernel, run: FitRun, load: FloatArray | None, x_pre: float | None = None) -> Coordinates:
    """Coordinates of a run; the speed is smoothed over a hundredth of the run's fastest reversal.

    Parameters
    ----------
    kernel : Kernel
    run : FitRun
    load : ndarray or None
        Load signal, measured or estimated.
    x_pre : float, optional
        Presliding distance of z; default 2 % of the largest stroke.
    """
    names = [v.name for v in kernel.inputs]
    channel = kernel.motion
    time, inputs = run.with_lead
    x = position_of(kernel, time, inputs)
    span = float(np.ptp(x)) or 1.0
    lag = 0.0 if channel == "v" else 2.0 * float(np.median(np.diff(time)))
    x_pre = x_pre or 0.02 * span
    p = MOTION.params(None, {"x_pre": x_pre, "tau_v": lag, "tau_a": 2.0 * lag})
    _, v, a, s, z = MOTION.simulate(p, time, x[:, None]).T
    if channel == "v":
        v = inputs[:, names.index(channel)]
    if "a" in names:
        a = inputs[:, names.index("a")]
    turned = np.flatnonzero(np.diff(_settled_direction(x, 0.002 * span))) + 1
    last = np.searchsorted(turned, np.arange(x.size), side="right") - 1
    since = np.where(last >= 0, np.abs(x - x[turned[np.maximum(last, 0)]]) if turned.size else span, span)
    full = Coordinates(x, v, a, s, z, np.full(x.size, x_pre), since, _last_hold(v, time), None, time)
    warm = [names.index(d.column) for d in drives_of(kernel) if d.role == "temperature"]
    beside = [names.index(d.column) for d in drives_of(kernel) if d.role in ("load", "bend")]
    driven, temperatures = run.inputs[:, beside], run.inputs[:, warm]
    return replace(full.part(slice(run.lead_time.size, None)), load=load, driven=driven, temperatures=temperatures)


def position_of(kernel: Kernel, time: FloatArray, inputs: FloatArray) -> FloatArray:
    """Position of the input motion, the travel where only its speed is measured; zero for a model without motion."""
    channel = next((d.column for d in drives_of(kernel) if d.role == "position"), kernel.motion)
    if not channel:
        return np.zeros(time.size)
    motion = inputs[:, [v.name for v in kernel.inputs].index(channel)]
    return np.cumsum(motion * np.diff(time, prepend=time[0])) if channel == "v" else motion


def coordinate_units(kernel: Kernel) -> tuple[str, str]:
    """SI units of the motion and of the load of a model, ``1`` where it has none."""
    units = {v.name: v.quantity.unit for v in (*kernel.inputs, *kernel.outputs)}
    motion = units.get(kernel.motion, "1").removesuffix("/s")
    return motion, units.get(load_channel(kernel), "1")


def load_channel(kernel: Kernel) -> str:
    """The model's load, or the first column that is one for a model without; empty without any."""
    return kernel.roles.load or next((d.column for d in drives_of(kernel) if d.role == "load"), "")


def _settled_direction(x: FloatArray, dead: float) -> FloatArray:
    """Direction of motion that ignores wobble below ``dead``, dated back to the turning point."""
    direction = np.zeros(x.size)
    extreme, at, now = float(x[0]), 0, 0.0
    for k, here in enumerate(x.tolist()):  # numbers of Python: those of an array take three times as long
        if (now >= 0.0 and here > extreme) or (now < 0.0 and here < extreme):
            extreme, at = here, k
        elif abs(here - extreme) > dead:
            turned = 1.0 if here > extreme else -1.0
            direction[at:k] = now or turned
            now = turned
            direction[at + 1 : k] = now
            extreme, at = here, k
        direction[k] = now
    return direction


def _last_hold(v: FloatArray, time: FloatArray) -> FloatArray:
    """Time since the last motion in each sample of a rest, and in those of a motion that of the rest before it."""
    rows = np.arange(v.size)
    moving = np.abs(v) > REST_SPEED_SHARE * np.sqrt(np.mean(v**2))
    rested = time - time[np.maximum.accumulate(np.where(moving, rows, 0))]
    resting = np.maximum.accumulate(np.where(moving, -1, rows))
    return np.where(resting >= 0, rested[resting], 0.0)
