"""First-order lag of a signal that moves on straight lines between samples."""

import math


def lagged(y: float, u_from: float, u_to: float, dt: float, tau: float) -> float:
    """Exact solution of ``tau dy/dt + y = u`` after ``dt``, with u linear from ``u_from`` to ``u_to``; tau = 0: u."""
    if tau <= 0.0:
        return u_to
    keep = math.exp(-dt / tau)
    slope = (u_to - u_from) / dt
    return u_to - slope * tau + (y - u_from + slope * tau) * keep
