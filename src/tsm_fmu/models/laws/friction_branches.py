"""Sliding level of a single tendon in its sheath: separate branches for speeding up and slowing down.

The level that friction settles at while the tendon slides depends on the sign of the acceleration. The
three papers share one form for the pull side (v >= 0) and one for the release side (v <= 0)::

    G_pull    = rho1 + mu1 exp(-f1) [+ mu2 (1 - exp(-kappa3 |a|))],  f1 = kappa1 |v| / (kappa2 |a| + 1)
    G_release = level - sgn(a) mu exp(-f2),                          f2 = kappa_v |v| / (|a| + kappa_a)

Sources: IFToMM 2013 Eq (1), ICINCO 2013 Eqs (2a)-(2d), MMT 2015 Eqs (6)-(12). The papers define both
branches at a = 0; here the branch last taken is kept, so that a sampled a = 0 is not a glitch (MMT
Eq (12) as printed would be one). Before any acceleration the release side is at its mean, ``level``.
"""

import math
from typing import Any

from ..contract import Condition


def pull_level(
    v: float, a: float, rho1: float, mu1: float, mu2: float, kappa1: float, kappa2: float, kappa3: float
) -> float:
    """Sliding level for v >= 0; ``mu2 = 0`` gives the branch without the last term."""
    f1 = kappa1 * abs(v) / (kappa2 * abs(a) + 1.0)
    return rho1 + mu1 * math.exp(-f1) - mu2 * math.expm1(-kappa3 * abs(a))


def release_level(v: float, a: float, sgn_a: float, level: float, mu: float, kappa_v: float, kappa_a: float) -> float:
    """Sliding level for v <= 0, on the branch of the held sign ``sgn_a`` of the acceleration."""
    return level - sgn_a * mu * math.exp(-kappa_v * abs(v) / (abs(a) + kappa_a))


def least_pull_level(p: Any) -> float:
    """Least sliding level over every v >= 0 and a."""
    return p.rho1 + min(p.mu1, 0.0) + min(p.mu2, 0.0)


PULL_OPPOSES = Condition(
    "rho1 + min(mu1, 0) + min(mu2, 0) > 0, else friction drives the motion",
    least_pull_level,
    "rho1 = {rho1!r} with mu1 = {mu1!r} and mu2 = {mu2!r} lets the sliding level of v >= 0 fall to {margin!r}",
    "raise rho1",
)
