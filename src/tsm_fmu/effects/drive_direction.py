"""Friction that depends on which side drives: a drive is harder to push back than to push.

::

    F <- F + |k_m tau_m - k_e load| z,    tau_m = load + F                              (1)
    F <- F + k_f |load| z   while the drive moves against the load, load s > 0          (2)
    F <- F + k_b |load| z   while the load drives, load s < 0                           (3)

tau_m is the torque that the drive side sees before this effect: load and friction, in one unit. Limits: all zero
changes nothing; k_f = k_b is friction that grows with the load whichever side drives; k_m = k_e alone is friction that
grows with the friction torque alone.
Source: Duclusaud, Passault, Padois and Ly, Extended Friction Models for the Physics Simulation of Servo Actuators
(2024), load-dependent friction with direction.
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Size

NAME = "drive_direction"
ABOUT = Effect(
    words="friction that depends on which side drives",
    signature="depends on which side drives",
    shown_by="a load that drives one way and brakes the other",
    places=("friction",),
    family="load",
)


class Params(NamedTuple):
    k_m: Annotated[float, Quantity("1", "weight of the drive torque, Eq (1)", lo=0.0), Size()] = 0.0
    k_e: Annotated[float, Quantity("1", "weight of the load, Eq (1)", lo=0.0), Size()] = 0.0
    k_f: Annotated[float, Quantity("1", "friction per load while the drive drives, Eq (2)", lo=0.0), Size()] = 0.0
    k_b: Annotated[float, Quantity("1", "friction per load while the load drives, Eq (3)", lo=0.0), Size()] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    s: Annotated[float, Quantity("1", "direction of the last motion")]
    z: Annotated[float, Quantity("1", "presliding state")]
    load: Annotated[float, Quantity("{F}", "load on the drive, in the unit of the friction: Eq (1) adds them")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def driven(p: Params, u: Inputs) -> float:
    """Right-hand side of Eqs (1) to (3)."""
    side = p.k_f if u.load * u.s > 0.0 else p.k_b
    return u.y + (abs(p.k_m * (u.load + u.y) - p.k_e * u.load) + side * abs(u.load)) * u.z


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(driven(p, u))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(driven(p, u))
