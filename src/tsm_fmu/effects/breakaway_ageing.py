"""The first peak after a hold grows with the logarithm of the hold.

::

    dtheta/dt = 1 - |v| theta/D_c                                                       (1)
    F <- F + B ln(1 + theta/theta_0) z                                                  (2)

Eq (1) is solved exactly at constant |v|: theta = D_c/|v| + (theta_0 - D_c/|v|) exp(-|v| dt/D_c).
Limits: B = 0 changes nothing; sliding at v settles at theta = D_c/|v| (velocity weakening); at rest theta
grows with time. Source: Dieterich-Ruina ageing law; effects.md 1, `breakaway_ageing`.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity

NAME = "breakaway_ageing"
PLACES = ("friction",)
SIGNATURE = "first peak grows with log of the hold"


class Params(NamedTuple):
    B: Annotated[float, Quantity("{F}", "strengthening per e-fold of contact time, Eq (2)", lo=0.0)] = 0.0
    D_c: Annotated[float, Quantity("{x}", "travel that renews the contacts, Eq (1)", lo=0.0, open_lo=True)] = 0.01
    theta_0: Annotated[float, Quantity("s", "contact time scale, Eq (2)", lo=0.0, open_lo=True)] = 0.1


NEUTRAL = Params()


class State(NamedTuple):
    x: Annotated[float, Quantity("{x}", "input position")]
    theta: Annotated[float, Quantity("s", "age of the contacts, Eq (1)")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]
    z: Annotated[float, Quantity("1", "presliding state")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x, 0.0), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    worn = abs(u.x - s.x) / p.D_c
    theta = s.theta * math.exp(-worn) + dt * (1.0 if worn < 1e-12 else -math.expm1(-worn) / worn)  # (1)
    return State(u.x, theta), Outputs(u.y + p.B * math.log1p(theta / p.theta_0) * u.z)  # (2)
