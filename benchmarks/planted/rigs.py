"""The rigs: each model as it is, its friction or its motion open for an effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

from .motions import DT, Array, motion

NOISE = 0.003
"""White noise of a channel, as part of its spread."""


@dataclass(frozen=True)
class Rig:
    """A model with values, and how it is used.

    Attributes
    ----------
    values : mapping of str to float
        Parameters of the rig.
    stroke : float
        Half stroke [rad or m].
    friction : tuple of str
        Parameters of the friction's size, by which the given model is a little wrong.
    fixed : tuple of str
        Parts of the law that this rig has not.
    """

    values: Mapping[str, float]
    stroke: float
    friction: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()


_PLAIN = {"mu1": 0.0, "mu2": 0.0, "mu3": 0.0}
_KAPPAS = ("kappa1", "kappa2", "kappa3", "kappa4", "kappa5")
_DRIVE = {
    "c": 0.97, "beta": -0.45, "alpha": 9.3, "ratio": 1.03, "sigma0": 5.4, "sigma1": 0.0, "sigma2": 0.011,
    "tau_c": 0.104, "tau_s": 0.104, "v_s": 0.3, "tau_v": 0.0,
}  # fmt: skip
RIGS = {
    "LuGreFriction": Rig(
        {"sigma0": 109.0, "sigma1": 0.0, "sigma2": 0.117, "F_c": 0.73, "F_s": 0.73, "v_s": 0.3},
        0.41, ("F_c", "F_s", "sigma2"),
    ),
    "SingleTsmDahl": Rig(
        {"rho1": 3.1, "rho2": 2.7, "sigma": 5600.0} | _PLAIN, 0.031, ("rho1", "rho2"), (*_PLAIN, *_KAPPAS)
    ),
    "SingleTsmBoucWen": Rig(
        {"rho1": 3.1, "rho2": 2.7, "k": 5600.0, "sigma": 1.0, "n": 1.0, "mu4": 0.0} | _PLAIN,
        0.031, ("rho1", "rho2"), (*_PLAIN, "mu4", *_KAPPAS, "kappa6"),
    ),
    "SingleTsmLuGre": Rig(
        {"rho1": 1.1, "rho2": 0.9, "lambda": 0.0, "rho": 43.0, "sigma0": 5.0} | _PLAIN,
        1.13, ("rho1", "rho2"), (*_PLAIN, *_KAPPAS, "sigma0"),
    ),
    "PairedTsmFriction": Rig(
        {"rho": 43.0, "lambda": 0.0, "sigma": 1.0, "n": 1.0, "k_x": 0.0, "k_zeta": 130.0, "upsilon": 8.0, "F_0": 0.0},
        1.13, ("k_zeta", "upsilon"), ("force_scale", "k_x"),
    ),
    "PairedTsmBacklash": Rig({"c": 0.97, "beta": -0.45, "alpha": 9.3}, 1.13, ("c",)),
    "TendonDrive": Rig(_DRIVE, 1.13, ("c", "tau_c", "tau_s", "sigma2")),
    "DistalEstimator": Rig(_DRIVE, 1.13, ("c", "tau_c", "tau_s", "sigma2"), ("tau_v",)),
}  # fmt: skip
DIP = {"LuGreFriction": {"F_s": 1.05}}
"""Values of a rig with more friction at low speed."""


@dataclass
class Signals:
    """A run of a rig, before the noise.

    Attributes
    ----------
    t, x, v, a : ndarray, shape (n,)
        Time and motion; the travel since the start where the model sees a speed.
    z : ndarray
        Presliding state, between -1 and 1.
    load, theta, temperature : ndarray
        Load, bending angle of the sheath, and temperature of the room.
    stroke, pull : float
        Half stroke, and usual load.
    friction : ndarray
    x_out : ndarray
    sensor : dict of str to callable
        What the sensor of a channel makes of it.
    first : Signals, optional
        The rig's first run, by whose usual motion the laws of all its runs are scaled; None in that run.
    """

    t: Array
    x: Array
    v: Array
    a: Array
    z: Array
    load: Array
    theta: Array
    temperature: Array
    stroke: float
    pull: float
    friction: Array = field(default_factory=lambda: np.empty(0))
    x_out: Array = field(default_factory=lambda: np.empty(0))
    sensor: dict[str, Callable[[Array], Array]] = field(default_factory=dict)
    first: Signals | None = None

    def rms(self, name: str) -> float:
        """Root of the mean square of a signal in the rig's first run."""
        return float(np.sqrt(np.mean(getattr(self.first or self, name) ** 2)))


def slip(x: Array, reach: float) -> Array:
    """Straight elastic, then sliding: one slip element in [-1, 1]."""
    z = np.zeros(x.size)
    for k in range(1, x.size):
        z[k] = min(max(z[k - 1] + (x[k] - x[k - 1]) / reach, -1.0), 1.0)
    return z


