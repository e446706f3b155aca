"""Lost motion with a rounded flat: the Coleman-Hodgdon loop.

::

    y <- y + h,   dh/dt = beta dy/dt - alpha |dy/dt| h                                  (1)

Exact per monotone segment (models/coleman_hodgdon.py). Limits: beta = 0 changes nothing; the lost motion
of a long stroke is 2 |beta|/alpha at any speed. Source: MSSP 2015 Eqs (8)-(10).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from ..models.laws.coleman_hodgdon import hysteresis_after
from .about import Effect, Shape, Size

NAME = "smooth_backlash"
ABOUT = Effect(
    words="rounded backlash",
    signature="rounded flat",
    shown_by="slow strokes wider than the gap, reversals finely sampled",
    places=("output", "input"),
    family="history",
    looks_like=("backlash",),
    play=True,
    motion_only=True,
)


class Params(NamedTuple):
    beta: Annotated[float, Quantity("1", "slope change at a reversal, Eq (1)", lo=-1.0, hi=0.0), Size(first=-1e-2)] = (
        0.0
    )
    alpha: Annotated[
        float,
        Quantity("1/({y})", "inverse of the travel that forgets a reversal, Eq (1)", lo=0.0, open_lo=True),
        Shape("per stroke", 1.0, 100.0),
    ] = 10.0


NEUTRAL = Params()


class State(NamedTuple):
    y: Annotated[float, Quantity("{y}", "signal before this effect")]
    h: Annotated[float, Quantity("{y}", "hysteresis part")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.y, 0.0), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    h = hysteresis_after(s.h, u.y - s.y, p.beta, p.alpha)  # (1)
    return State(u.y, h), Outputs(u.y + h)
