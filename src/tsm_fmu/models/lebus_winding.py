"""Winding of a tendon on a wheel with LeBus (double broken-line) grooves: place, radius and wheel friction.

Jia et al., Adv. Mech. Eng. 2020, Eqs (1)-(13), with the corrections of the print::

    z_p   = L_d0 - drop(theta)                        layer 1; the next layer goes back along the same grooves   (4)
    gamma = atan(|z_p - L_d0/2|/L_c)                                                                         (5),(6)
    f'    = 2 mu T cos(gamma)/D                       layer 1                                                (7)-(9)
    f'    = 4 sqrt(3) mu T cos(gamma)/(3 D_j)         layers j >= 2, D_j = D + (j - 2) d sqrt(3)           (10)-(13)
    F_w   = f' s_w                                                                                              (W)
    tau_w = F_w r_w sign(dtheta)                                 on the motor; at rest the last sign, 0 before any  (T)

Where the print is wrong:

* (4): the ranges of rows 2-4 overlap and leave gaps; here z_p is continuous and falls by P_s per turn.
* (7)-(9), (12): 2 T cos(gamma)/D is tension over radius, a force **per length** [N/m], yet the paper subtracts it from
  a tension in (24). It needs the length s_w over which the tendon slips on the wheel. The paper gives none, so s_w is
  a parameter with default 0: no wheel friction.
* (13): "sqrt(3 mu)" is a misprint of sqrt(3) mu: N_P = F_q2/(2 cos 30 deg) and F_f2 = 2 mu N_P give 1.1547 F_f1. The
  angle called phi there is the contact angle of 30 deg, not the groove's phi of P_s = l_b tan(phi). As the paper does,
  layer 2 takes D_2 = D, higher layers grow by the rise of a layer.

Pitch, alpha_s, L_d0, L_c and the turns per layer are not published: assumed values. L_d0 of 1.6 mm holds five pitches
of 0.32 mm, hence n_t = 5 here.

Validity: the grooves begin at theta = 0 and end when all layers are full: outside the step fails.
"""

import math
from typing import Annotated, NamedTuple

from .contract import Condition, DefaultExperiment, Preset, Quantity, Roles
from .laws.signs import held_sign
from .lebus.geometry import TWO_PI, groove_drop, layer_radius, layers_below, wheel_friction

NAME = "LebusWinding"
ROLES = Roles(
    depends={name: ("theta",) for name in ("z_p", "gamma", "layer", "r_w")}, experiment=DefaultExperiment(31.4, 0.02)
)


class Params(NamedTuple):
    D: Annotated[float, Quantity("m", "wheel diameter", lo=0.0, open_lo=True, display="mm")] = 0.025
    d: Annotated[float, Quantity("m", "tendon diameter", lo=0.0, open_lo=True, display="mm")] = 3.05e-4
    P_s: Annotated[float, Quantity("m", "pitch, Eq (4); assumed", lo=0.0, open_lo=True, display="mm")] = 3.2e-4
    alpha_s: Annotated[
        float,
        Quantity(
            "rad",
            "angle of one straight groove, Eq (3); that of a broken one is pi - alpha_s; assumed",
            lo=0.0,
            hi=math.pi,
            open_lo=True,
            open_hi=True,
            display="deg",
        ),
    ] = 5.0 * math.pi / 6.0
    L_d0: Annotated[float, Quantity("m", "width of the wheel, Eq (4)", lo=0.0, open_lo=True, display="mm")] = 1.6e-3
    L_c: Annotated[
        float, Quantity("m", "distance from wheel to sheath end, Eq (5); assumed", lo=0.0, open_lo=True, display="mm")
    ] = 0.1
    n_t: Annotated[float, Quantity("1", "turns in a layer; assumed", lo=0.0, open_lo=True)] = 5.0
    n_layers: Annotated[int, Quantity("1", "number of layers", lo=1, hi=20)] = 2
    mu: Annotated[float, Quantity("1", "friction coefficient, Eq (8)", lo=0.0)] = 0.16
    s_w: Annotated[
        float, Quantity("m", "length over which the tendon slips on the wheel, Eq (W); unpublished", lo=0.0)
    ] = 0.0


