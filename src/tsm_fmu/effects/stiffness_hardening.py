"""A restoring force that stiffens with the deflection.

::

    F <- F + k_1 d + k_3 d^3,   d = x - x_c                                             (1)

Limits: k_1 = k_3 = 0 changes nothing; k_3 = 0 is a linear spring. Takes no energy over a closed cycle. About a position
far from the middle of the stroke it is any bend of the position's law, as a cam or a weight makes, and is not named.
Source: Duffing (1918).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "stiffness_hardening"
ABOUT = Effect(
    words="stiffening",
    words_on_motion="a ratio that bends over the position",
    signature="cubic",
    shown_by="strokes or loads up to the largest that the rig allows",
    places=("friction", "lost motion"),
    family="position",
    looks_like=("inertia", "creep", "drum_periodic"),
)


class Params(NamedTuple):
    k_1: Annotated[float, Quantity("{F}/({x})", "linear stiffness, Eq (1)"), Size()] = 0.0
    k_3: Annotated[float, Quantity("{F}/({x}3)", "cubic stiffness, Eq (1)"), Size()] = 0.0
    x_c: Annotated[float, Quantity("{x}", "position without force, Eq (1)"), Shape("centre", 0.0, 1.0)] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + (p.k_1 + p.k_3 * (u.x - p.x_c) * (u.x - p.x_c)) * (u.x - p.x_c))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + (p.k_1 + p.k_3 * (u.x - p.x_c) * (u.x - p.x_c)) * (u.x - p.x_c))  # (1)
