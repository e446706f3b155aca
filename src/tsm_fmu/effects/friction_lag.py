"""Friction follows its steady value with a delay: a loop in F over v.

::

    tau dF_s/dt + F_s = F                                                               (1)

F is taken as linear over the step, which (1) then solves exactly. Limits: tau = 0 changes nothing; at
constant F nothing is left after a few tau. Source: Hess and Soom (J. Tribology 1990); effects.md 1, `friction_lag`.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .lag import lagged

NAME = "friction_lag"
PLACES = ("friction",)
SIGNATURE = "loop in F over v"


class Params(NamedTuple):
    tau: Annotated[float, Quantity("s", "lag of the friction, Eq (1)", lo=0.0)] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    y: Annotated[float, Quantity("{F}", "friction before this effect")]
    f: Annotated[float, Quantity("{F}", "lagged friction")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.y, u.y), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    f = lagged(s.f, s.y, u.y, dt, p.tau)  # (1)
    return State(u.y, f), Outputs(f)