class State(NamedTuple):
    theta: Annotated[float, Quantity("rad", "wheel angle at the end of the last step")]
    way: Annotated[float, Quantity("1", "last sign of the wheel's speed, 0 before it moves")]


class Inputs(NamedTuple):
    theta: Annotated[float, Quantity("rad", "wheel angle, 0 where the grooves begin", lo=0.0, display="deg")]
    T: Annotated[float, Quantity("N", "tension of the tendon", lo=0.0)]


class Outputs(NamedTuple):
    F_w: Annotated[float, Quantity("N", "friction on the wheel, Eq (W)")]
    z_p: Annotated[float, Quantity("m", "axial position of the tendon, Eq (4)", display="mm")]
    gamma: Annotated[float, Quantity("rad", "fleet angle, Eqs (5) and (6)", display="deg")]
    layer: Annotated[int, Quantity("1", "layer that is being wound, from 1", lo=1, hi=20)]
    r_w: Annotated[float, Quantity("m", "winding radius, Eq (L) of lebus_geometry", display="mm")]
    tau_w: Annotated[float, Quantity("N.m", "torque of that friction, opposes the wheel's motion, Eq (T)")]


PRESETS = {
    "published": Preset(
        source="AME 2020, experimental design; P_s, alpha_s, L_d0, L_c, n_t assumed, s_w unpublished",
        printed={"D": (25.0, "mm"), "d": (0.305, "mm"), "mu": (0.16, "1"), "n_layers": (2, "1")},
        si={},
    )
}


def layer_width(p: Params) -> float:
    """Width of a layer of n_t turns [m]."""
    return p.n_t * p.P_s


def spare_width(p: Params) -> float:
    """What the wheel is wider than a layer, roundings allowed [m]."""
    return p.L_d0 * (1.0 + 1e-9) - layer_width(p)


CONDITIONS = (
    Condition(
        "at most the wheel's width L_d0 = {L_d0!r} m",
        spare_width,
        "n_t = {n_t!r} turns of pitch P_s = {P_s!r} m take {width!r} m",
        "lower n_t or widen L_d0",
        closed=True,
        numbers={"width": layer_width},
    ),
)


def wound(p: Params, u: Inputs, way: float) -> tuple[State, Outputs]:
    layer_angle = TWO_PI * p.n_t
    if u.theta < 0.0:
        raise ValueError("theta is negative -- the grooves begin at 0 -- start the wheel where winding begins")
    if u.theta > p.n_layers * layer_angle:
        raise ValueError("theta is beyond n_layers * n_t turns -- all layers are full -- raise n_layers or n_t")
    if u.T < 0.0:
        raise ValueError("tension T is negative -- expected 0 or more -- a tendon cannot push")
    filled = layers_below(u.theta, layer_angle, p.n_layers, 1.0)
    along = u.theta - filled * layer_angle
    if filled % 2 == 1:  # every other layer goes back along the grooves
        along = max(layer_angle - along, 0.0)
    z_p = p.L_d0 - groove_drop(along, p.P_s, p.alpha_s)  # (4)
    gamma = math.atan(abs(z_p - 0.5 * p.L_d0) / p.L_c)  # (5), (6)
    F_w = wheel_friction(p.mu, u.T, gamma, p.D, p.d, filled) * p.s_w  # (W)
    r_w = layer_radius(0.5 * (p.D + p.d), 0.5 * math.sqrt(3.0) * p.d, filled)  # (L)
    return State(u.theta, way), Outputs(F_w, z_p, gamma, filled + 1, r_w, way * F_w * r_w)  # (T)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return wound(p, u, 0.0)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    return wound(p, u, held_sign(u.theta - s.theta, s.way))
