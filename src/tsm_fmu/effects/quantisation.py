"""Few levels: an encoder or a coarse converter.

::

    y <- q floor(y/q + 1/2)                                                             (1)

Limits: q = 0 changes nothing; the error is at most q/2. Source: effects.md 1, `quantisation`.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity

NAME = "quantisation"
PLACES = ("output", "input")
SIGNATURE = "few levels"


class Params(NamedTuple):
    q: Annotated[float, Quantity("{y}", "step between levels, Eq (1)", lo=0.0)] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y if p.q <= 0.0 else p.q * math.floor(u.y / p.q + 0.5))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y if p.q <= 0.0 else p.q * math.floor(u.y / p.q + 0.5))  # (1)
