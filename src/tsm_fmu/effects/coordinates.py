"""The coordinates that effects see: speed, acceleration, direction and presliding state of the input motion.

With dx the travel of the input in one step::

    v  = speed,        first-order filtered difference quotient, or the model's own input
    a  = acceleration, the same of v
    s  = sgn(dx), held while dx = 0                                                     (1)
    z  = s + (z0 - s) exp(-|dx|/x_pre), the Dahl presliding state, |z| <= 1             (2)
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from ..models.laws.lugre import bristle_after
from ..models.laws.signs import held_sign
from ..models.laws.velocity_filter import filtered_slope


class Motion(NamedTuple):
    """State of the coordinates."""

    x: Annotated[float, Quantity("{x}", "input position at the end of the last step")]
    v: Annotated[float, Quantity("{x}/s", "speed")]
    a: Annotated[float, Quantity("{x}/s2", "acceleration")]
    s: Annotated[float, Quantity("1", "direction of the last motion, 0 before any, Eq (1)")]
    z: Annotated[float, Quantity("1", "presliding state, Eq (2)")]


class MotionParams(NamedTuple):
    """Parameters of the coordinates, shared by all effects of a chain."""

    x_pre: Annotated[float, Quantity("{x}", "presliding distance, Eq (2)", lo=0.0, open_lo=True)] = 0.01
    tau_v: Annotated[float, Quantity("s", "time constant of the speed filter", lo=0.0)] = 0.005
    tau_a: Annotated[float, Quantity("s", "time constant of the acceleration filter", lo=0.0)] = 0.02


class Way(NamedTuple):
    """State of an effect on the way that belongs to a speed."""

    x: Annotated[float, Quantity("{x}", "way of the speed before the effect, from the start")]
    lost: Annotated[float, Quantity("{x}", "what the effect has taken of it")]


NAME = "coordinates"
Params = MotionParams
State = Outputs = Motion


class Inputs(NamedTuple):
    """The coordinates of a position are a kernel of their own, for those who only want to look at them."""

    x: Annotated[float, Quantity("{x}", "input position")]


PRESETS = {}


def motion_from_position(m: Motion, x: float, x_pre: float, tau_v: float, tau_a: float, dt: float) -> Motion:
    """Coordinates after the input reached ``x``."""
    v = filtered_slope(m.v, m.x, x, dt, tau_v)
    a = filtered_slope(m.a, m.v, v, dt, tau_a)
    return Motion(x, v, a, held_sign(x - m.x, m.s), bristle_after(m.z, (x - m.x) / x_pre, 1.0, 1.0))  # (1), (2)


def motion_from_speed(m: Motion, v: float, a: float, x_pre: float, dt: float) -> Motion:
    """Coordinates after a step at the measured speed and acceleration."""
    return Motion(m.x + v * dt, v, a, held_sign(v, m.s), bristle_after(m.z, v / x_pre, dt, 1.0))  # (1), (2)


def start(p: MotionParams, u: Inputs) -> tuple[Motion, Motion]:
    m = Motion(u.x, 0.0, 0.0, 0.0, 0.0)
    return m, m


def step(p: MotionParams, s: Motion, u: Inputs, dt: float) -> tuple[Motion, Motion]:
    m = motion_from_position(s, u.x, p.x_pre, p.tau_v, p.tau_a, dt)
    return m, m
