"""Distal angle and torque of a tendon-sheath drive from proximal signals alone: haptic force feedback.

The use that MMT 2015 and MSSP 2015 (Fig. 9) make of their models; here Eqs (T1), (T2) of TendonDrive solved for the
distal side::

    x_out   = c x_in + x_h + x_0                                                        (T1)
    tau_out = (tau_in - g_LuGre(v_in))/ratio                                            (D2)

Validity: parameters, state and bounds are those of TendonDrive, so one fitted set serves both.
"""

from typing import Annotated, NamedTuple

from .contract import Quantity
from .tendon_drive import PRESETS as PRESETS
from .tendon_drive import Params, State, distal_angle, friction_torque, moved, rest
from .tendon_drive import check as check
from .tendon_drive import warnings as warnings

NAME = "DistalEstimator"
MOTION = "x_in"
LOAD = "tau_out"
FRICTION_LIKE = "tau_in"


class Inputs(NamedTuple):
    x_in: Annotated[float, Quantity("rad", "drive-side angle", display="deg")]
    tau_in: Annotated[float, Quantity("N.m", "measured drive torque")]


class Outputs(NamedTuple):
    x_out: Annotated[float, Quantity("rad", "distal angle, Eq (T1)", display="deg")]
    tau_out: Annotated[float, Quantity("N.m", "torque on the distal side, Eq (D2)")]


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    s = rest(p, u.x_in)
    return s, _outputs(p, s, u)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    after = moved(p, s, u.x_in, dt)
    return after, _outputs(p, after, u)


def _outputs(p: Params, s: State, u: Inputs) -> Outputs:
    return Outputs(distal_angle(p, s), (u.tau_in - friction_torque(p, s)) / p.ratio)  # (T1), (D2)


def friction_in(p: Params, u: Inputs, o: Outputs) -> float:
    """Friction in the outputs, for a chain with effects."""
    return u.tau_in - p.ratio * o.tau_out


def with_friction(p: Params, u: Inputs, o: Outputs, f: float) -> Outputs:
    """Outputs with the friction ``f`` instead, Eq (D2)."""
    return Outputs(o.x_out, (u.tau_in - f) / p.ratio)
