"""Friction of a single tendon-sheath mechanism: modified LuGre model with branched sliding level.

Do, Tjahjowidodo, Lau, Phee, Mech. Mach. Theory 85 (2015), Eqs (5)-(13), on the pulley angle::

    dzeta/dt = rho (w - |w| (zeta/S) |zeta/S|),   w = v + lambda sgn(a)                 (5)
    S = rho1 + mu1 exp(-f1)                                     v >= 0, a >= 0          (7)
    S = rho1 + mu1 exp(-f1) + mu2 (1 - exp(-kappa3 |a|))        v >= 0, a <= 0          (8)
    S = rho2 + mu3 exp(-f2)                                     v <= 0, a < 0           (10)
    S = rho2 - mu3 exp(-f2)                                     v <= 0, a > 0           (11)
        f1 = kappa1 |v| / (kappa2 |a| + 1),   f2 = kappa4 |v| / (|a| + kappa5)
    F = sigma0 zeta                                                                     (13)

|S| stands for S: the same wherever S > 0. As printed S is negative on one release branch when rho2 <= |mu3|, as the
published set has it; (5) is then dzeta/dt = -rho |w| (1 + zeta^2/S^2), which escapes to infinity after ::

    t_esc = |S| / (rho |w|) (pi/2 - atan(|zeta_0/S|))                                   (5a)

so ``literal = 1`` is refused there. Eq (9) contradicts (10) and (11); these are used. At a = 0 the branch last taken is
kept: (12), S = rho2, would be a glitch of nearly no friction; it holds before any acceleration. ``swap_branches`` gives
(7) to a <= 0 and (8) to a >= 0, the order of IFToMM and ICINCO 2013: the paper's own LuGre comparison favours
it, the tension in pulling favours the print; not settled. At rest (v = a = 0) w = 0: friction does not creep.

With w and S held over a step, y = sgn(w) zeta/|S| obeys dy/dq = 1 - y |y|, q = rho |w| dt / |S|, exactly::

    y < 0: tan(q + atan y), up to y = 0;  0 <= y < 1: tanh(q + atanh y);  y > 1: coth(q + acoth y)      (5b)

Continuity at a = 0: exact for v > 0; for v < 0, |S| jumps (by 2 rho2 at rest), zeta and F never do.

Validity: rho1 + min(mu1, 0) + min(mu2, 0) > 0 and rho2 > 0, rho2 != |mu3|; then |zeta| <= max(|zeta_0|, sup |S|). With
rho2 < |mu3|, S reaches 0 at |v| = (|a| + kappa5) ln(|mu3|/rho2) / kappa4: the step then fails. lambda != 0 moves the
reversal of friction off that of v (lead for lambda > 0), so that F v < 0 is then no sign of an error.
"""

import math
from typing import Annotated, NamedTuple

from .contract import Condition, DefaultExperiment, Preset, Quantity, Roles
from .laws.friction_branches import PULL_OPPOSES, pull_level, release_level
from .laws.signs import held_sign
from .laws.single_tsm_parameters import (
    HeldSign,
    decay,
    pull_constant,
    pull_decaying,
    pull_growing,
    pull_growth,
    pull_widening,
    release_constant,
    release_scale,
    release_split,
)
from .laws.tension import DEPENDS, FRICTION, LoadTension, MeasuredTension, Outputs, tensions

__all__ = [
    "CONDITIONS",
    "NAME",
    "PRESETS",
    "ROLES",
    "Inputs",
    "Outputs",
    "Params",
    "State",
    "escape_time",
    "sliding_level",
    "start",
    "step",
]

NAME = "SingleTsmLuGre"


