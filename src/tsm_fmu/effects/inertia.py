"""A mass that the model does not have.

::

    F <- F + m a                                                                        (1)

Limits: m = 0 changes nothing. Takes no energy over a closed cycle. Source: Newton.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "inertia"
ABOUT = Effect(
    words="inertia",
    signature="in phase with a",
    shown_by="one stroke at two frequencies or more, the fastest with high acceleration",
    places=("friction",),
    family="acceleration",
    looks_like=("stiffness_hardening", "creep"),
)


class Params(NamedTuple):
    m: Annotated[float, Quantity("{F}/({x}/s2)", "moved mass or inertia, Eq (1)", lo=0.0), Size()] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    a: Annotated[float, Quantity("{x}/s2", "acceleration")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + p.m * u.a)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + p.m * u.a)  # (1)
