"""Drift at a hold: a spring whose rest point follows.

::

    y <- y + k (x - x_c),   tau dx_c/dt = x - x_c                                       (1)

x is taken as linear over the step, which (1) then solves exactly. Limits: k = 0 changes nothing; fast motion
sees a spring k, a long hold none. Source: Maxwell element (a spring and a damper in series).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size
from .lag import lagged

NAME = "creep"
ABOUT = Effect(
    words="creep",
    signature="drift at hold",
    shown_by="steps of load or position, held for several times the time constant",
    places=("friction", "output"),
    family="history",
    looks_like=("inertia", "stiffness_hardening"),
    motion_only=True,
)


class Params(NamedTuple):
    k: Annotated[float, Quantity("{y}/({x})", "relaxing stiffness, Eq (1)"), Size(first=1e-3)] = 0.0
    tau: Annotated[
        float, Quantity("s", "relaxation time, Eq (1)", lo=0.0, open_lo=True), Shape("time", 0.0032, 1.0)
    ] = 1.0


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
