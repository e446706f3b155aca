"""Coleman-Hodgdon hysteresis: the exact solution on one monotone segment of the input.

MSSP 2015 Eqs (8)-(10), with x_h the hysteresis part of x_out = c x_in + x_h::

    dx_h/dt = beta dx_in/dt - alpha |dx_in/dt| x_h                                      (10)

Along a segment of one direction s = sgn(dx_in) this is linear in the travel |dx_in|::

    x_h = s beta/alpha + (x_h0 - s beta/alpha) exp(-alpha |dx_in|)                      (10a)

Rate independent and exact for any step that does not turn inside. |x_h| <= max(|x_h0|, |beta|/alpha).
"""

import math

from ..contract import InputError


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
    asymptote = math.copysign(beta / alpha, beta * dx_in) if beta != 0.0 else 0.0
    return asymptote + (x_h - asymptote) * math.exp(-alpha * abs(dx_in))


def check_slopes(c: float, beta: float) -> None:
    """Raise `InputError` unless 0 < B = c + beta (B > 0 and B < c, below Eq (10); beta < 0 is a declared bound)."""
    if c + beta <= 0.0:
        raise InputError(
            f"beta = {beta!r} with c = {c!r} gives B = c + beta = {c + beta!r} -- expected B > 0 "
            "(MSSP 2015, below Eq (10)) -- raise beta above -c"
        )
