"""Backlash-like hysteresis of a paired tendon-sheath mechanism.

Do, Tjahjowidodo, Lau, Phee, MSSP 60-61 (2015), Eqs (8)-(10)::

    dx_out/dt = alpha |dx_in/dt| (c x_in - x_out) + B dx_in/dt                          (8)
    x_out     = c x_in + x_h + x_0                                                      (9)
    dx_h/dt   = beta dx_in/dt - alpha |dx_in/dt| x_h,   beta = B - c                    (10)

x_0 is an output offset that a real log needs (not in the paper). Each step is the exact solution
on a monotone segment, so there is no limit on the step size.

Closed forms for a cycle of amplitude A: loop half-height (|beta|/alpha) tanh(alpha A), loop area
2 [(|beta|/alpha) 2A - (h + |beta|/alpha) (1 - exp(-2 alpha A))/alpha] with h the half-height.

Validity: c > 0, alpha > 0, 0 < B < c. The output moves backwards just after a reversal unless
B >= c/2: the published set (B = 0.08363) does so. Simulation accepts it, the inverse warns.
"""

from typing import Annotated, NamedTuple

from .contract import DefaultExperiment, Preset, Quantity, Roles
from .laws.coleman_hodgdon import RISING, START_NEAR_LOOP, hysteresis_after

NAME = "PairedTsmBacklash"


class Params(NamedTuple):
    c: Annotated[float, Quantity("1", "ratio of output to input motion, Eq (9)", lo=0.0, open_lo=True)] = 1.00056
    beta: Annotated[float, Quantity("1", "slope change at a reversal, B - c, Eq (10)", hi=0.0, open_hi=True)] = -0.91693
    alpha: Annotated[
        float, Quantity("1/rad", "inverse of the travel that forgets a reversal, Eq (10)", lo=0.0, open_lo=True)
    ] = 10.1062
    x_0: Annotated[float, Quantity("rad", "output offset (ours)", display="deg")] = 0.0
    x_h_0: Annotated[float, Quantity("rad", "hysteresis part at the start", display="deg")] = 0.0


class State(NamedTuple):
    x_in: Annotated[float, Quantity("rad", "input at the end of the last step")]
    x_h: Annotated[float, Quantity("rad", "hysteresis part, Eq (10)")]


class Inputs(NamedTuple):
    x_in: Annotated[float, Quantity("rad", "drive-side angle", display="deg")]


class Outputs(NamedTuple):
    x_out: Annotated[float, Quantity("rad", "distal angle, Eq (9)", display="deg")]
    x_h: Annotated[float, Quantity("rad", "hysteresis part, Eq (10)", display="deg")]


PRESETS = {
    "published": Preset(
        source="MSSP 2015, Section 7; alpha is per radian (the loop width matches in rad only)",
        printed={"c": (1.00056, "1"), "beta": (-0.91693, "1"), "alpha": (10.1062, "1/rad")},
        si={},
    )
}


CONDITIONS = (RISING,)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x_in, p.x_h_0), Outputs(p.c * u.x_in + p.x_h_0 + p.x_0, p.x_h_0)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    x_h = hysteresis_after(s.x_h, u.x_in - s.x_in, p.beta, p.alpha)  # (10a)
    return State(u.x_in, x_h), Outputs(p.c * u.x_in + x_h + p.x_0, x_h)  # (9)


def lost_motion(p: Params, u: Inputs, o: Outputs) -> float:
    """How far the output lags behind the drive, for the effects that change it."""
    return p.c * u.x_in + p.x_0 - o.x_out


ROLES = Roles(
    motion="x_in",
    offsets=("x_0",),
    initial=("x_h_0",),
    lost_motion={"x_out": lost_motion},
    plausible=(START_NEAR_LOOP,),
    experiment=DefaultExperiment(20.0, 0.01),
)
