"""Friction that changes with the travel and stays changed after rest: running-in, and steady wear after it.

::

    F <- F (1 + d exp(-X/L) + r X),   X = X_0 + integral |dx|                           (1)

X_0 is what the drive has travelled before the run. d is what is run in and L the travel over which it is; r is what
each travel adds for good, as galling does.

Limits: d = r = 0 changes nothing; with r = 0 long travel leaves F. Source: running-in and the steady wear that follows
it, Blau (Tribology International 38, 2005).
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size, Start

NAME = "wear"
ABOUT = Effect(
    words="friction that changes with travel",
    words_on_motion="lost motion that changes with travel",
    signature="changes with travel, stays after rest",
    shown_by="long travel, a rest, and the same motion again",
    places=("friction", "lost motion"),
    family="time",
    looks_like=("load_dependence", "thermal"),
)


class Params(NamedTuple):
    d: Annotated[float, Quantity("1", "relative excess when new, Eq (1)", lo=-0.9), Size(first=1e-3)] = 0.0
    # what goes with a short travel comes back at each reversal, and is no wear
    L: Annotated[
        float, Quantity("{x}", "travel that wears it off, Eq (1)", lo=0.0, open_lo=True), Shape("travel", 0.05, 1.6)
    ] = 10.0
    r: Annotated[float, Quantity("1/{x}", "relative growth by steady wear, Eq (1)", lo=0.0), Size(first=1e-3)] = 0.0
    X_0: Annotated[
        float, Quantity("{x}", "travel before the run, Eq (1)", lo=0.0), Start("travel", (0.0, 0.1, 0.3, 1.0, 3.0))
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    x: Annotated[float, Quantity("{x}", "input position")]
    travel: Annotated[float, Quantity("{x}", "travel, with that before the run")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x, p.X_0), Outputs(_worn(p, u.y, p.X_0))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    travel = s.travel + abs(u.x - s.x)
    return State(u.x, travel), Outputs(_worn(p, u.y, travel))


def _worn(p: Params, y: float, travel: float) -> float:
    return y * (1.0 + p.d * math.exp(-travel / p.L) + p.r * travel)  # (1)
