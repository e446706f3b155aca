"""Friction of a single tendon-sheath mechanism: Bouc-Wen model with branched sliding level.

Do, Tjahjowidodo, Lau, Phee, IFToMM ISRM 2013, Eqs (1)-(4)::

    F_f = rho1 + mu1 exp(-f1)                                           v >= 0, a <= 0  (1a)
    F_f = rho1 + mu1 exp(-f1) + mu2 (1 - exp(-kappa3 |a|))              v >= 0, a >= 0  (1b)
    F_f = rho2 + mu3 exp(-kappa4 |v|) + mu4 exp(-f2)                    v <= 0, a <= 0  (1c)
    F_f = rho2 + mu3 exp(-kappa4 |v|) - mu4 exp(-f2)                    v <= 0, a >= 0  (1d)
          f1 = kappa1 |v| / (kappa2 |a| + 1),   f2 = kappa5 |v| / (|a| + kappa6)
    dzeta/dt = k (v - sigma |v| |r|^(n-1) r + (sigma - 1) v |r|^n),   r = zeta/F_f      (2)
    F = zeta                                                                            (3)

F_f is a magnitude, positive on both sides: with a negative one for v < 0 the equilibrium of (2) is lost and F
runs away. At a = 0 the branch last taken is kept. With v and a held over a step, (2) is the normalised
Bouc-Wen equation along the travel k v dt / F_f, solved in `bouc_wen` for any step, to 1e-7 of F_f.

The published numbers have lost symbols and signs in print. mu1 is negative and kappa1 a decay (MMT 2015 Fig. 4
prints ten times the same set with its signs); the signs of mu3 and mu4 are open; the last two numbers,
5.491 and 2.952, can be (k =) 1, sigma, n (`published`, the only one for which the paper's storage F^2/2 fits its
Proposition 3), k, sigma (`reading_b`, n = 1) or k, n (`reading_c`, sigma = 1). They nearly coincide in
sliding. The force unit is uncertain by a factor of 10.

Continuity at a = 0: exact for v > 0; for v < 0, F_f jumps by 2 |mu4| exp(-kappa5 |v| / kappa6), F never does.
Dissipation: F v >= d/dt (F^2 / (2 k)) for sigma >= 1/2 (Proposition 3 with the storage that fits the slope k).

Validity: k > 0, sigma >= 1/2, n >= 1 and inf F_f > 0; then |F| <= max(|F at the start|, sup F_f).
"""

import math
from typing import Annotated, NamedTuple

from .contract import Condition, DefaultExperiment, Preset, Quantity, Roles
from .laws.bouc_wen import bouc_wen_after
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

NAME = "SingleTsmBoucWen"
ROLES = Roles(
    load="T_load",
    initial=("zeta_0",),
    depends=DEPENDS,
    friction=FRICTION,
    experiment=DefaultExperiment(20.0, 2e-3),
)


class Params(NamedTuple):
    rho1: Annotated[float, pull_constant("N", "Eqs (1a), (1b)")] = 0.8855
    rho2: Annotated[float, release_constant("N", "Eqs (1c), (1d)")] = 1.548
    mu1: Annotated[float, pull_decaying("N")] = -0.6533
    mu2: Annotated[float, pull_growing("N")] = 1.461
    mu3: Annotated[float, Quantity("N", "part of the release level that decays with speed")] = 0.452
    mu4: Annotated[float, release_split("N")] = 0.875
    kappa1: Annotated[float, decay("s/m", "mu1 with speed, f1")] = 341.0
    kappa2: Annotated[float, pull_widening("s2/m")] = 77.7
    kappa3: Annotated[float, pull_growth("s2/m")] = 6.3
    kappa4: Annotated[float, decay("s/m", "mu3 with speed")] = 3329.0
    kappa5: Annotated[float, decay("1/s", "mu4 with speed, f2")] = 5.224
    kappa6: Annotated[float, release_scale("m/s2")] = 5.5e-6
    k: Annotated[float, Quantity("N/m", "presliding stiffness, Eq (2)", lo=0.0, open_lo=True)] = 1000.0
    sigma: Annotated[float, Quantity("1", "shape: 1 + (2 sigma - 1)|r|^n is the unloading slope over k", lo=0.5)] = (
        5.491
    )
    n: Annotated[float, Quantity("1", "sharpness of the transition to sliding", lo=1.0)] = 2.952
    zeta_0: Annotated[float, Quantity("N", "friction force at the start (ours)")] = 0.0


