"""Excess friction at low speed that vanishes as the speed grows.

::

    F <- F + dF exp(-|v/v_s|^d) z                                                       (1)

Limits: dF = 0 changes nothing; |v| >> v_s leaves nothing; v -> 0 while sliding gives dF.
Source: Stribeck; Armstrong-Helouvry, Dupont, Canudas de Wit (Automatica 30, 1994).
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "stribeck"
ABOUT = Effect(
    words="Stribeck friction",
    signature="excess at low speed",
    shown_by="slow strokes, from creeping up to a tenth of the usual speed",
    places=("friction",),
    family="speed",
    looks_like=("breakaway_ageing",),
)


class Params(NamedTuple):
    dF: Annotated[float, Quantity("{F}", "excess at zero speed, Eq (1)", lo=0.0), Size()] = 0.0
    v_s: Annotated[
        float, Quantity("{x}/s", "Stribeck speed, Eq (1)", lo=0.0, open_lo=True), Shape("speed", 0.05, 2.0)
    ] = 0.1
    d: Annotated[float, Quantity("1", "Stribeck exponent, Eq (1)", lo=0.2, hi=4.0), Shape("number", 1.0, 4.0)] = 2.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    v: Annotated[float, Quantity("{x}/s", "speed")]
    z: Annotated[float, Quantity("1", "presliding state")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def excess(v: float, v_s: float, d: float) -> float:
    """Share of dF at a speed, Eq (1)."""
    return math.exp(-math.pow(abs(v) / v_s, d))


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + p.dF * excess(u.v, p.v_s, p.d) * u.z)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + p.dF * excess(u.v, p.v_s, p.d) * u.z)  # (1)
