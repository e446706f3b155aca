"""Friction of a paired tendon-sheath mechanism.

Do, Tjahjowidodo, Lau, Phee, MSSP 60-61 (2015), Eqs (6)-(7)::

    dzeta/dt = rho (w - sigma |w| |zeta|^(n-1) zeta + (sigma - 1) w |zeta|^n),  w = v + lambda sgn(a)     (6)
    F_raw = k_x(x, v, a) x + k_zeta zeta + upsilon v + F_0                                                (7)
    k_x(x, v, a) = k_x/2 [1 + tanh(v) + (1 - tanh(v)) sgn(x) sgn(a)]                                     (7a)
    F = force_scale F_raw                                                                                 (7b)

(7a) is the printed quotient of exponentials in the form that cannot overflow; its tanh(v) hides a scale of
1 rad/s. sgn(a) holds its last non-zero value, 0 before any; sgn(0) of x is 0.

force_scale: the published numbers put F_raw at 163 for 60 deg at 0.2 Hz, more than the rope can bear. Read as
N.mm over the 25 mm pulley (1/25, preset ``published``) they give 6.5 N; preset ``raw`` keeps the printed numbers.

One torque balance serves two directions: estimator, tau_out = tau_in - R F (drive side measured), and plant,
tau_drive = tau_load + R F (load known). P_loss = R F v.

Validity: |zeta| <= 1 for rho > 0, sigma >= 1/2, n >= 1. F grows with x and v without bound. F jumps by
|k_x x (1 - tanh(v))| force_scale where sgn(a) flips away from x = 0 (never on a pure sine). lambda != 0 makes
the friction depend on the rate, and F v < 0 on part of a cycle. zeta steps as in `bouc_wen`.
"""

import math
from typing import Annotated, NamedTuple

from .contract import FrictionPort, Preset, Quantity, Roles
from .laws.bouc_wen import bouc_wen_after
from .laws.signs import held_sign, sign

NAME = "PairedTsmFriction"


class Params(NamedTuple):
    rho: Annotated[float, Quantity("1/rad", "inverse presliding travel, Eq (6)", lo=0.0, open_lo=True)] = 26.6659
    lambda_: Annotated[float, Quantity("rad/s", "speed offset by the sign of a, Eq (6)")] = -0.1172
    sigma: Annotated[float, Quantity("1", "hysteresis shape, zeta is bounded from 1/2 on, Eq (6)", lo=0.5)] = 1.7512
    n: Annotated[float, Quantity("1", "hysteresis exponent, Eq (6)", lo=1.0)] = 2.0458
    k_x: Annotated[float, Quantity("N/rad", "position stiffness before force_scale, Eq (7)")] = 10.121
    k_zeta: Annotated[float, Quantity("N", "hysteresis force before force_scale, Eq (7)")] = 127.9493
    upsilon: Annotated[float, Quantity("N.s/rad", "viscous friction before force_scale, Eq (7)")] = 25.8085
    F_0: Annotated[float, Quantity("N", "offset before force_scale, Eq (7)")] = 0.2555
    force_scale: Annotated[float, Quantity("1", "force per raw value of Eq (7) (ours)", lo=0.0, open_lo=True)] = 0.04
    R: Annotated[float, Quantity("m", "pulley radius", lo=0.0, open_lo=True, display="mm")] = 0.025


class State(NamedTuple):
    zeta: Annotated[float, Quantity("1", "hysteresis state, Eq (6)")]
    s_a: Annotated[float, Quantity("1", "last non-zero sign of a")]


class Inputs(NamedTuple):
    x: Annotated[float, Quantity("rad", "drive pulley angle", display="deg")]
    v: Annotated[float, Quantity("rad/s", "its speed", display="deg/s")]
    a: Annotated[float, Quantity("rad/s2", "its acceleration", display="deg/s2")]
    tau_in: Annotated[float, Quantity("N.m", "measured torque on the drive pulley")]
    tau_load: Annotated[float, Quantity("N.m", "load torque on the follower pulley")]


class Outputs(NamedTuple):
    F: Annotated[float, Quantity("N", "friction force against the motion, Eqs (7), (7b)")]
    tau_out: Annotated[float, Quantity("N.m", "distal torque from tau_in, tau_in - R F")]
    tau_drive: Annotated[float, Quantity("N.m", "drive torque from tau_load, tau_load + R F")]
    P_loss: Annotated[float, Quantity("W", "power taken from the motion, R F v")]


_PRINTED = {
    "rho": (26.6659, "1/rad"),
    "lambda": (-0.1172, "rad/s"),
    "sigma": (1.7512, "1"),
    "n": (2.0458, "1"),
    "k_x": (10.121, "N/rad"),
    "k_zeta": (127.9493, "N"),
    "upsilon": (25.8085, "N*s/rad"),
    "F_0": (0.2555, "N"),
}
PRESETS = {
    "published": Preset(
        source="MSSP 2015, Section 7; force_scale 1/25: the raw value read as N.mm over the 25 mm pulley (ours)",
        printed={**_PRINTED, "R": (25.0, "mm")},
        si={},
    ),
    "raw": Preset(
        source="MSSP 2015, Section 7, numbers as printed; not newton, see the model's text",
        printed=_PRINTED,
        si={"force_scale": 1.0},
    ),
}


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    s = State(0.0, sign(u.a))
    return s, _outputs(p, s, u)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    s_a = held_sign(u.a, s.s_a)
    w = u.v + p.lambda_ * s_a
    after = State(bouc_wen_after(s.zeta, p.rho * w * dt, p.sigma, p.n), s_a)  # (6)
    return after, _outputs(p, after, u)


def _outputs(p: Params, s: State, u: Inputs) -> Outputs:
    t = math.tanh(u.v)
    k_x = 0.5 * p.k_x * (1.0 + t + (1.0 - t) * sign(u.x) * s.s_a)  # (7a)
    force = p.force_scale * (k_x * u.x + p.k_zeta * s.zeta + p.upsilon * u.v + p.F_0)  # (7), (7b)
    return with_friction(p, u, Outputs(force, 0.0, 0.0, 0.0), force)


def friction_in(p: Params, u: Inputs, o: Outputs) -> float:
    """Friction in the outputs, for a chain with effects."""
    return o.F


def with_friction(p: Params, u: Inputs, o: Outputs, f: float) -> Outputs:
    """Outputs with the friction force ``f`` instead."""
    torque = p.R * f
    return Outputs(f, u.tau_in - torque, u.tau_load + torque, torque * u.v)


ROLES = Roles(
    motion="x",
    load="tau_load",
    # on a too: where its sign changes, Eq (7) jumps; an acceleration that answers to that closes an algebraic loop
    depends={
        "F": ("x", "v", "a"),
        "tau_out": ("x", "v", "a", "tau_in"),
        "tau_drive": ("x", "v", "a", "tau_load"),
        "P_loss": ("x", "v", "a"),
    },
    friction=FrictionPort("F", friction_in, with_friction, scale="force_scale"),
)
