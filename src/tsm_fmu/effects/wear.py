"""Friction that changes with the travel and stays changed after rest.

::

    F <- F (1 + d exp(-X/L)),   X = integral |dx|                                       (1)

Limits: d = 0 changes nothing; long travel leaves F. Source: running-in; effects.md 1, `wear`.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity

NAME = "wear"
PLACES = ("friction",)
SIGNATURE = "changes with travel, stays after rest"


class Params(NamedTuple):
    d: Annotated[float, Quantity("1", "relative excess when new, Eq (1)", lo=-0.9)] = 0.0
    L: Annotated[float, Quantity("{x}", "travel that wears it off, Eq (1)", lo=0.0, open_lo=True)] = 10.0


NEUTRAL = Params()


class State(NamedTuple):
    x: Annotated[float, Quantity("{x}", "input position")]
    travel: Annotated[float, Quantity("{x}", "travel since the start")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x, 0.0), Outputs(u.y * (1.0 + p.d))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    travel = s.travel + abs(u.x - s.x)
    return State(u.x, travel), Outputs(u.y * (1.0 + p.d * math.exp(-travel / p.L)))  # (1)
