"""Friction that grows with the load: the linear form of the capstan law.

T_out = T_in exp(-mu Theta z) gives F = T_in - T_out; with the bend angle held, what a drive with
pretension shows at its input is, to first order in the load::

    F <- F + k max(0, |load| - l_0) z                                                   (1)

l_0 is a load up to which nothing more is pressed on than by the pretension.

Limits: k = 0 changes nothing; z = +-1 (sliding) adds a constant share of the load to the friction.
Dissipative for k >= 0: the added force has the sign of the motion once presliding is over.
Source: Euler-Eytelwein; Agrawal, Peine, Yao (IEEE T-RO 2010).
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "load_dependence"
ABOUT = Effect(
    words="load-dependent friction",
    words_on_motion="lost motion that grows with the load",
    signature="friction grows with tension or load",
    shown_by="the same motion under three loads or more, recorded",
    places=("friction", "lost motion"),
    family="load",
    looks_like=("thermal", "wear"),
)


class Params(NamedTuple):
    k: Annotated[float, Quantity("{F}/({load})", "friction per load, Eq (1)", lo=0.0), Size(first=1e-3)] = 0.0
    l_0: Annotated[
        float, Quantity("{load}", "load from which on it grows, Eq (1)", lo=0.0), Shape("load", 0.02, 0.9)
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "friction before this effect")]
    z: Annotated[float, Quantity("1", "presliding state")]
    load: Annotated[float, Quantity("{load}", "load on the drive")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "friction with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + p.k * max(0.0, abs(u.load) - p.l_0) * u.z)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + p.k * max(0.0, abs(u.load) - p.l_0) * u.z)  # (1)