class Params(NamedTuple):
    rho1: Annotated[float, pull_constant("1", "Eqs (7), (8)")] = 2.8642
    rho2: Annotated[float, release_constant("1", "Eqs (10), (11)", open_lo=True)] = 0.072
    mu1: Annotated[float, pull_decaying("1")] = -1.772
    mu2: Annotated[float, pull_growing("1")] = 0.342
    mu3: Annotated[float, release_split("1")] = 0.9991
    kappa1: Annotated[float, decay("s/rad", "mu1 with speed, f1")] = 0.084
    kappa2: Annotated[float, pull_widening("s2/rad")] = 0.4104
    kappa3: Annotated[float, pull_growth("s2/rad")] = 9.345
    kappa4: Annotated[float, decay("1/s", "mu3 with speed, f2")] = 0.1704
    kappa5: Annotated[float, release_scale("rad/s2")] = 1.1823
    lambda_: Annotated[float, Quantity("rad/s", "offset of the friction reversal, Eq (5)")] = 0.156
    rho: Annotated[float, Quantity("1/rad", "presliding rate, Eq (5)", lo=0.0, open_lo=True)] = 7.938
    sigma0: Annotated[float, Quantity("N", "force of a unit deflection, Eq (13)", lo=0.0, open_lo=True)] = 5.038
    swap_branches: Annotated[
        int,
        Quantity(
            "1", "0: mu2 acts for a <= 0 as in Eq (8), 1: for a >= 0", lo=0, hi=1, choices=("as_in_Eq_8", "swapped")
        ),
    ] = 0
    R: Annotated[float, Quantity("m", "pulley radius, for P_loss only", lo=0.0, open_lo=True, display="mm")] = 0.025
    literal: Annotated[
        int, Quantity("1", "1: accept only where S > 0 as printed, Eqs (10), (11)", lo=0, hi=1, choices=("off", "on"))
    ] = 0
    zeta_0: Annotated[float, Quantity("1", "deflection at the start (ours)")] = 0.0


class State(NamedTuple):
    zeta: Annotated[float, Quantity("1", "average deflection, Eq (5)")]
    sgn_a: HeldSign


class Inputs(NamedTuple):
    v: Annotated[float, Quantity("rad/s", "pulley speed, pull positive")]
    a: Annotated[float, Quantity("rad/s2", "pulley acceleration")]
    T_in: MeasuredTension
    T_load: LoadTension


_PRINTED = {
    "rho1": (2.8642, "1"),
    "rho2": (0.072, "1"),
    "mu1": (-1.772, "1"),
    "mu2": (0.342, "1"),
    "mu3": (0.9991, "1"),
    "kappa1": (0.084, "s/rad"),
    "kappa2": (0.4104, "s2/rad"),
    "kappa3": (9.345, "s2/rad"),
    "kappa4": (0.1704, "1/s"),
    "kappa5": (1.1823, "rad/s2"),
    "lambda": (0.156, "rad/s"),
    "rho": (7.938, "1/rad"),
    "sigma0": (5.038, "N"),
}
_SOURCE = "MMT 2015, Section 5, with |S| for S; R is not published, 25 mm is the pulley of MSSP 2015; "

PRESETS = {
    "published": Preset(source=_SOURCE + "pull branches in the printed order", printed=_PRINTED, si={}),
    "swapped": Preset(
        source=_SOURCE + "pull branches in the order of IFToMM and ICINCO 2013",
        printed=_PRINTED,
        si={"swap_branches": 1},
    ),
}


def escape_time(S: float, rho: float, w: float, zeta_0: float) -> float:
    """Time [s] in which Eq (5) as printed with S <= 0 takes ``zeta_0`` of the sign of -1 to infinity, Eq (5a)."""
    return abs(S) / (rho * abs(w)) * (0.5 * math.pi - math.atan2(abs(zeta_0), abs(S)))


def least_release_level(p: Params) -> float:
    """Least S over every v <= 0 and a, at rest."""
    return p.rho2 - abs(p.mu3)


def distance_from_zero(p: Params) -> float:
    """|S| at rest on the lower release branch."""
    return abs(least_release_level(p))


def least_literal_level(p: Params) -> float:
    """Least S where it is taken as printed."""
    return least_release_level(p) if p.literal == 1 else math.inf


