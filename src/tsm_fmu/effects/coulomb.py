"""Dry friction: a step of the force at each reversal.

::

    F <- F + F_c z                                                                      (1)

Limits: F_c = 0 changes nothing; sliding adds F_c against the motion. Dissipative per closed cycle.
Source: Coulomb, with the presliding state of Dahl (1968).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "coulomb"
ABOUT = Effect(
    words="Coulomb friction",
    signature="step at reversal",
    shown_by="strokes with reversals at a speed well above standstill",
    places=("friction",),
    family="direction",
)


class Params(NamedTuple):
    F_c: Annotated[float, Quantity("{F}", "dry friction level, Eq (1)", lo=0.0), Size()] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    z: Annotated[float, Quantity("1", "presliding state")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + p.F_c * u.z)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + p.F_c * u.z)  # (1)
