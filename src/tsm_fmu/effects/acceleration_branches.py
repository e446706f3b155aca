"""The accelerating and the decelerating branch of the friction differ.

The difference that the papers' branch functions share (MMT 2015 Eq (8), ICINCO 2013 Eq (2b))::

    F <- F + dF (1 - exp(-|a|/a_0)) z     while speeding up (s a > 0)                   (1)
    F <- F - b dF (1 - exp(-|a|/a_0)) z   while slowing down                            (2)

with dF = dF_p for pull (s > 0) and dF_n for release; a negative value is a lower accelerating branch. b says how the
two branches lie about the friction of steady motion: 0 where only the accelerating one leaves it, 1 on either side.
Limits: dF_p = dF_n = 0 changes nothing; a -> 0 closes the branches, so the force is continuous in a.
Source: IFToMM 2013, ICINCO 2013 and MMT 2015, in what their branch functions have in common.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "acceleration_branches"
ABOUT = Effect(
    words="branches of friction for acceleration and deceleration",
    signature="accelerating and decelerating branch differ",
    shown_by="the same speeds reached speeding up and slowing down: sines of two frequencies over one stroke",
    places=("friction",),
    family="acceleration",
)


class Params(NamedTuple):
    dF_p: Annotated[float, Quantity("{F}", "difference of the branches in pull, Eq (1)"), Size()] = 0.0
    dF_n: Annotated[float, Quantity("{F}", "difference of the branches in release, Eq (1)"), Size()] = 0.0
    a_0: Annotated[
        float,
        Quantity("{x}/s2", "acceleration at which the branches have parted, Eq (1)", lo=0.0, open_lo=True),
        Shape("acceleration", 0.1, 3.2),
    ] = 1.0
    b: Annotated[
        float, Quantity("1", "decelerating branch over the accelerating one, Eq (2)", lo=0.0, hi=1.0),
        Shape("share", 0.0, 1.0),
    ] = 0.0  # fmt: skip


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    a: Annotated[float, Quantity("{x}/s2", "acceleration")]
    s: Annotated[float, Quantity("1", "direction of the last motion")]
    z: Annotated[float, Quantity("1", "presliding state")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def branch_difference(p: Params, a: float, s: float) -> float:
    """What Eqs (1) and (2) multiply the presliding state by."""
    side = 1.0 if s * a > 0.0 else -p.b
    return side * (p.dF_p if s > 0.0 else p.dF_n) * (1.0 - math.exp(-abs(a) / p.a_0))


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + branch_difference(p, u.a, u.s) * u.z)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + branch_difference(p, u.a, u.s) * u.z)  # (1)
