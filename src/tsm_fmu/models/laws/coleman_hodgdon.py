"""Coleman-Hodgdon hysteresis: the exact solution on one monotone segment of the input.

MSSP 2015 Eqs (8)-(10), with x_h the hysteresis part of x_out = c x_in + x_h::

    dx_h/dt = beta dx_in/dt - alpha |dx_in/dt| x_h                                      (10)

Along a segment of one direction s = sgn(dx_in) this is linear in the travel |dx_in|::

    x_h = s beta/alpha + (x_h0 - s beta/alpha) exp(-alpha |dx_in|)                      (10a)

Rate independent and exact for any step that does not turn inside. |x_h| <= max(|x_h0|, |beta|/alpha).
"""

import math
from typing import Any

from ..contract import Condition


def hysteresis_after(x_h: float, dx_in: float, beta: float, alpha: float) -> float:
    """Hysteresis part after the input moved monotonically by ``dx_in``, Eq (10a).

    Parameters
    ----------
    x_h : float
        Hysteresis part before the move [unit of the output].
    dx_in : float
        Signed travel of the input [rad].
    beta : float
        Slope change B - c [1].
    alpha : float
        Inverse of the length over which a reversal is forgotten [1/rad].
    """
    if dx_in == 0.0:
        return x_h
    asymptote = math.copysign(1.0, dx_in) * beta / alpha
    return asymptote + (x_h - asymptote) * math.exp(-alpha * abs(dx_in))


def slope_after_reversal(p: Any) -> float:
    """B = c + beta, the slope of the output just after a reversal."""
    return p.c + p.beta


def room_of_start(p: Any) -> float:
    """How far the start x_h_0 is within twice the half-width |beta|/alpha of the widest loop."""
    return -2.0 * p.beta / p.alpha - abs(p.x_h_0)


START_NEAR_LOOP = Condition(
    "|x_h_0| <= 2 |beta|/alpha",
    room_of_start,
    "x_h_0 = {x_h_0!r} is more than the widest loop, beta = {beta!r} with alpha = {alpha!r}",
    "bring x_h_0 nearer to 0",
    closed=True,
)
"""A drive that has moved is within its loop: what starts far outside of it drifts into place, and is no hysteresis."""

# B < c, also below Eq (10), is the bound of beta
RISING = Condition(
    "B > 0 (MSSP 2015, below Eq (10))",
    slope_after_reversal,
    "beta = {beta!r} with c = {c!r} gives B = c + beta = {margin!r}",
    "raise beta above -c",
)
