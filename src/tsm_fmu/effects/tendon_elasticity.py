"""Lost motion proportional to the tension: the tendon stretches under its load.

::

    y <- y - C load - C_d drive - t sgn(load) (1 - exp(-|load|/T_t))                    (1)

x_e = x - T/k with the tension of both ends: C = 1/k at the load's end and C_d at the drive's, between which the
sheath's friction lies. The stretch is the integral of the tension along the tendon (with the tension falling evenly,
C = C_d = 1/2k). Written with compliances so that 0 changes nothing. A stranded tendon is soft until its strands have
settled: t is how far it gives beyond the straight line, T_t the load by which they have.
Limits: C = C_d = 0 is a rigid tendon; C_d = 0 has no hysteresis of its own.
Source: Hooke; Costello, Theory of Wire Rope (1997), for the toe; AME 2020 Eqs (20)-(24).
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "tendon_elasticity"
ABOUT = Effect(
    words="tendon elasticity",
    signature="lost motion proportional to tension",
    shown_by="the same motion under several tensions or loads",
    places=("output",),
    family="load",
    looks_like=("nonlocal_memory", "backlash", "slack"),
    motion_only=True,
)


class Params(NamedTuple):
    compliance: Annotated[float, Quantity("{y}/({load})", "lost motion per load, Eq (1)", lo=0.0), Size(first=1e-3)] = (
        0.0
    )
    compliance_drive: Annotated[
        float, Quantity("{y}/({F})", "lost motion per load at the drive side, Eq (1)", lo=0.0), Size()
    ] = 0.0
    toe: Annotated[
        float, Quantity("{y}", "stretch before its strands have settled, t of Eq (1)", lo=0.0), Size(first=1e-3)
    ] = 0.0
    # a load that is reached within the runs, and no small part of it: what that takes up is slack
    T_t: Annotated[
        float, Quantity("{load}", "load by which they have, Eq (1)", lo=0.0, open_lo=True), Shape("load", 0.2, 1.0)
    ] = 1.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "motion before this effect")]
    load: Annotated[float, Quantity("{load}", "load on the drive")]
    drive: Annotated[float, Quantity("{F}", "load or tension at the drive side")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "motion with this effect")]


PRESETS = {}


def stretch(p: Params, u: Inputs) -> float:
    """What Eq (1) takes away."""
    toe = math.copysign(-p.toe * math.expm1(-abs(u.load) / p.T_t), u.load)
    return p.compliance * u.load + p.compliance_drive * u.drive + toe


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y - stretch(p, u))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y - stretch(p, u))
