"""Effects that hide behind each other: beside one of them another one may only correct the form of its law.

Source: effects.md 2, "Pairs that hide behind each other".
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from ...kernels.chain import id_of

FAMILIES = (
    ("inertia", "stiffness_hardening", "creep"), ("delay", "sensor_lag"), ("delay", "backlash"),
    ("backlash", "tendon_elasticity"), ("backlash", "presliding_shape"), ("offset_drift", "direction_asymmetry"),
    ("stribeck", "breakaway_ageing"), ("thermal", "wear", "load_dependence"),
    ("drum_periodic", "stiffness_hardening"), ("nonlocal_memory", "tendon_elasticity"),
)  # fmt: skip
PAIRS = frozenset(frozenset(pair) for family in FAMILIES for pair in combinations(family, 2))


def looks_like(spec: str, others: Iterable[str]) -> bool:
    """Whether an effect hides behind one of others; each as ``id`` or ``id@channel``."""
    return any(frozenset((id_of(spec), id_of(other))) in PAIRS for other in others)
