"""Weight on a cord around a wheel, hung on one cord, on the one wound the other way, or set down.

Elementary statics (AME 2020 loads its follower wheel with 0.5 and 1 kg and prints neither how they hang nor what they
do at the turn)::

    tau = s m g r                                                                       (1)
    h = integral of s r dphi, from phi_0 on                                             (2)

s is 1 while the weight hangs on the cord that motion to positive phi winds up, -1 on the one wound the other way, 0
when it is set down, and between them while it is taken up or put down. h is how far the wheel has lifted it: m g h is
the work that the wheel has done. In (2) s holds its new value over the step.

Validity: slow motion. The weight has no inertia here, as the torque of `RotationalLoad` has none: it would close an
algebraic loop through a coupling, and belongs in the motor's. A cord is never slack: the weight does not reach the
floor by itself.
"""

from typing import Annotated, NamedTuple

from .contract import Preset, Quantity, Roles

NAME = "HangingLoad"


class Params(NamedTuple):
    m: Annotated[float, Quantity("kg", "mass of the weight, Eq (1)", lo=0.0)] = 0.5
    r: Annotated[float, Quantity("m", "radius of the wheel to the cord, Eq (1)", lo=0.0, display="mm")] = 0.0125
    g: Annotated[float, Quantity("m/s2", "gravity, Eq (1)", lo=0.0)] = 9.80665
    phi_0: Annotated[float, Quantity("rad", "angle of the wheel where h is 0, Eq (2)", display="deg")] = 0.0


class State(NamedTuple):
    phi: Annotated[float, Quantity("rad", "angle of the wheel at the end of the last step")]
    h: Annotated[float, Quantity("m", "lift of the weight, Eq (2)")]


class Inputs(NamedTuple):
    phi: Annotated[float, Quantity("rad", "angle of the wheel", display="deg")]
    s: Annotated[float, Quantity("1", "cord that carries: 1, -1 the one wound the other way, 0 none", lo=-1.0, hi=1.0)]


class Outputs(NamedTuple):
    tau: Annotated[float, Quantity("N.m", "torque of the weight, opposes motion to positive phi, Eq (1)")]
    h: Annotated[float, Quantity("m", "lift of the weight, Eq (2)", display="mm")]


ROLES = Roles(depends={"tau": ("s",), "h": ("phi", "s")})

PRESETS = {
    "ame2020": Preset(
        source="AME 2020, Figs 16 to 20: 0.5 kg; the wheel of the follower",
        printed={"m": (0.5, "kg"), "r": (12.5, "mm")},
        si={},
    ),
    "heavy": Preset(source="AME 2020, Figs 16 to 20: 1 kg", printed={"m": (1.0, "kg")}, si={"m": 1.0}),
}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    h = u.s * p.r * (u.phi - p.phi_0)  # (2)
    return State(u.phi, h), Outputs(_torque(p, u.s), h)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    h = s.h + u.s * p.r * (u.phi - s.phi)  # (2)
    return State(u.phi, h), Outputs(_torque(p, u.s), h)


def _torque(p: Params, s: float) -> float:
    return s * p.m * p.g * p.r  # (1)
