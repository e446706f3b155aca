"""LeBus winding: two crossovers a turn, and a step of the radius from layer to layer.

::

    y <- y + A bump(x - x_b) + h (x - x_l) for x > x_l                                  (1)
    bump(d) = exp(-(d'/w)^2),   d' = d to the nearest multiple of pi                    (2)

The lay moves by one tendon width in two short crossovers per turn (AME 2020 Eq (4)); the second layer, from
the angle x_l on, winds at a larger radius, R_0 (1 + h) (AME 2020 Eq (36) with the corrected index).
x is the drum's angle: with a wheel of unknown size, bursts and layers would fit any law of the position.
Limits: A = h = 0 changes nothing. Source: AME 2020 Eqs (4) and (36).
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "winding_crossover"
ABOUT = Effect(
    words="crossover of the winding",
    signature="two bursts a turn, step per layer",
    shown_by="several turns of the drum, up to the next layer",
    places=("friction", "output", "input"),
    family="position",
    motion_only=True,
    turns=1.25,
)


class Params(NamedTuple):
    A: Annotated[float, Quantity("{y}", "height of a burst, Eq (1)"), Size()] = 0.0
    w: Annotated[
        float, Quantity("rad", "width of a burst, Eq (2)", lo=0.0, open_lo=True), Shape("angle", 0.035, 0.385)
    ] = 0.2
    x_b: Annotated[float, Quantity("rad", "angle of a burst, Eq (1)"), Shape("angle", 0.0, math.pi)] = 0.0
    h: Annotated[float, Quantity("{y}/rad", "slope change from the layer step, Eq (1)"), Size()] = 0.0
    x_l: Annotated[
        float, Quantity("rad", "angle at which the next layer begins, Eq (1)"), Shape("position", 0.0, 1.0)
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def bump(angle: float, width: float) -> float:
    """Burst at every multiple of pi, Eq (2)."""
    d = (angle - math.pi * math.floor(angle / math.pi + 0.5)) / width
    return math.exp(-d * d)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + p.A * bump(u.x - p.x_b, p.w) + p.h * max(0.0, u.x - p.x_l))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + p.A * bump(u.x - p.x_b, p.w) + p.h * max(0.0, u.x - p.x_l))  # (1)
