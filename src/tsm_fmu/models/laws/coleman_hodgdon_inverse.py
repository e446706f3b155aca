"""Exact inverse of a Coleman-Hodgdon segment: the input travel that moves the output by a given travel.

With y the travel of the output c x_in + x_h along one direction s, D that of the input, and
G = s x_h0 - beta/alpha, the segment (10a) of `coleman_hodgdon` is::

    y = c D - G (1 - exp(-alpha D))                                                     (I1)
    D = (y + G)/c + W0(-(alpha G/c) exp(-alpha (y + G)/c))/alpha                        (I2)

Inside the loop 0 <= G <= 2 |beta|/alpha. For 2 |beta| > c the right side of (I1) first falls: D(0+) > 0, the
inverse jumps at a reversal. (I2) loses digits where W0 is near -1, so it starts a Newton iteration on (I1).
"""

import math

from .lambert_w import lambert_w0


def input_travel(y: float, x_h: float, c: float, beta: float, alpha: float) -> float:
    """Signed travel of the input that moves the output by ``y``, Eq (I2).

    Parameters
    ----------
    y : float
        Signed travel of the output [rad]; 0 holds the input.
    x_h : float
        Hysteresis part before the move [rad].
    c, beta, alpha : float
        Ratio, slope change and inverse memory length of the segment.
    """
    if y == 0.0:
        return 0.0
    s = math.copysign(1.0, y)
    q = alpha * abs(y) / c
    g = (alpha * s * x_h - beta) / c
    d = q + g + lambert_w0(-g * math.exp(-g - q)) if g >= 0.0 else 0.0  # (I2)
    for _ in range(60):  # (I1) is concave or convex on the side it starts from: no step passes the root
        slope = 1.0 - g * math.exp(-d)
        if slope <= 1e-8:
            break
        change = (d + g * math.expm1(-d) - q) / slope
        d -= change
        if abs(change) <= 1e-16 * d:
            break
    return s * max(d, 0.0) / alpha


def jump_at_full_reversal(c: float, beta: float, alpha: float) -> float:
    """Jump of the inverse's output when the reference turns on the major loop, 0 for 2 |beta| <= c [rad]."""
    g = -2.0 * beta / c
    return (g + lambert_w0(-g * math.exp(-g))) / alpha if g > 1.0 else 0.0  # (I2) at y = 0
