"""Velocity of a position input: a causal first-order filter on its slope.

Between two samples the position moves on a straight line, so the filter's equation::

    tau_v dv/dt = dx/dt - v                                                             (V1)

has an exact solution over a step of length dt from x_0 to x_1::

    v = w + (v_0 - w) exp(-dt/tau_v),   w = (x_1 - x_0)/dt                              (V2)

tau_v = 0 gives the backward difference w. Exact for any step size as long as the position is
piecewise linear; a ramp gives its slope without error once exp(-t/tau_v) has died out.
"""

import math


def filtered_slope(v: float, x_from: float, x_to: float, dt: float, tau_v: float) -> float:
    """Filtered velocity at the end of a step, Eq (V2).

    Parameters
    ----------
    v : float
        Filtered velocity at the start of the step [unit of x / s].
    x_from, x_to : float
        Position at the start and at the end of the step.
    dt : float
        Length of the step, above 0 [s].
    tau_v : float
        Time constant, 0 or more [s].
    """
    w = (x_to - x_from) / dt
    if tau_v <= 0.0:
        return w
    return w + (v - w) * math.exp(-dt / tau_v)
