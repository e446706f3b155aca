"""The accelerating and the decelerating branch of the friction differ.

The difference that the papers' branch functions share (MMT 2015 Eq (8), ICINCO 2013 Eq (2b))::

    g = dF (1 - exp(-|a|/a_0)) s        while speeding up (s a > 0)                     (1)
    g = -b dF (1 - exp(-|a|/a_0)) s     while slowing down                              (2)
    F <- F + d,   dd/dx = (g - d)/x_pre sgn(dx)                                         (3)

with dF = dF_p for pull (s > 0) and dF_n for release; a negative value is a lower accelerating branch. b says how the
two branches lie about the friction of steady motion: 0 where only the accelerating one leaves it, 1 on either side.
The bristles carry the difference: like the friction itself it changes over the presliding distance x_pre, after a
reversal (there it is the presliding state times the branch) and where one branch gives way to the other.
Limits: dF_p = dF_n = 0 changes nothing; a -> 0 closes the branches; x_pre -> 0 makes them follow a at once.
Source: IFToMM 2013, ICINCO 2013 and MMT 2015, in what their branch functions have in common; (3) is that of the
presliding state, Dahl, A Solid Friction Model (1968).
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
    x: Annotated[float, Quantity("{x}", "position at the end of the last step")]
    d: Annotated[float, Quantity("{F}", "difference that the bristles carry, Eq (3)")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    a: Annotated[float, Quantity("{x}/s2", "acceleration")]
    s: Annotated[float, Quantity("1", "direction of the last motion")]
    x: Annotated[float, Quantity("{x}", "position")]
    x_pre: Annotated[float, Quantity("{x}", "presliding distance")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def branch_difference(p: Params, a: float, s: float) -> float:
    """Difference of steady motion at an acceleration and a direction."""
    side = s if s * a > 0.0 else -p.b * s
    return side * (p.dF_p if s > 0.0 else p.dF_n) * (1.0 - math.exp(-abs(a) / p.a_0))  # (1), (2)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x, 0.0), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    g = branch_difference(p, u.a, u.s)
    d = g + (s.d - g) * math.exp(-abs(u.x - s.x) / u.x_pre)  # (3)
    return State(u.x, d), Outputs(u.y + d)
