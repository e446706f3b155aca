"""The curve after a reversal bends otherwise than an exponential.

dF of the friction follows its own presliding state z_n instead of the Dahl state z::

    dz_n/dx = (1 - s z_n)^n / x_0                                                       (1)
    F <- F + dF (z_n - z)                                                               (2)

Exact per monotone segment, with r = 1 - s z_n and X = |dx|/x_0::

    n = 1: r = r0 exp(-X)          n != 1: r^(1-n) = r0^(1-n) - (1-n) X, 0 once spent    (1a)

Limits: dF = 0 changes nothing; n = 1 with x_0 = x_pre changes nothing either. n < 1 ends presliding
at a finite travel. Source: Dahl (1968), shape exponent.
"""

import math
from typing import Annotated, NamedTuple

from ..models.contract import Quantity
from .about import Effect, Shape, Size

NAME = "presliding_shape"
ABOUT = Effect(
    words="another curve of friction after reversals",
    signature="curvature after reversal",
    shown_by="finely sampled reversals, also of strokes within the presliding",
    places=("friction",),
    family="history",
    looks_like=("backlash", "smooth_backlash"),
    role="nuisance",
    after_reversal=True,
)


class Params(NamedTuple):
    dF: Annotated[float, Quantity("{F}", "friction that follows z_n, Eq (2)", lo=0.0), Size()] = 0.0
    n: Annotated[float, Quantity("1", "shape exponent, Eq (1)", lo=0.2, hi=4.0), Shape("number", 0.5, 2.0)] = 1.0
    x_0: Annotated[
        float, Quantity("{x}", "presliding distance, Eq (1)", lo=0.0, open_lo=True), Shape("stroke", 0.0032, 0.5)
    ] = 0.01


NEUTRAL = Params()


class State(NamedTuple):
    x: Annotated[float, Quantity("{x}", "input position")]
    z_n: Annotated[float, Quantity("1", "shaped presliding state, Eq (1)")]


class Inputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "what this effect changes, before it")]
    x: Annotated[float, Quantity("{x}", "input position")]
    z: Annotated[float, Quantity("1", "presliding state")]


class Outputs(NamedTuple):
    y: Annotated[float, Quantity("{F}", "the same with this effect")]


PRESETS = {}


def shaped(z: float, dx: float, x_0: float, n: float) -> float:
    """Shaped presliding state after the travel ``dx``, Eq (1a)."""
    if dx == 0.0:
        return z
    s = math.copysign(1.0, dx)
    r = 1.0 - s * z
    travel = abs(dx) / x_0
    if r <= 0.0:
        return s
    if abs(n - 1.0) < 1e-9:
        return s - s * r * math.exp(-travel)
    left = math.pow(r, 1.0 - n) - (1.0 - n) * travel
    return s - s * math.pow(left, 1.0 / (1.0 - n)) if left > 0.0 else s


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x, u.z), Outputs(u.y)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    z_n = shaped(s.z_n, u.x - s.x, p.x_0, p.n)  # (1a)
    return State(u.x, z_n), Outputs(u.y + p.dF * (z_n - u.z))  # (2)
