"""PID position controller with filtered derivative, saturation and back-calculation anti-windup.

Astrom, Hagglund, "Advanced PID Control" (2006), Sections 3.3-3.5 and 13.4, in parallel form::

    u_p = kp (r - y)                                                                    (1)
    du_i/dt = ki (r - y) + (u - u_raw)/T_aw        (T_aw = 0: without the second term)  (2)
    T_f du_d/dt = kd d(weight_d r - y)/dt - u_d                                         (3)
    u_raw = u_p + u_i + u_d,   u = min(max(u_raw, u_min), u_max)                        (4)

The derivative acts on the error by default (weight_d = 1: a moving reference is tracked without
derivative lag) and on the measurement alone with weight_d = 0 (no kick where r jumps).

Discretisation: r and y are the values reached at the end of the step and move on straight lines
within it (first-order hold), so (1)-(3) without saturation are exact at any step size. The
back-calculation of (2) is split off and solved exactly for the excess at the end of the step::

    u_i = u_i* - (u_raw* - u*) (1 - exp(-dt/T_aw))                                      (5)

with * as if without it: first order in dt, stable for every dt, T_aw -> 0 holds u_i at the bound.

At the start u_i = u_d = 0: the first inputs are where the motion starts, without a derivative kick.

Source of the default gains: ours, for `DcMotor` with its defaults (assumed, no paper prints any): a gain
crossover near 150 rad/s. MSSP 2015, Section 6, states the saturation alone (0-24 V; both signs here).

Validity: u_min < u_max; T_f of at least a step or two keeps quantisation noise out of u_d.
"""

import math
from typing import Annotated, NamedTuple

from .contract import Condition, DefaultExperiment, Preset, Quantity, Roles
from .laws.velocity_filter import filtered_slope

NAME = "PidController"
ROLES = Roles(experiment=DefaultExperiment(2.0, 1e-3))


class Params(NamedTuple):
    kp: Annotated[float, Quantity("V/rad", "proportional gain, Eq (1); assumed")] = 60.0
    ki: Annotated[float, Quantity("V/(rad.s)", "integral gain, Eq (2); assumed")] = 600.0
    kd: Annotated[float, Quantity("V.s/rad", "derivative gain, Eq (3); assumed")] = 1.0
    T_f: Annotated[
        float, Quantity("s", "time constant of the derivative filter, Eq (3); 0 is a plain difference; assumed", lo=0.0)
    ] = 0.001
    T_aw: Annotated[
        float, Quantity("s", "tracking time constant of the anti-windup, Eq (2); 0 is off; assumed", lo=0.0)
    ] = 0.1
    u_min: Annotated[float, Quantity("V", "lower bound of the output, Eq (4)")] = -24.0
    u_max: Annotated[float, Quantity("V", "upper bound of the output, Eq (4)")] = 24.0
    weight_d: Annotated[
        float, Quantity("1", "weight of r in the derivative, Eq (3): 1 error, 0 measurement", lo=0.0, hi=1.0)
    ] = 1.0


class State(NamedTuple):
    r: Annotated[float, Quantity("rad", "reference at the end of the last step")]
    y: Annotated[float, Quantity("rad", "measurement at the end of the last step")]
    u_i: Annotated[float, Quantity("V", "integral part, Eq (2)")]
    rate: Annotated[float, Quantity("rad/s", "filtered d(weight_d r - y)/dt, Eq (3)")]


class Inputs(NamedTuple):
    r: Annotated[float, Quantity("rad", "reference", display="deg")]
    y: Annotated[float, Quantity("rad", "measurement", display="deg")]


class Outputs(NamedTuple):
    u: Annotated[float, Quantity("V", "controller output, Eq (4)")]


PRESETS = {
    "dc_motor": Preset(
        source="gains ours, for DcMotor with its defaults (assumed); the bound of 24 V is MSSP 2015, Section 6",
        printed={"kp": (60.0, "V/rad"), "T_f": (1.0, "ms"), "u_max": (24.0, "V")},
        si={},
    )
}


def span(p: Params) -> float:
    """Width of the band of the output [V]."""
    return p.u_max - p.u_min


CONDITIONS = (
    Condition("u_min < u_max", span, "u_min = {u_min!r} V with u_max = {u_max!r} V", "lower u_min or raise u_max"),
)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.r, u.y, 0.0, 0.0), Outputs(_saturate(p, p.kp * (u.r - u.y)))


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    error_from, error_to = s.r - s.y, u.r - u.y
    rate = filtered_slope(s.rate, p.weight_d * s.r - s.y, p.weight_d * u.r - u.y, dt, p.T_f)  # (3)
    u_i = s.u_i + p.ki * 0.5 * (error_from + error_to) * dt  # (2) without the second term
    u_raw = p.kp * error_to + u_i + p.kd * rate  # (4)
    bounded = _saturate(p, u_raw)
    if p.T_aw > 0.0:
        u_i += (u_raw - bounded) * math.expm1(-dt / p.T_aw)  # (5)
    return State(u.r, u.y, u_i, rate), Outputs(bounded)


def _saturate(p: Params, u_raw: float) -> float:
    return min(max(u_raw, p.u_min), p.u_max)  # (4)
