"""The coordinates of coordinates.py where the model's input is the speed ``v``, with its acceleration or without.

a  = the input, or the filtered difference quotient of v
s, z as in coordinates.py, of the travel v dt
"""

from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from ..models.laws.velocity_filter import filtered_slope
from .coordinates import Motion, motion_from_speed

NAME = "coordinates_of_speed"
State = Outputs = Motion


class Params(NamedTuple):
    x_pre: Annotated[float, Quantity("{x}", "presliding distance", lo=0.0, open_lo=True)] = 0.01
    tau_a: Annotated[float, Quantity("s", "time constant of the acceleration filter", lo=0.0)] = 0.02
    measured: Annotated[int, Quantity("1", "1: the acceleration is an input, 0: filtered", lo=0, hi=1)] = 0


class Inputs(NamedTuple):
    v: Annotated[float, Quantity("{x}/s", "speed")]
    a: Annotated[float, Quantity("{x}/s2", "acceleration, where it is measured")]


PRESETS = {}


def start(p: Params, u: Inputs) -> tuple[Motion, Motion]:
    m = Motion(0.0, u.v, 0.0, 0.0, 0.0)
    return m, m


def step(p: Params, s: Motion, u: Inputs, dt: float) -> tuple[Motion, Motion]:
    a = u.a
    if p.measured == 0:
        a = filtered_slope(s.a, s.v, u.v, dt, p.tau_a)
    m = motion_from_speed(s, u.v, a, p.x_pre, dt)
    return m, m
