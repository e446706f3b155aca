"""A constant or slowly moving bias.

::

    y <- y + b + c t,   t since the start                                               (1)

Limits: b = c = 0 changes nothing. Source: sensor zero and its drift; effects.md 1, `offset_drift`.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity

NAME = "offset_drift"
PLACES = ("output", "input", "friction")
SIGNATURE = "constant or slowly moving bias"


class Params(NamedTuple):
    b: Annotated[float, Quantity("{y}", "bias at the start, Eq (1)")] = 0.0
    c: Annotated[float, Quantity("{y}/s", "drift, Eq (1)")] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    t: Annotated[float, Quantity("s", "time since the start")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(0.0), Outputs(u.y + p.b)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    t = s.t + dt
    return State(t), Outputs(u.y + p.b + p.c * t)  # (1)
