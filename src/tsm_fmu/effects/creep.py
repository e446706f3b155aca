"""Drift at a hold: a spring whose rest point follows.

::

    y <- y + k (x - x_c),   tau dx_c/dt = x - x_c                                       (1)

x is taken as linear over the step, which (1) then solves exactly. Limits: k = 0 changes nothing; fast motion
sees a spring k, a long hold none. Source: Maxwell element; effects.md 1, `creep`.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .lag import lagged

NAME = "creep"
PLACES = ("friction", "output")
MOTION_ONLY = True  # among outputs, it makes sense on a position
SIGNATURE = "drift at hold"


class Params(NamedTuple):
    k: Annotated[float, Quantity("{y}/({x})", "relaxing stiffness, Eq (1)")] = 0.0
    tau: Annotated[float, Quantity("s", "relaxation time, Eq (1)", lo=0.0, open_lo=True)] = 1.0


NEUTRAL = Params()


class State(NamedTuple):
    x: Annotated[float, Quantity("{x}", "input position")]
    x_c: Annotated[float, Quantity("{x}", "rest point")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x, u.x), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    x_c = lagged(s.x_c, s.x, u.x, dt, p.tau)
    return State(u.x, x_c), Outputs(u.y + p.k * (u.x - x_c))  # (1)
