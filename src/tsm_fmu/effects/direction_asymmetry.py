"""Friction differs between the two directions.

::

    F <- F (1 + eps s) + df_v |v|                                                       (1)

eps makes the level differ, df_v the slope over the speed: half of what the viscous coefficients of the two directions
differ by. Limits: eps = df_v = 0 changes nothing; eps = 1 leaves no friction in release. Dissipative for |eps| <= 1
where F is, and |df_v| at most the viscous coefficient.
Source: Armstrong-Helouvry, Control of Machines with Friction (1991).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "direction_asymmetry"
ABOUT = Effect(
    words="friction that differs between directions",
    words_on_motion="lost motion that differs between directions",
    signature="F(+) differs from F(-)",
    shown_by="half strokes both ways at several speeds, zero known",
    places=("friction", "lost motion"),
    family="direction",
    looks_like=("offset_drift",),
)


class Params(NamedTuple):
    eps: Annotated[float, Quantity("1", "relative difference, Eq (1)", lo=-1.0, hi=1.0), Size(first=1e-3)] = 0.0
    df_v: Annotated[
        float, Quantity("{F}/({x}/s)", "half the difference of the viscous coefficients, Eq (1)"), Size()
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    v: Annotated[float, Quantity("{x}/s", "speed")]
    s: Annotated[float, Quantity("1", "direction of the last motion")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y * (1.0 + p.eps * u.s) + p.df_v * abs(u.v))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y * (1.0 + p.eps * u.s) + p.df_v * abs(u.v))  # (1)
