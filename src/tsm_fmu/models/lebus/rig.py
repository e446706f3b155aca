"""Two LeBus wheels and the sheath between them: what `lebus_loop` needs of the parameters."""

import math
from typing import Any, NamedTuple

from ..laws.capstan import Sheath, path_length, sheath_of
from .geometry import TWO_PI, paid_length, wound_length


class Rig(NamedTuple):
    """What of the parameters the loop needs; without layers ``n_layers`` is 1 and ``r_1`` is D/2.

    Attributes
    ----------
    sheath : Sheath
        Path of both tendons.
    EA, T_0, slack : float
        Axial stiffness [N], preload [N], slack of tendon b [m].
    layer_angle, n_layers, r_1, rise : float, int, float, float
        Angle of a layer [rad], number of layers, radius of the first [m], rise of the next [m].
    winding : float
        1 with winding strain, else 0.
    length, delta_0 : float
        Length of the path and stretch of a tendon at preload [m].
    """

    sheath: Sheath
    EA: float
    T_0: float
    slack: float
    layer_angle: float
    n_layers: int
    r_1: float
    rise: float
    winding: float
    length: float
    delta_0: float


def rig(p: Any) -> Rig:
    """What the loop needs of the parameters of the transmission or of its compensator."""
    sheath = sheath_of(
        p.mu,
        p.n_seg,
        p.L,
        p.R,
    )
    length = path_length(sheath)
    several = p.layers == 1
    return Rig(
        sheath,
        p.EA,
        p.T_0,
        p.slack,
        TWO_PI * p.n_t,
        p.n_layers if several else 1,
        0.5 * (p.D + p.d) if several else 0.5 * p.D,
        0.5 * math.sqrt(3.0) * p.d if several else 0.0,
        float(p.winding_strain),
        length,
        p.T_0 * length / p.EA,
    )


def stay_in_grooves(g: Rig, theta_in: float) -> None:
    """Fail the step where the driver leaves its layers."""
    if g.n_layers > 1 and (theta_in < 0.0 or theta_in > g.n_layers * g.layer_angle):
        raise ValueError("driver leaves the grooves -- expected 0 to n_layers * n_t turns if layers = 1 -- raise n_t")


def wound(g: Rig, theta: float) -> float:
    """Tendon [m] wound by the side that starts empty."""
    return wound_length(theta, g.layer_angle, g.n_layers, g.r_1, g.rise)


def paid(g: Rig, theta: float) -> float:
    """Tendon [m] paid out by the side that starts full."""
    return paid_length(theta, g.layer_angle, g.n_layers, g.r_1, g.rise)


def follower_of(g: Rig, theta_in: float) -> float:
    """Follower angle at which tendon a has its preload stretch, S_a,out = S_a,in."""
    if g.rise == 0.0:
        return theta_in
    wanted = wound(g, theta_in)
    at = 0.0
    for k in range(g.n_layers):
        radius = g.r_1 + (g.n_layers - 1 - k) * g.rise
        if k == g.n_layers - 1 or wanted <= radius * g.layer_angle:
            return at + wanted / radius
        wanted -= radius * g.layer_angle
        at += g.layer_angle
    return at
