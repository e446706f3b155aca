"""The rigs: what they are without anything hidden, and how the user's model parameters follow from them.

=================== ================================== ====================================================
baseline            rig without hidden effect          parameters of the user's model (exact correspondence)
=================== ================================== ====================================================
TendonDrive         x_out = c x - w PI(x), PI = stop   c = c; |beta|/alpha = w; 1/alpha = forgetting travel of
                    elements with an exponential       the stops; ratio = ratio; tau_c = tau_s = F_c, sigma0 =
                    reversal curve; tau_in = ratio     F_c over the presliding travel of the stops; sigma1 = 0;
                    tau_out + F_c PI_2(x) + sigma2 v   sigma2 = sigma2
PairedTsmBacklash   x_out as above                     as above
LuGreFriction       F = F_c PI(x) + sigma2 v; with a   F_c = F_s; sigma0 = F_c / presliding travel; sigma1 = 0;
                    Stribeck dip instead of the stops  with a dip F_c, F_s, v_s of that level
                    one element that approaches a
                    Gaussian level over the travel
SingleTsmDahl       F = mean level PI(x) + half the    rho1 = level in pull, rho2 in release, mu1 = mu2 = mu3 =
                    difference of the levels           0, sigma = mean level / presliding travel
=================== ================================== ====================================================

The stop elements follow the models' exponential on every curve that starts from sliding; in loops that reverse inside
the presliding travel they differ (their loops close, the models' do not). Strokes are many presliding travels long.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from .motions import FloatArray, Motion
from .operators import approach, maxwell_slip

RUNS = 100
"""Seeds of a case, one for each run."""
MODELS = ("TendonDrive", "LuGreFriction", "PairedTsmBacklash", "SingleTsmDahl")


@dataclass(frozen=True)
class Rig:
    """Constants of a rig in SI units.

    Attributes
    ----------
    model : str
        Name of the user's model.
    stroke : float
        Half stroke [rad or m].
    c, w, forget : float
        Motion: ratio, half width of the loop [rad], travel that forgets a reversal [rad].
    ratio, f_c, x_pre, viscous : float
        Load ratio, sliding level [N.m or N], presliding travel [rad or m], viscous friction.
    f_s, v_s : float
        Static level and Stribeck speed of a rig with a friction minimum; f_s = f_c without.
    uneven : float
        Half difference of the levels in pull and release over their mean.
    load, load_swing : float
        Mean and swing of the load [N.m or N].
    held : bool
        The load does not swing.
    """

    model: str
    stroke: float
    c: float = 1.0
    w: float = 0.0
    forget: float = 1.0
    ratio: float = 1.0
    f_c: float = 0.0
    x_pre: float = 1.0
    viscous: float = 0.0
    f_s: float = 0.0
    v_s: float = 1.0
    uneven: float = 0.0
    load: float = 0.0
    load_swing: float = 0.0
    held: bool = False

    @property
    def speed(self) -> float:
        """Usual speed, by which effects scale."""
        return 1.3 * self.stroke

    @property
    def acceleration(self) -> float:
        """Usual acceleration, by which effects scale."""
        return 6.0 * self.stroke

    @property
    def pull(self) -> float:
        """Usual load, by which effects scale."""
        return abs(self.load) + 0.5 * self.load_swing

    def parameters(self) -> dict[str, float]:
        """Parameters of the user's model that describe this rig."""
        motion = {"c": self.c, "beta": -self.w / self.forget, "alpha": 1.0 / self.forget}
        if self.model == "PairedTsmBacklash":
            return motion
        stiffness = self.f_c / self.x_pre
        if self.model == "TendonDrive":
            friction = {
                "sigma0": stiffness,
                "sigma1": 0.0,
                "sigma2": self.viscous,
                "tau_c": self.f_c,
                "tau_s": self.f_s,
            }
            return {**motion, "ratio": self.ratio, **friction, "v_s": self.v_s, "tau_v": 0.0}
        if self.model == "LuGreFriction":
            levels = {"F_c": self.f_c, "F_s": self.f_s, "v_s": self.v_s}
            return {"sigma0": stiffness, "sigma1": 0.0, "sigma2": self.viscous, **levels}
        levels = {"rho1": self.f_c * (1.0 + self.uneven), "rho2": self.f_c * (1.0 - self.uneven)}
        return {**levels, "mu1": 0.0, "mu2": 0.0, "mu3": 0.0, "sigma": stiffness}

    def with_parameters(self, values: dict[str, float]) -> Rig:
        """The rig that other parameter values of the user's model describe."""
        p = {**self.parameters(), **values}
        if self.model == "SingleTsmDahl":
            mean = 0.5 * (p["rho1"] + p["rho2"])
            return replace(self, f_c=mean, uneven=0.5 * (p["rho1"] - p["rho2"]) / mean, x_pre=mean / p["sigma"])
        moved = self
        if "c" in p:
            moved = replace(moved, c=p["c"], w=-p["beta"] / p["alpha"], forget=1.0 / p["alpha"])
        if "sigma0" in p:
            f_c, f_s = (p["tau_c"], p["tau_s"]) if "tau_c" in p else (p["F_c"], p["F_s"])
            moved = replace(moved, f_c=f_c, f_s=f_s, x_pre=f_c / p["sigma0"], viscous=p["sigma2"], v_s=p["v_s"])
        return replace(moved, ratio=p.get("ratio", 1.0))


