"""LeBus winding: two crossovers a turn, and a step of the radius from layer to layer.

::

    y <- y + (1 - drag + drag z) A bump(x/r - x_b) + h (x - x_l) for x > x_l            (1)
    bump(d) = exp(-(d'/w)^2),   d' = d to the nearest multiple of pi                    (2)

drag is the part of a burst that acts against the motion; r is the input position per radian of the drum, 1 where the
input is the drum's angle. The lay moves by one tendon width in two short crossovers per turn (AME 2020 Eq (4)); the
second layer, from the position x_l on, winds at a larger radius, R_0 (1 + h) (AME 2020 Eq (36) with the corrected
index). A wheel of unknown size is found by a search over the turns that the stroke could hold; a layer without bursts
is any bend of the position's law, and not named after a winding.
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
    looks_like=("drum_periodic",),
    turns=1.25,
    core=("A",),
)


class Params(NamedTuple):
    A: Annotated[float, Quantity("{y}", "height of a burst, Eq (1)"), Size()] = 0.0
    w: Annotated[
        float, Quantity("rad", "width of a burst, Eq (2)", lo=0.0, open_lo=True), Shape("width", 0.08, 0.385)
    ] = 0.2
    x_b: Annotated[float, Quantity("rad", "angle of a burst, Eq (1)"), Shape("angle", 0.0, math.pi)] = 0.0
    h: Annotated[float, Quantity("{y}/({x})", "slope change from the layer step, Eq (1)"), Size()] = 0.0
    x_l: Annotated[
        float, Quantity("{x}", "position at which the next layer begins, Eq (1)"), Shape("position", 0.0, 1.0)
    ] = 0.0
    r: Annotated[
        float,
        Quantity("{x}/rad", "input position per radian of the drum, Eq (1)", lo=0.0, open_lo=True),
        Shape("turns", 1.0, 12.0, tries=960),  # bursts are narrow: few of the sizes tried are near the true one
    ] = 1.0
    drag: Annotated[
        float,
        Quantity("1", "part of a burst that acts against the motion, Eq (1)", lo=0.0, hi=1.0),
        Shape("share", 0.0, 1.0),
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]
    z: Annotated[float, Quantity("1", "presliding state")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def bump(angle: float, width: float) -> float:
    """Burst at every multiple of pi, Eq (2)."""
    d = (angle - math.pi * math.floor(angle / math.pi + 0.5)) / width
    return math.exp(-d * d)


def wound(p: Params, u: Inputs) -> float:
    """Right-hand side of Eq (1)."""
    burst = p.A * bump(u.x / p.r - p.x_b, p.w)
    return u.y + (1.0 - p.drag + p.drag * u.z) * burst + p.h * max(0.0, u.x - p.x_l)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(wound(p, u))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(wound(p, u))
