"""Few levels: an encoder or a coarse converter.

::

    y <- y_0 + q floor((y - y_0)/q + 1/2)                                               (1)

y_0 is one of the levels: zero for a converter that rounds, q/2 for one that truncates. Limits: q = 0 changes nothing;
the error is at most q/2. Source: Widrow and Kollar, Quantization Noise (2008).
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Read, Size

NAME = "quantisation"
ABOUT = Effect(
    words="quantisation",
    signature="few levels",
    shown_by="slow motion over a few steps of the sensor",
    places=("output", "input"),
    family="sensor",
    role="read",
)


class Params(NamedTuple):
    q: Annotated[float, Quantity("{y}", "step between levels, Eq (1)", lo=0.0), Size()] = 0.0
    y_0: Annotated[float, Quantity("{y}", "one of the levels, Eq (1)"), Read()] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def level(p: Params, y: float) -> float:
    """Nearest level, Eq (1)."""
    return y if p.q <= 0.0 else p.y_0 + p.q * math.floor((y - p.y_0) / p.q + 0.5)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(level(p, u.y))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(level(p, u.y))
