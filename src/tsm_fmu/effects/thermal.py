"""Friction that settles while the drive works and comes back after rest.

::

    tau dh/dt = active - h,   active = 1 - exp(-|v|/v_0)                                (1)
    F <- F (1 + d (1 - h)),   h = h_0 at the start of a run                             (2)

Eq (1) is exact at constant speed. Limits: d = 0 changes nothing; steady motion gives F (1 + d exp(-t/tau)).
Source: Bittencourt and Gunnarsson (J. Dyn. Syst. Meas. Control 134, 2012), friction and temperature of a robot joint.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size, Start

NAME = "thermal"
ABOUT = Effect(
    words="friction that changes with warmth",
    words_on_motion="lost motion that changes with warmth",
    signature="decays with time, recovers after rest",
    shown_by="minutes of motion, a rest, and the same motion again",
    places=("friction", "lost motion"),
    family="time",
    looks_like=("load_dependence", "wear"),
)


class Params(NamedTuple):
    d: Annotated[float, Quantity("1", "relative excess when cold, Eq (2)", lo=-0.9), Size(first=1e-3)] = 0.0
    # slow over a run; a drive works at more than the speed that counts as work
    tau: Annotated[float, Quantity("s", "time constant, Eq (1)", lo=0.0, open_lo=True), Shape("time", 0.05, 2.0)] = 10.0
    v_0: Annotated[
        float, Quantity("{x}/s", "speed that counts as work, Eq (1)", lo=0.0, open_lo=True), Shape("speed", 0.01, 0.32)
    ] = 0.01
    h_0: Annotated[
        float, Quantity("1", "warmth at the start, Eq (2)", lo=0.0, hi=1.0), Start("share", (0.0, 0.25, 0.5, 0.75))
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    h: Annotated[float, Quantity("1", "warmth, Eq (1)")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    v: Annotated[float, Quantity("{x}/s", "speed")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(p.h_0), Outputs(u.y * (1.0 + p.d * (1.0 - p.h_0)))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    active = -math.expm1(-abs(u.v) / p.v_0)
    h = active + (s.h - active) * math.exp(-dt / p.tau)  # (1)
    return State(h), Outputs(u.y * (1.0 + p.d * (1.0 - h)))  # (2)
