"""Feedforward compensation of the backlash-like hysteresis of a paired tendon-sheath mechanism.

Law 1, Do, Tjahjowidodo, Lau, Phee, MSSP 60-61 (2015), Eqs (23), (25)::

    x_ff = (x_r - x_h - x_0)/c                                                          (23)
    dx_h/dt = beta dx_r/dt - alpha |dx_r/dt| x_h                                        (25)

Its observer is driven by the reference, the plant by x_ff: even with the plant's own parameters an error of
(2|beta|/alpha) max_y y (1 - exp(-(2|beta|/c)(1 - y))) stays (3.24 deg, published set).

Law 2 (ours) drives the observer by x_ff itself, which makes it the exact inverse::

    dx_h/dt = beta dx_ff/dt - alpha |dx_ff/dt| x_h                                      (25a)

in closed form along each monotone segment of x_r (`coleman_hodgdon_inverse`): no iteration over time, any step.
For B = c + beta < c/2 the plant moves backwards after a reversal and law 2 jumps over that part; `warnings` says so.

Validity: 0 < B < c as for PairedTsmBacklash; x_0, x_h_0 as there.
Step: x_ff from (23) after x_h has moved, so that no error accumulates in x_ff.
"""

import math
from typing import Annotated, NamedTuple

from .contract import Condition, DefaultExperiment, Preset, Quantity, Roles
from .laws.coleman_hodgdon import RISING, hysteresis_after, slope_after_reversal
from .laws.coleman_hodgdon_inverse import input_travel, jump_at_full_reversal

NAME = "FeedforwardCompensator"
ROLES = Roles(experiment=DefaultExperiment(20.0, 0.01))


class Params(NamedTuple):
    c: Annotated[float, Quantity("1", "ratio of output to input motion, Eq (23)", lo=0.0, open_lo=True)] = 1.00056
    beta: Annotated[float, Quantity("1", "slope change at a reversal, B - c, Eq (25)", hi=0.0, open_hi=True)] = -0.91693
    alpha: Annotated[
        float, Quantity("1/rad", "inverse of the travel that forgets a reversal, Eq (25)", lo=0.0, open_lo=True)
    ] = 10.1062
    x_0: Annotated[float, Quantity("rad", "output offset of the drive (ours)", display="deg")] = 0.0
    x_h_0: Annotated[float, Quantity("rad", "hysteresis part at the start", display="deg")] = 0.0
    law: Annotated[
        int, Quantity("1", "1 as in the paper, 2 exact inverse (ours)", lo=1, hi=2, choices=("paper", "exact_inverse"))
    ] = 1


class State(NamedTuple):
    x_r: Annotated[float, Quantity("rad", "reference at the end of the last step")]
    x_h: Annotated[float, Quantity("rad", "estimated hysteresis part, Eq (25) or (25a)")]


class Inputs(NamedTuple):
    x_r: Annotated[float, Quantity("rad", "wanted distal angle", display="deg")]


class Outputs(NamedTuple):
    x_ff: Annotated[float, Quantity("rad", "drive-side angle to command, Eq (23)", display="deg")]


PRESETS = {
    "published": Preset(
        source="MSSP 2015, Section 7, parameters of the backlash-like hysteresis; law 1 is the paper's",
        printed={"c": (1.00056, "1"), "beta": (-0.91693, "1"), "alpha": (10.1062, "1/rad")},
        si={},
    )
}


def largest_jump(p: Params) -> float:
    """Jump that law 2 asks of the drive where the reference turns [deg]."""
    return math.degrees(jump_at_full_reversal(p.c, p.beta, p.alpha)) if p.law == 2 else 0.0


def half_ratio(p: Params) -> float:
    """c/2, the least B at which the drive need not jump."""
    return 0.5 * p.c


def smoothness(p: Params) -> float:
    """0 where the drive need not jump, below it by the jump [deg]."""
    return -largest_jump(p)


CONDITIONS = (
    RISING,
    Condition(
        "B >= c/2 for law 2",
        smoothness,
        "B = c + beta = {B:g} is below c/2 = {half:g}",
        "use law 1 or fit with B >= c/2",
        closed=True,
        numbers={"B": slope_after_reversal, "half": half_ratio, "jump": largest_jump},
        consequence="law 2 jumps by up to {jump:.4g} deg at each reversal, which no motor follows",
    ),
)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(u.x_r, p.x_h_0), Outputs((u.x_r - p.x_h_0 - p.x_0) / p.c)  # (23)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    travel = u.x_r - s.x_r
    if p.law == 2:
        travel = input_travel(travel, s.x_h, p.c, p.beta, p.alpha)  # (25a)
    x_h = hysteresis_after(s.x_h, travel, p.beta, p.alpha)  # (25)
    return State(u.x_r, x_h), Outputs((u.x_r - x_h - p.x_0) / p.c)  # (23)
