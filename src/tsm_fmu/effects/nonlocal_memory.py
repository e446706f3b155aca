"""Nested loops close: several slip elements remember several reversals.

Maxwell slip: three elements, each sliding after its own travel x_i::

    z_i = clip(z_i + dx/x_i, -1, 1),   F <- F + sum F_i z_i                             (1)

Limits: F_i = 0 changes nothing; one element is elastic-perfectly-plastic; monotone travel beyond the
largest x_i adds the sum of F_i. Dissipative per closed cycle, with return-point memory.
Source: Iwan (1966); Al-Bender, Lampaert, Swevers (2005).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "nonlocal_memory"
ABOUT = Effect(
    words="hysteresis with non-local memory",
    signature="nested loops close",
    shown_by="nested reversals: small strokes in large ones",
    places=("friction",),
    family="history",
    looks_like=("presliding_shape", "tendon_elasticity"),
    after_reversal=True,
)


class Params(NamedTuple):
    F_1: Annotated[float, Quantity("{F}", "strength of element 1, Eq (1)", lo=0.0), Size()] = 0.0
    F_2: Annotated[float, Quantity("{F}", "strength of element 2, Eq (1)", lo=0.0), Size()] = 0.0
    F_3: Annotated[float, Quantity("{F}", "strength of element 3, Eq (1)", lo=0.0), Size()] = 0.0
    x_1: Annotated[
        float,
        Quantity("{x}", "travel at which element 1 slides, Eq (1)", lo=0.0, open_lo=True),
        Shape("stroke", 0.0032, 0.5),
    ] = 0.01
    x_2: Annotated[
        float,
        Quantity("{x}", "travel at which element 2 slides, Eq (1)", lo=0.0, open_lo=True),
        Shape("stroke", 0.0032, 0.5),
    ] = 0.04
    x_3: Annotated[
        float,
        Quantity("{x}", "travel at which element 3 slides, Eq (1)", lo=0.0, open_lo=True),
        Shape("stroke", 0.0032, 0.5),
    ] = 0.16


NEUTRAL = Params()


class State(NamedTuple):
    x: Annotated[float, Quantity("{x}", "input position")]
    z_1: Annotated[float, Quantity("1", "state of element 1")]
    z_2: Annotated[float, Quantity("1", "state of element 2")]
    z_3: Annotated[float, Quantity("1", "state of element 3")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def clipped(z: float) -> float:
    """State of a slip element, kept within [-1, 1]."""
    return min(1.0, max(-1.0, z))


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x, 0.0, 0.0, 0.0), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    dx = u.x - s.x
    z_1 = clipped(s.z_1 + dx / p.x_1)
    z_2 = clipped(s.z_2 + dx / p.x_2)
    z_3 = clipped(s.z_3 + dx / p.x_3)
    return State(u.x, z_1, z_2, z_3), Outputs(u.y + p.F_1 * z_1 + p.F_2 * z_2 + p.F_3 * z_3)  # (1)
