"""An error proportional to the signal: pulley radius, calibration.

::

    y <- (1 + g) y                                                                      (1)

Limits: g = 0 changes nothing. Source: gain error of a sensor, as in its data sheet.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "gain_error"
ABOUT = Effect(
    words="a gain error",
    signature="proportional to the signal",
    shown_by="strokes of several sizes; a known reference for scale",
    places=("output", "input"),
    family="sensor",
)


class Params(NamedTuple):
    g: Annotated[float, Quantity("1", "relative gain error, Eq (1)", lo=-0.9, hi=9.0), Size(first=1e-3)] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + p.g * u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + p.g * u.y)  # (1)
