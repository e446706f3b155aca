"""Friction that changes with the sheath's bending angle, measured as an input of the chain, Theta where no other
column is named.

::

    F <- F + mu (exp(mu_c Theta) - 1)/mu_c (|load| + T_0) z                             (1)

T_0 is the tension that is there without the load: that of a pretensioned tendon, which presses on a bend all the same.
Where neither the model nor a column of the log has the load, it is taken as constant, 1: with 1 + T_0.
mu_c bends the law: a tendon that is pulled over the whole of a sheath has mu_c = mu, the capstan's equation; one whose
tension hardly falls along it, a lost motion or a channel in other units has them apart.
Limits: mu = 0 or a straight sheath changes nothing; mu_c = 0 is mu Theta (|load| + T_0) z, and with it a constant Theta
is `load_dependence` with k = mu Theta. Source: capstan law; AME 2020 Eqs (14)-(16).
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "bend_angle"
ABOUT = Effect(
    words="bend-dependent friction",
    words_on_motion="lost motion that grows with the sheath's bend",
    signature="changes with sheath angle",
    shown_by="the same motion at several sheath angles, Theta recorded",
    places=("friction", "lost motion"),
    family="load",
    optional=("load",),
)


class Params(NamedTuple):
    mu: Annotated[float, Quantity("{F}/({load}.{bend})", "friction coefficient, Eq (1)", lo=0.0), Size()] = 0.0
    T_0: Annotated[float, Quantity("{load}", "tension without the load, Eq (1)", lo=0.0), Shape("load", 0.1, 10.0)] = (
        0.0
    )
    mu_c: Annotated[
        float,
        Quantity("1/{bend}", "friction coefficient in the exponent, Eq (1)", lo=0.0, hi=2.0),
        Shape("number", 0.05, 1.0),
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    z: Annotated[float, Quantity("1", "presliding state")]
    load: Annotated[float, Quantity("{load}", "load on the drive")]
    bend: Annotated[float, Quantity("{bend}", "sheath angle")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(_bent(p, u))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(_bent(p, u))


def _bent(p: Params, u: Inputs) -> float:
    turned = math.expm1(p.mu_c * u.bend) / p.mu_c if p.mu_c > 0.0 else u.bend
    return u.y + p.mu * turned * (abs(u.load) + p.T_0) * u.z  # (1)
