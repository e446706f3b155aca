"""Parameters of the sliding level in `friction_branches`, declared once for the three single-tendon models.

The models differ in units (force over metres in IFToMM and ICINCO 2013, pure numbers over radians in MMT 2015) and in
the numbers of their equations; names, meanings and bounds are the same.
"""

from typing import Annotated

from ..contract import Quantity

HeldSign = Annotated[float, Quantity("1", "last non-zero sign of a")]
"""State: the branch last taken is kept at a = 0."""


def pull_constant(unit: str, where: str) -> Quantity:
    return Quantity(unit, f"constant part of the pull level, {where}", lo=0.0)


def release_constant(unit: str, where: str, open_lo: bool = False) -> Quantity:
    return Quantity(unit, f"constant part of the release level, {where}", lo=0.0, open_lo=open_lo)


def pull_decaying(unit: str) -> Quantity:
    return Quantity(unit, "part of the pull level that decays with speed")


def pull_growing(unit: str) -> Quantity:
    return Quantity(unit, "part of the pull level that grows with acceleration")


def release_split(unit: str) -> Quantity:
    return Quantity(unit, "half distance of the release branches at v = 0")


def decay(unit: str, what: str) -> Quantity:
    return Quantity(unit, f"decay of {what}", lo=0.0)


def pull_widening(unit: str) -> Quantity:
    return Quantity(unit, "widening of f1 with acceleration", lo=0.0)


def pull_growth(unit: str) -> Quantity:
    return Quantity(unit, "growth of mu2 with acceleration", lo=0.0)


def release_scale(unit: str) -> Quantity:
    return Quantity(unit, "acceleration scale of f2", lo=0.0, open_lo=True)
