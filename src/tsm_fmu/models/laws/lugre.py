"""LuGre friction: the exact step of the bristle deflection while the speed holds.

AME 2020 Eq (40) with its lost factors put back (models of the same form: MMT 2015 Eqs (2)-(4))::

    dz/dt = v - |v| z/S(v),    S = g(v)/sigma0                                          (40a)
    g(v)  = F_c + (F_s - F_c) exp(-(v/v_s)^2)                                           (40b)
    F     = sigma0 z + sigma1 dz/dt + sigma2 v                                          (40c)

The print has (x/v_s) for (v/v_s) and no sigma0 in (40a). While v holds, (40a) is linear in z::

    z = s S + (z0 - s S) exp(-|v| dt/S),    s = sgn(v)                                  (40d)

Exact for any step, however stiff; |z| <= max(|z0|, S). With sigma1 = sigma2 = 0 and F_s = F_c the
friction depends on the path only (Dahl). v -> F is passive if sigma2 >= sigma1 (F_s - F_c)/F_c.
"""

import math


def stribeck(v: float, f_c: float, f_s: float, v_s: float) -> float:
    """Steady friction level g(v), Eq (40b), in the unit of ``f_c``."""
    r = v / v_s
    return f_c + (f_s - f_c) * math.exp(-r * r)


def bristle_after(z: float, v: float, dt: float, s: float) -> float:
    """Deflection after ``dt`` at constant speed, Eq (40d); ``s`` > 0 is its steady magnitude S(v)."""
    if v == 0.0:
        return z
    steady = math.copysign(s, v)
    return steady + (z - steady) * math.exp(-abs(v) * dt / s)


def bristle_rate(z: float, v: float, s: float) -> float:
    """dz/dt of Eq (40a)."""
    return v - abs(v) * z / s


def friction(z: float, v: float, s: float, sigma0: float, sigma1: float, sigma2: float) -> float:
    """Friction force or torque, Eq (40c)."""
    return sigma0 * z + sigma1 * bristle_rate(z, v, s) + sigma2 * v


def passive_damping(f_c: float, f_s: float, sigma1: float) -> float:
    """Least sigma2 that keeps v -> F passive beside the damping of the bristles, sigma1 (F_s - F_c)/F_c."""
    return sigma1 * (f_s - f_c) / f_c
