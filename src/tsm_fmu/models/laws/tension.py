"""What a single-tendon friction force does to the tensions at its two ends.

::

    F = T_in - T_out                                                    (MMT 2015 Eq (1))

F > 0 opposes v > 0 (pull). Read from the measured proximal side this estimates the distal tension, read
from the load side it gives the tension that the drive must supply. T_out may become negative: a slack
tendon is an effect of its own. ICINCO 2013 Eq (1) prints T_in + T_out + F = 0, which holds for signed
axial forces only.
"""

from typing import Annotated, Any, NamedTuple

from ..contract import FrictionPort, Quantity

MeasuredTension = Annotated[float, Quantity("N", "measured proximal tension")]
LoadTension = Annotated[float, Quantity("N", "distal tension that the load asks for")]


class Inputs(NamedTuple):
    v: Annotated[float, Quantity("m/s", "proximal tendon velocity, pull positive", display="mm/s")]
    a: Annotated[float, Quantity("m/s2", "proximal tendon acceleration", display="mm/s2")]
    T_in: MeasuredTension
    T_load: LoadTension


class Outputs(NamedTuple):
    F: Annotated[float, Quantity("N", "friction force, positive against pull")]
    T_out: Annotated[float, Quantity("N", "estimated distal tension, T_in - F; not clipped at 0")]
    T_drive: Annotated[float, Quantity("N", "tension the drive must supply, T_load + F")]
    P_loss: Annotated[float, Quantity("W", "power taken from the motion, presliding energy included")]


# The friction force is a state: it follows the speed over a step, not at once.
DEPENDS = {"F": (), "T_out": ("T_in",), "T_drive": ("T_load",), "P_loss": ("v",)}


def tensions(force: float, speed: float, T_in: float, T_load: float) -> Outputs:
    """Outputs at friction ``force`` [N] and tendon ``speed`` [m/s]."""
    return Outputs(force, T_in - force, T_load + force, force * speed)


def friction_in(p: Any, u: Inputs, o: Outputs) -> float:
    """Friction in the outputs, for the effects that change it."""
    return o.F


def with_friction(p: Any, u: Inputs, o: Outputs, f: float) -> Outputs:
    """The outputs with friction ``f`` instead."""
    return tensions(f, u.v, u.T_in, u.T_load)


FRICTION = FrictionPort("F", friction_in, with_friction)