def escape_from_rest(p: Params) -> float:
    """t_esc from zeta = 0 at |w| = 1 rad/s [s]."""
    return escape_time(least_release_level(p), p.rho, 1.0, 0.0)


def escape_from_sliding(p: Params) -> float:
    """t_esc out of sliding on the other branch at |w| = 1 rad/s [s]."""
    return escape_time(least_release_level(p), p.rho, 1.0, p.rho2 + abs(p.mu3))


CONDITIONS = (
    PULL_OPPOSES,
    Condition(
        "rho2 != |mu3|, Eq (5) divides by S",
        distance_from_zero,
        "rho2 = {rho2!r} with mu3 = {mu3!r} makes S = 0 at every reversal to v < 0",
        "change rho2 or mu3",
    ),
    Condition(
        "rho2 > |mu3|",
        least_literal_level,
        "literal = 1 with rho2 = {rho2!r} and mu3 = {mu3!r} makes S as low as {margin:.5g} for v < 0, where "
        "zeta escapes to infinity: t_esc = {rest:.4f} s from zeta = 0 and {sliding:.4f} s out of sliding, at "
        "|w| = 1 rad/s (MMT 2015, Eqs (5), (10))",
        "use |S| (literal = 0) or raise rho2",
        numbers={"rest": escape_from_rest, "sliding": escape_from_sliding},
    ),
)


def sliding_level(p: Params, v: float, a: float, sgn_a: float) -> float:
    """Sliding level |S| of zeta, Eqs (7), (8), (10), (11); ``sgn_a`` is the held sign of ``a``.

    Raises
    ------
    ValueError
        If S has reached 0 on the release side.
    """
    if v >= 0.0:
        mu2 = p.mu2 if (sgn_a > 0.0 if p.swap_branches == 1 else sgn_a < 0.0) else 0.0
        return pull_level(v, a, p.rho1, p.mu1, mu2, p.kappa1, p.kappa2, p.kappa3)
    level = release_level(v, a, sgn_a, p.rho2, p.mu3, p.kappa4, p.kappa5)
    if level * (p.rho2 - sgn_a * p.mu3) <= 0.0:  # the sign it has at rest
        raise ValueError(
            "sliding level S reached 0 for v < 0 -- expected |v| < (|a| + kappa5) ln(|mu3|/rho2)/kappa4 "
            "-- lower the speed or raise rho2 above |mu3|"
        )
    return abs(level)


def deflection_ratio_after(y: float, q: float) -> float:
    """Solution of dy/dq = 1 - y |y| after ``q`` >= 0, Eq (5b)."""
    if y < 0.0:
        to_zero = -math.atan(y)
        if q < to_zero:
            return math.tan(q - to_zero)
        return math.tanh(q - to_zero)
    t = math.tanh(q)
    return (y + t) / (1.0 + y * t)  # addition theorem: one form on both sides of 1


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(p.zeta_0, held_sign(u.a, 0.0)), tensions(p.sigma0 * p.zeta_0, p.R * u.v, u.T_in, u.T_load)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    sgn_a = held_sign(u.a, s.sgn_a)
    w = u.v + p.lambda_ * sgn_a if u.v != 0.0 or u.a != 0.0 else 0.0  # at rest the print's sgn(0) = 0
    zeta = s.zeta
    if w != 0.0:
        level = math.copysign(sliding_level(p, u.v, u.a, sgn_a), w)
        zeta = level * deflection_ratio_after(zeta / level, p.rho * w * dt / level)  # (5b)
    return State(zeta, sgn_a), tensions(p.sigma0 * zeta, p.R * u.v, u.T_in, u.T_load)  # (13)


def with_friction(p: Params, u: Inputs, o: Outputs, f: float) -> Outputs:
    """The outputs with friction ``f`` instead."""
    return tensions(f, p.R * u.v, u.T_in, u.T_load)


ROLES = Roles(
    load="T_load",
    initial=("zeta_0",),
    depends=DEPENDS,
    friction=FRICTION._replace(write=with_friction),
    experiment=DefaultExperiment(20.0, 2e-3),
)