def presliding(x: Array, reach: float) -> Array:
    """Dahl's state, exactly."""
    z = np.zeros(x.size)
    for k in range(1, x.size):
        s, d = np.sign(x[k] - x[k - 1]), abs(x[k] - x[k - 1]) / reach
        z[k] = s + (z[k - 1] - s) * np.exp(-d)
    return z


def signals(
    model: str, kind: str, rows: int, rng: np.random.Generator, scale: float = 1.0, pace: float = 1.0,
    dip: bool = False, loaded: float = 1.0,
) -> Signals:  # fmt: skip
    """A run without any effect.

    Parameters
    ----------
    model, kind : str
        Of `RIGS`, and of `motions.motion`.
    rows : int
    rng : numpy.random.Generator
    scale, pace : float
        Stroke over the rig's usual one, and how fast the motion is.
    dip : bool
        With more friction at low speed.
    loaded : float
        Load over the rig's usual one.
    """
    rig = RIGS[model]
    stroke = scale * rig.stroke
    x = stroke * motion(kind, rows, pace, rng)
    t = np.arange(rows, dtype=np.float64) * DT
    v = np.gradient(x, DT)
    if _sees_speed(model):
        x = np.cumsum(v) * DT
    pull = loaded * {"N": 20.0, "N.m": 0.45}["N" if model.startswith("Single") else "N.m"]
    swing = np.sin(2.0 * np.pi * 0.19 * t + rng.uniform(0.0, 6.28))
    load = pull * (0.7 + 0.5 * swing) if model.startswith("Single") else pull * (0.2 + 0.9 * swing)
    theta = 3.0 + 2.0 * np.sin(2.0 * np.pi * 0.11 * t + rng.uniform(0.0, 6.28))
    room = 296.0 + 4.0 * np.sin(2.0 * np.pi * 0.043 * t + rng.spawn(1)[0].uniform(0.0, 6.28))
    s = Signals(t, x, v, np.gradient(v, DT), presliding(x, 0.017 * rig.stroke), load, theta, room, stroke, pull)
    simulated = _simulated(model, s, {**rig.values, **(DIP.get(model, {}) if dip else {})})
    if model in ("TendonDrive", "DistalEstimator"):
        s.friction = simulated["tau_in"] - rig.values["ratio"] * load
    elif "F" in simulated:
        s.friction = simulated["F"]
    s.x_out = simulated.get("x_out", s.x_out)
    return s


def _sees_speed(model: str) -> bool:
    names = [v.name for v in kernel(model).inputs]
    return "v" in names and "x" not in names


def _simulated(model: str, s: Signals, values: Mapping[str, float]) -> dict[str, Array]:
    """The estimator's rig is the drive that it looks at."""
    base = kernel("TendonDrive" if model == "DistalEstimator" else model)
    columns = {
        "x": s.x, "x_in": s.x, "v": s.v, "a": s.a, "T_in": np.full(s.t.size, 20.0), "T_load": s.load,
        "tau_in": np.full(s.t.size, 0.5), "tau_load": s.load, "tau_out": s.load,
    }  # fmt: skip
    inputs = np.column_stack([columns[v.name] for v in base.inputs])
    outputs = base.simulate(base.params(None, values), s.t, inputs)
    return {v.name: outputs[:, j] for j, v in enumerate(base.outputs)}


def record(
    model: str, name: str, s: Signals, channels: Sequence[str], rng: np.random.Generator, beside: Sequence[str] = ()
) -> Record:
    """The run as it is measured, with columns beside the model's variables."""
    base, rig = kernel(model), RIGS[model]
    torque = rig.values.get("ratio", 1.0) * s.load + s.friction if s.friction.size else s.load
    motor = torque if model == "DistalEstimator" else np.full(s.t.size, 0.5)
    clean = {
        "x": s.x, "x_in": s.x, "v": s.v, "a": s.a, "T_in": np.full(s.t.size, 20.0), "T_load": s.load,
        "tau_in": torque if model == "TendonDrive" else motor, "tau_load": s.load, "tau_out": s.load,
        "F": s.friction, "x_out": s.x_out,
    }  # fmt: skip
    units = {v.name: v.quantity.unit for v in (*base.inputs, *base.outputs)}
    columns = {v.name: clean[v.name] for v in base.inputs}
    for channel in channels:
        noise = NOISE * clean[channel].std() * rng.normal(size=s.t.size)
        columns[channel] = s.sensor.get(channel, lambda y: y)(clean[channel] + noise)
    for column, values, unit in (("Theta", s.theta, "rad"), ("temperature", s.temperature, "K")):
        if column in beside:
            columns[column], units[column] = values, unit
    return Record(name, s.t, columns, {n: units[n] for n in columns})
