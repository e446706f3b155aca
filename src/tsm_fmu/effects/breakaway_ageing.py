"""The first peak after a hold grows with the logarithm of the hold.

The strength of the contacts ages at rest and is renewed by travel; friction follows it as the presliding spring does,
over the presliding distance x_pre. A spring keeps its force while nothing moves, so a hold shows afterwards; rest is
the share that shows at the hold itself, as where friction is taken for its limit::

    dtheta/dt = 1 - |v| theta/D_c,   g = ln(1 + theta/theta_0)                          (1)
    db/dx = (g s - b)/x_pre                                                             (2)
    F <- F + B ((1 - rest) b + rest g z)                                                (3)

Eq (1) is solved exactly at constant |v|: theta = D_c/|v| + (theta(0) - D_c/|v|) exp(-|v| dt/D_c); Eq (2) with the g
of the end of the step. Limits: B = 0 changes nothing; sliding at v settles at B ln(1 + D_c/(|v| theta_0)) (velocity
weakening); b does not change at rest; rest = 1 is B ln(1 + theta/theta_0) z, friction at its limit.
Source: Dieterich (J. Geophys. Res. 84, 1979) and Ruina (J. Geophys. Res. 88, 1983), ageing law.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from ..models.laws.lugre import bristle_after
from .about import Effect, Shape, Size

NAME = "breakaway_ageing"
ABOUT = Effect(
    words="break-away that grows with rest",
    signature="first peak grows with log of the hold",
    shown_by="slide, hold 0.1 s to 30 s, slide again",
    places=("friction",),
    family="history",
    looks_like=("stribeck",),
    among_functions=True,
)


class Params(NamedTuple):
    B: Annotated[
        float, Quantity("{F}", "strengthening per e-fold of contact time, Eq (3)", lo=0.0), Size(most_of_signal=1.0)
    ] = 0.0
    D_c: Annotated[
        float,
        Quantity("{x}", "travel that renews the contacts, Eq (1)", lo=0.0, open_lo=True),
        Shape("stroke", 0.0032, 0.5),
    ] = 0.01
    theta_0: Annotated[
        float, Quantity("s", "contact time scale, Eq (1)", lo=0.0, open_lo=True), Shape("time", 0.0032, 1.0)
    ] = 0.1
    rest: Annotated[
        float, Quantity("1", "share that shows at rest, Eq (3)", lo=0.0, hi=1.0), Shape("number", 0.1, 1.0)
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    x: Annotated[float, Quantity("{x}", "input position")]
    theta: Annotated[float, Quantity("s", "age of the contacts, Eq (1)")]
    b: Annotated[float, Quantity("1", "strengthening of the presliding spring, Eq (2)")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]
    z: Annotated[float, Quantity("1", "presliding state")]
    x_pre: Annotated[float, Quantity("{x}", "presliding distance")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x, 0.0, 0.0), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    dx = u.x - s.x
    worn = abs(dx) / p.D_c
    theta = s.theta * math.exp(-worn) + dt * (1.0 if worn < 1e-12 else -math.expm1(-worn) / worn)  # (1)
    g = math.log1p(theta / p.theta_0)
    b = bristle_after(s.b, dx * g / u.x_pre, 1.0, g)  # (2)
    return State(u.x, theta, b), Outputs(u.y + p.B * ((1.0 - p.rest) * b + p.rest * g * u.z))  # (3)