@dataclass
class Signals:
    """What runs through a rig on the fine grid, SI units."""

    rig: Rig
    t: FloatArray
    x: FloatArray
    v: FloatArray
    a: FloatArray
    load: FloatArray
    z: FloatArray
    seed: int
    friction: FloatArray = field(default_factory=lambda: np.zeros(0))
    x_out: FloatArray = field(default_factory=lambda: np.zeros(0))
    levels: dict[str, float] = field(default_factory=dict)
    """Steps of coarse converters by channel; applied after the noise."""

    @property
    def step(self) -> float:
        return float(self.t[1] - self.t[0])

    @property
    def rng(self) -> np.random.Generator:
        """The same numbers however often an effect is tried; others in each run."""
        return np.random.default_rng(self.seed)

    @property
    def rig_rng(self) -> np.random.Generator:
        """The same numbers in every run of the rig: where on the drum or in the sheath something is."""
        return np.random.default_rng(self.seed // RUNS)


Change = Callable[[Signals, float], None]
"""Changes ``friction`` or ``x_out`` of the signals in place by an effect of the given amount."""


def draw_rig(model: str, rng: np.random.Generator, *, turns: float = 0.0, dip: bool = False, held: bool = False) -> Rig:
    """Constants of a rig.

    Parameters
    ----------
    model : str
    rng : numpy.random.Generator
    turns : float
        Half stroke in turns of the drum, for effects that repeat with its angle.
    dip : bool
        Friction falls with speed (Stribeck), in the rig and in the user's model.
    held : bool
        The load does not change.
    """
    forget = rng.uniform(0.05, 0.1)
    c, w = rng.uniform(0.9, 1.05), forget * rng.uniform(0.15, 0.4)
    if model in ("TendonDrive", "PairedTsmBacklash"):
        stroke = 2.0 * np.pi * turns if turns else rng.uniform(1.0, 1.5)
        rig = Rig(model, stroke, c=c, w=w, forget=forget)
        if model == "PairedTsmBacklash":
            return rig
        level = rng.uniform(0.06, 0.14)
        rig = replace(
            rig, ratio=rng.uniform(0.92, 1.08), f_c=level, f_s=level, x_pre=rng.uniform(0.012, 0.025),
            viscous=level * rng.uniform(0.02, 0.06) / rig.stroke, load=rng.uniform(-0.02, 0.02),
            load_swing=rng.uniform(0.12, 0.3),
        )  # fmt: skip
    else:
        level, stroke = rng.uniform(2.0, 6.0), rng.uniform(0.02, 0.04)
        rig = Rig(model, stroke * (3.0 if turns else 1.0), f_c=level, f_s=level, x_pre=rng.uniform(3e-4, 6e-4))
        if model == "LuGreFriction":
            rig = replace(rig, viscous=level * rng.uniform(0.02, 0.08) / rig.stroke)
        else:
            rig = replace(
                rig, uneven=rng.uniform(-0.02, 0.02), load=rng.uniform(14.0, 20.0), load_swing=rng.uniform(6.0, 10.0)
            )
    rig = replace(rig, v_s=0.25 * rig.stroke)
    if dip:
        rig = replace(rig, f_s=1.4 * rig.f_c)
    return replace(rig, held=held)


def signals(rig: Rig, m: Motion, seed: int) -> Signals:
    """Motion, load and the rig's own friction and output motion, nothing hidden."""
    rng = np.random.default_rng(seed)
    x, v, a = rig.stroke * m.x, rig.stroke * m.v, rig.stroke * m.a
    wave = np.sin(2.0 * np.pi * rng.uniform(0.13, 0.21) * m.t + rng.uniform(0.0, 6.28))
    load = rig.load + rig.load_swing * (np.full(x.size, 0.3) if rig.held else 0.45 * m.x + 0.55 * wave)
    z = maxwell_slip(x, rig.x_pre) if rig.f_c else np.zeros(x.size)
    friction = rig.f_c * z
    if rig.f_s != rig.f_c:
        level = rig.f_c + (rig.f_s - rig.f_c) * np.exp(-((v / rig.v_s) ** 2))
        friction = approach(level, x, rig.f_c / rig.x_pre)
        z = friction / level
    s = Signals(rig, m.t, x, v, a, load, z, seed)
    s.friction = friction + rig.uneven * rig.f_c + rig.viscous * v
    s.x_out = rig.c * x - (rig.w * maxwell_slip(x, rig.forget) if rig.w else 0.0)
    return s


def channels(s: Signals) -> dict[str, FloatArray]:
    """Measured channels of the rig, without instrument errors."""
    if s.rig.model == "TendonDrive":
        return {"x_out": s.x_out, "tau_in": s.rig.ratio * s.load + s.friction}
    return {"x_out": s.x_out} if s.rig.model == "PairedTsmBacklash" else {"F": s.friction}