class State(NamedTuple):
    zeta: Annotated[float, Quantity("N", "friction force, Eqs (2), (3)")]
    sgn_a: HeldSign


_PRINTED = {
    "rho1": (0.8855, "N"),
    "rho2": (1.548, "N"),
    "mu1": (-0.6533, "N"),
    "mu2": (1.461, "N"),
    "mu3": (0.452, "N"),
    "mu4": (0.875, "N"),
    "kappa1": (0.341, "s/mm"),
    "kappa2": (0.0777, "s2/mm"),
    "kappa3": (0.0063, "s2/mm"),
    "kappa4": (3.329, "s/mm"),
    "kappa5": (5.224, "1/s"),
    "kappa6": (0.0055, "mm/s2"),
}
_SOURCE = "IFToMM ISRM 2013, page 8; lengths are millimetres, the sign of mu1 is from MMT 2015 Fig. 4; "

PRESETS = {
    "published": Preset(
        source=_SOURCE + "reading A of the two unnamed numbers: sigma, n (k = 1 N/mm)",
        printed={**_PRINTED, "sigma": (5.491, "1"), "n": (2.952, "1")},
        si={},
    ),
    "reading_b": Preset(
        source=_SOURCE + "reading B of the two unnamed numbers: k, sigma (n = 1)",
        printed={**_PRINTED, "k": (5.491, "N/mm"), "sigma": (2.952, "1")},
        si={"k": 5491.0, "sigma": 2.952, "n": 1.0},
    ),
    "reading_c": Preset(
        source=_SOURCE + "reading C of the two unnamed numbers: k, n (sigma is free, here 1)",
        printed={**_PRINTED, "k": (5.491, "N/mm"), "n": (2.952, "1")},
        si={"k": 5491.0, "sigma": 1.0, "n": 2.952},
    ),
}


def least_release_force(p: Params) -> float:
    """Least sliding force over every v <= 0 and a [N]."""
    return p.rho2 + min(p.mu3, 0.0) - abs(p.mu4)


CONDITIONS = (
    PULL_OPPOSES,
    Condition(
        "rho2 + min(mu3, 0) - |mu4| > 0, else friction drives the motion",
        least_release_force,
        "rho2 = {rho2!r} with mu3 = {mu3!r} and mu4 = {mu4!r} lets the sliding level of v <= 0 fall to {margin!r}",
        "raise rho2",
    ),
)


def sliding_force(p: Params, v: float, a: float, sgn_a: float) -> float:
    """Friction force F_f [N] of steady sliding, Eqs (1a)-(1d); ``sgn_a`` is the held sign of ``a``."""
    if v >= 0.0:
        mu2 = p.mu2 if sgn_a > 0.0 else 0.0
        return pull_level(v, a, p.rho1, p.mu1, mu2, p.kappa1, p.kappa2, p.kappa3)
    level = p.rho2 + p.mu3 * math.exp(-p.kappa4 * abs(v))
    return release_level(v, a, sgn_a, level, p.mu4, p.kappa5, p.kappa6)


def start(p: Params, u: Inputs) -> tuple[State, Outputs]:
    return State(p.zeta_0, held_sign(u.a, 0.0)), tensions(p.zeta_0, u.v, u.T_in, u.T_load)


def step(p: Params, s: State, u: Inputs, dt: float) -> tuple[State, Outputs]:
    sgn_a = held_sign(u.a, s.sgn_a)
    level = sliding_force(p, u.v, u.a, sgn_a)
    zeta = level * bouc_wen_after(s.zeta / level, p.k * u.v * dt / level, p.sigma, p.n)  # (2), (3)
    return State(zeta, sgn_a), tensions(zeta, u.v, u.T_in, u.T_load)
