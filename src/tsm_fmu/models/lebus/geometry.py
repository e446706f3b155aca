"""Geometry of LeBus grooves: where the tendon lies on a wheel, on what radius, and how much of it is wound.

Jia et al., Adv. Mech. Eng. 2020, Eqs (3)-(6). A turn has two straight and two broken (inclined) grooves; alpha_s and
alpha_b are the angles of one of each::

    alpha_s = 90 deg l_s/(pi r),  alpha_b = 90 deg l_b/(pi r),  alpha_s + alpha_b = 180 deg         (3)
    z(theta): constant over alpha_s, falls by P_s/2 over alpha_b, twice a turn                      (4)
    gamma = atan(|z_p - L_d0/2|/L_c)                                                            (5),(6)
    r_j   = D/2 + d/2 + (j - 1) d sqrt(3)/2: layers lie in the triangle of the one below            (L)

As printed the ranges of rows 2-4 of Eq (4) overlap and leave gaps; (4) here is the only reading that is continuous.
(5) and (6) are one formula. (L) and the winding lengths are ours (the paper sets r = D/2 for all layers).
"""

import math

from ..contract import InputError

TWO_PI = 2.0 * math.pi


def straight_angle(l_s: float, l_b: float, r: float) -> float:
    """Angle alpha_s [rad] of one straight groove from the groove lengths of one turn, Eq (3).

    Parameters
    ----------
    l_s, l_b : float
        Total length of the two straight and of the two broken grooves of a turn [m].
    r : float
        Radius of the wheel [m].

    Raises
    ------
    InputError
        Unless l_s > 0, l_b > 0 and l_s + l_b = 2 pi r.
    """
    if not (l_s > 0.0 and l_b > 0.0 and abs(l_s + l_b - TWO_PI * r) <= 1e-6 * TWO_PI * r):
        raise InputError(
            f"groove lengths l_s = {l_s!r} m, l_b = {l_b!r} m on radius r = {r!r} m -- expected both positive and "
            f"l_s + l_b = 2 pi r = {TWO_PI * r!r} m, Eq (3) -- they are the totals of the two segments of one turn"
        )
    return 0.5 * l_s / r


def groove_drop(theta: float, P_s: float, alpha_s: float) -> float:
    """Axial distance [m] from the groove's start after winding ``theta`` >= 0 [rad], Eq (4)."""
    half = math.floor(theta / math.pi)
    inside = theta - half * math.pi - alpha_s
    return 0.5 * P_s * (half + max(inside, 0.0) / (math.pi - alpha_s))


def wheel_friction(mu: float, T: float, gamma: float, D: float, d: float, filled: int) -> float:
    """Friction per length [N/m] on the wheel above ``filled`` layers, Eqs (9) and (13) of `lebus_winding`."""
    if filled == 0:
        return 2.0 * mu * T * math.cos(gamma) / D  # (9)
    D_j = D + (filled - 1) * d * math.sqrt(3.0)
    return 4.0 * math.sqrt(3.0) * mu * T * math.cos(gamma) / (3.0 * D_j)  # (13)


def layers_below(theta: float, layer_angle: float, n_layers: int, ahead: float) -> int:
    """Number of layers that winding ``theta`` has filled, 0 to n_layers - 1.

    On the very angle where a layer ends, ``ahead`` > 0 counts it as filled (the wheel goes on), else not.
    """
    filled = 0
    for k in range(1, n_layers):
        if theta > k * layer_angle or (theta == k * layer_angle and ahead > 0.0):
            filled = k
    return filled


def layer_radius(r_1: float, rise: float, filled: int) -> float:
    """Winding radius [m] above ``filled`` layers, Eq (L); ``rise`` is d sqrt(3)/2."""
    return r_1 + filled * rise


def wound_length(theta: float, layer_angle: float, n_layers: int, r_1: float, rise: float) -> float:
    """Tendon [m] that an empty wheel has wound after ``theta``; the first layer's radius also serves below 0."""
    length = theta * r_1
    for k in range(1, n_layers):
        length += max(theta - k * layer_angle, 0.0) * rise
    return length


def paid_length(theta: float, layer_angle: float, n_layers: int, r_1: float, rise: float) -> float:
    """Tendon [m] that a full wheel has paid out after ``theta``: the outermost layer first."""
    length = theta * (r_1 + (n_layers - 1) * rise)
    for k in range(1, n_layers):
        length -= max(theta - k * layer_angle, 0.0) * rise
    return length
