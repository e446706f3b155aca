"""Harmonics of the drum angle: runout, an eccentric pulley, a bent shaft.

::

    h = sum_k C_k cos(k x/r) + S_k sin(k x/r),   k = 1, 2, 3                            (1)
    y <- y + (1 - drag + drag z) h                                                      (2)

drag is the part that brakes: a drum that rubs more at one angle (drag = 1) acts against the motion, an eccentric pulley
(drag = 0) pulls either way. r is the input position per radian of the drum (1 where the input is the drum's angle); a
gear or a wheel of unknown size is found by a search over the periods that the stroke could hold. Limits: all
C_k = S_k = 0 changes nothing. A_k = hypot(C_k, S_k), phi_k = atan2(-S_k, C_k) give the form A_k cos(k theta + phi_k).
Source: geometry of an eccentric pulley (k = 1); Fourier series of any other law of the angle.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "drum_periodic"
ABOUT = Effect(
    words="a ripple of the drum angle",
    signature="harmonics of the drum angle",
    shown_by="several turns of the drum, started at different angles",
    places=("friction", "output", "input"),
    family="position",
    looks_like=("stiffness_hardening",),
    turns=1.25,
)


class Params(NamedTuple):
    C_1: Annotated[float, Quantity("{y}", "cosine amplitude of harmonic 1, Eq (1)"), Size()] = 0.0
    S_1: Annotated[float, Quantity("{y}", "sine amplitude of harmonic 1, Eq (1)"), Size()] = 0.0
    C_2: Annotated[float, Quantity("{y}", "cosine amplitude of harmonic 2, Eq (1)"), Size()] = 0.0
    S_2: Annotated[float, Quantity("{y}", "sine amplitude of harmonic 2, Eq (1)"), Size()] = 0.0
    C_3: Annotated[float, Quantity("{y}", "cosine amplitude of harmonic 3, Eq (1)"), Size()] = 0.0
    S_3: Annotated[float, Quantity("{y}", "sine amplitude of harmonic 3, Eq (1)"), Size()] = 0.0
    r: Annotated[
        float,
        Quantity("{x}/rad", "input position per radian of the drum, Eq (1)", lo=0.0, open_lo=True),
        Shape("turns", 1.5, 12.0, tries=192),  # of fewer turns it is any smooth function of the position
    ] = 1.0
    drag: Annotated[
        float, Quantity("1", "part that acts against the motion, Eq (2)", lo=0.0, hi=1.0), Shape("share", 0.0, 1.0)
    ] = 0.0


NEUTRAL = Params()


class State(NamedTuple):
    pass


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]
    z: Annotated[float, Quantity("1", "presliding state")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{y}", "the same with this effect")]


PRESETS = {}


def harmonics(p: Params, theta: float) -> float:
    """Sum of Eq (1) at the drum angle ``theta``; the second and third harmonic from the first by angle addition."""
    c_1, s_1 = math.cos(theta), math.sin(theta)
    c_2, s_2 = c_1 * c_1 - s_1 * s_1, 2.0 * s_1 * c_1
    c_3, s_3 = c_1 * c_2 - s_1 * s_2, s_1 * c_2 + c_1 * s_2
    return p.C_1 * c_1 + p.S_1 * s_1 + p.C_2 * c_2 + p.S_2 * s_2 + p.C_3 * c_3 + p.S_3 * s_3


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(), Outputs(u.y + (1.0 - p.drag + p.drag * u.z) * harmonics(p, u.x / p.r))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return s, Outputs(u.y + (1.0 - p.drag + p.drag * u.z) * harmonics(p, u.x / p.r))  # (2)
