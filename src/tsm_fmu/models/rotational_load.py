"""Passive rotational load at the distal joint: spring, damper, pendulum and a one-sided contact.

Elementary mechanics (no paper; MSSP 2015, Section 4, uses a second motor as the "environment load"
and prints no numbers for it)::

    tau = k (phi - phi_0) + d v + m g r sin(phi) + k_contact max(0, phi - phi_contact)  (1)
    tau_v dv/dt = dphi/dt - v                                                           (2)

tau > 0 opposes motion to positive phi. phi = 0 is where the mass hangs straight down. The contact is
a stop on the positive side alone: it pushes back beyond phi_contact and never pulls. The
torque has no inertia: an inertia here would close an algebraic loop through a coupling, so it belongs
in J_load of the motor. v is the exact response of (2) to a position that moves on a straight
line within each step, and starts at 0.

Validity: quasi-static load; with k_contact the step has to resolve the contact of the loop around it.
"""

import math
from typing import Annotated, NamedTuple

from .contract import Preset, Quantity
from .laws.velocity_filter import filtered_slope

NAME = "RotationalLoad"

STANDARD_GRAVITY = 9.80665  # [m/s2]


class Params(NamedTuple):
    k: Annotated[float, Quantity("N.m/rad", "spring stiffness, Eq (1); assumed", lo=0.0)] = 0.1
    d: Annotated[float, Quantity("N.m.s/rad", "viscous damping, Eq (1); assumed", lo=0.0)] = 0.001
    phi_0: Annotated[float, Quantity("rad", "angle at which the spring is relaxed, Eq (1)", display="deg")] = 0.0
    tau_v: Annotated[float, Quantity("s", "time constant of the velocity filter, Eq (2); assumed", lo=0.0)] = 0.005
    m: Annotated[float, Quantity("kg", "mass of the pendulum, Eq (1); 0 is none", lo=0.0)] = 0.0
    r: Annotated[float, Quantity("m", "distance from the axis to the mass, Eq (1); assumed", lo=0.0, display="mm")] = (
        0.025
    )
    k_contact: Annotated[float, Quantity("N.m/rad", "contact stiffness, Eq (1); 0 is no contact", lo=0.0)] = 0.0
    phi_contact: Annotated[
        float, Quantity("rad", "angle at which contact begins, from below, Eq (1)", display="deg")
    ] = 0.0


class State(NamedTuple):
    phi: Annotated[float, Quantity("rad", "angle at the end of the last step")]
    v: Annotated[float, Quantity("rad/s", "filtered speed, Eq (2)")]


class Inputs(NamedTuple):
    phi: Annotated[float, Quantity("rad", "angle of the load", display="deg")]


class Outputs(NamedTuple):
    tau: Annotated[float, Quantity("N.m", "torque that the load takes, Eq (1)")]


PRESETS = {
    "spring": Preset(
        source="assumed: a light passive load, about 0.1 N.m at 60 deg (MSSP 2015 prints none)",
        printed={"k": (0.1, "N.m/rad"), "d": (0.001, "N.m.s/rad"), "tau_v": (5.0, "ms")},
        si={},
    ),
    "stop": Preset(
        source="assumed: the light spring, and tissue-like contact from 40 deg on",
        printed={"k_contact": (2.0, "N.m/rad"), "phi_contact": (40.0, "deg")},
        si={"k_contact": 2.0, "phi_contact": 0.6981317007977318},
    ),
}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.phi, 0.0), Outputs(_torque(p, u.phi, 0.0))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    v = filtered_slope(s.v, s.phi, u.phi, dt, p.tau_v)  # (2)
    return State(u.phi, v), Outputs(_torque(p, u.phi, v))


def _torque(p: Params, phi: float, v: float) -> float:
    tau = p.k * (phi - p.phi_0) + p.d * v + p.m * STANDARD_GRAVITY * p.r * math.sin(phi)  # (1)
    if phi > p.phi_contact:
        tau += p.k_contact * (phi - p.phi_contact)
    return tau
