"""Friction of a single tendon-sheath mechanism: Dahl model with branched sliding level.

Do, Tjahjowidodo, Lau, Phee, ICINCO 2013, Eqs (2)-(5)::

    F_f = rho1 + mu1 exp(-f1)                                   v >= 0, a <= 0          (2a)
    F_f = rho1 + mu1 exp(-f1) + mu2 (1 - exp(-kappa3 |a|))      v >= 0, a >= 0          (2b)
    F_f = rho2 + mu3 exp(-f2)                                   v <= 0, a <= 0          (2c)
    F_f = rho2 - mu3 exp(-f2)                                   v <= 0, a >= 0          (2d)
          f1 = kappa1 |v| / (kappa2 |a| + 1),   f2 = kappa4 |v| / (|a| + kappa5)
    dzeta/dt = v - sigma |v| zeta / F_f                                                 (4)
    F = sigma zeta                                                                      (5)

At a = 0 the branch last taken is kept. With v and a held over a step, s = sgn(v), the step is exact::

    zeta = s F_f/sigma + (zeta_0 - s F_f/sigma) exp(-sigma |v| dt / F_f)                (4a)

so there is no limit on its size, and it is exact in displacement where F_f is constant. The text says that
zeta settles at the sliding force; by (4) it is sigma zeta that does.

Continuity at a = 0: exact for v > 0; for v < 0, F_f jumps by 2 |mu3| exp(-kappa4 |v| / kappa5), F never does.

Validity: inf F_f > 0, that is rho1 + min(mu1, 0) + min(mu2, 0) > 0 and rho2 > |mu3|; then
|F| <= max(|F at the start|, sup F_f) for every input.
"""

from typing import Annotated, NamedTuple

from .contract import Condition, DefaultExperiment, Preset, Quantity, Roles
from .laws.friction_branches import PULL_OPPOSES, pull_level, release_level
from .laws.lugre import bristle_after
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
from .laws.tension import DEPENDS, FRICTION, Inputs, Outputs, tensions

__all__ = [
    "CONDITIONS",
    "NAME",
    "PRESETS",
    "ROLES",
    "Inputs",
    "Outputs",
    "Params",
    "State",
    "sliding_force",
    "start",
    "step",
]

NAME = "SingleTsmDahl"
ROLES = Roles(
    load="T_load",
    initial=("zeta_0",),
    depends=DEPENDS,
    friction=FRICTION,
    experiment=DefaultExperiment(20.0, 2e-3),
)


class Params(NamedTuple):
    rho1: Annotated[float, pull_constant("N", "Eqs (2a), (2b)")] = 2.097
    rho2: Annotated[float, release_constant("N", "Eqs (2c), (2d)")] = 3.960
    mu1: Annotated[float, pull_decaying("N")] = 1.368
    mu2: Annotated[float, pull_growing("N")] = 1.579
    mu3: Annotated[float, release_split("N")] = -1.855
    kappa1: Annotated[float, decay("s/m", "mu1 with speed, f1")] = 172.0
    kappa2: Annotated[float, pull_widening("s2/m")] = 1228.0
    kappa3: Annotated[float, pull_growth("s2/m")] = 16.0
    kappa4: Annotated[float, decay("1/s", "mu3 with speed, f2")] = 5.549
    kappa5: Annotated[float, release_scale("m/s2")] = 5e-6
    sigma: Annotated[float, Quantity("N/m", "presliding stiffness", lo=0.0, open_lo=True)] = 17570.0
    zeta_0: Annotated[float, Quantity("m", "presliding state at the start (ours)", display="mm")] = 0.0


class State(NamedTuple):
    zeta: Annotated[float, Quantity("m", "presliding state, Eq (4)")]
    sgn_a: HeldSign


PRESETS = {
    "published": Preset(
        source="ICINCO 2013, Table 1; lengths are millimetres",
        printed={
            "rho1": (2.097, "N"),
            "rho2": (3.960, "N"),
            "mu1": (1.368, "N"),
            "mu2": (1.579, "N"),
            "mu3": (-1.855, "N"),
            "kappa1": (0.172, "s/mm"),
            "kappa2": (1.228, "s2/mm"),
            "kappa3": (0.016, "s2/mm"),
            "kappa4": (5.549, "1/s"),
            "kappa5": (0.005, "mm/s2"),
            "sigma": (17.57, "N/mm"),
        },
        si={},
    )
}


def least_release_force(p: Params) -> float:
    """Least sliding force over every v <= 0 and a [N]."""
    return p.rho2 - abs(p.mu3)


CONDITIONS = (
    PULL_OPPOSES,
    Condition(
        "rho2 - |mu3| > 0, else friction drives the motion",
        least_release_force,
        "rho2 = {rho2!r} with mu3 = {mu3!r} lets the sliding level of v <= 0 fall to {margin!r}",
        "raise rho2",
    ),
)


def sliding_force(p: Params, v: float, a: float, sgn_a: float) -> float:
    """Friction force F_f [N] of steady sliding, Eqs (2a)-(2d); ``sgn_a`` is the held sign of ``a``."""
    if v >= 0.0:
        mu2 = p.mu2 if sgn_a > 0.0 else 0.0
        return pull_level(v, a, p.rho1, p.mu1, mu2, p.kappa1, p.kappa2, p.kappa3)
    return release_level(v, a, sgn_a, p.rho2, p.mu3, p.kappa4, p.kappa5)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(p.zeta_0, held_sign(u.a, 0.0)), tensions(p.sigma * p.zeta_0, u.v, u.T_in, u.T_load)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    sgn_a = held_sign(u.a, s.sgn_a)
    zeta = bristle_after(s.zeta, u.v, dt, sliding_force(p, u.v, u.a, sgn_a) / p.sigma)  # (4a)
    return State(zeta, sgn_a), tensions(p.sigma * zeta, u.v, u.T_in, u.T_load)  # (5)
