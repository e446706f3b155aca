"""Friction that grows with the speed.

::

    F <- F + f_v v + q |v|^p s                                                          (1)

q is the force at a speed of 1 (m/s or rad/s). Limits: f_v = q = 0 changes nothing; v = 0 gives no force.
Dissipative for f_v, q >= 0. Source: Newton; a power law where q is not 0.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "viscous"
ABOUT = Effect(
    words="speed-dependent friction",
    signature="grows with speed",
    shown_by="the same stroke at three speeds or more, a factor of ten apart",
    places=("friction",),
    family="speed",
)


class Params(NamedTuple):
    f_v: Annotated[float, Quantity("{F}/({x}/s)", "viscous coefficient, Eq (1)", lo=0.0), Size()] = 0.0
    q: Annotated[float, Quantity("{F}", "force of the power term at unit speed, Eq (1)", lo=0.0), Size()] = 0.0
    p: Annotated[
        float, Quantity("1", "exponent of the power term, Eq (1)", lo=0.1, hi=4.0), Shape("exponent", 0.25, 2.0)
    ] = 0.5


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    v: Annotated[float, Quantity("{x}/s", "speed")]
    s: Annotated[float, Quantity("1", "direction of the last motion")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + p.f_v * u.v + p.q * math.pow(abs(u.v), p.p) * u.s)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + p.f_v * u.v + p.q * math.pow(abs(u.v), p.p) * u.s)  # (1)
