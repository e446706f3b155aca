"""The unit in which people read a quantity: deg for rad, mm for what is no metre, mN where a force is small."""

from __future__ import annotations

import math
from dataclasses import dataclass

_PREFERRED = {"rad": ("deg", 180.0 / math.pi), "m": ("mm", 1e3), "H": ("mH", 1e3)}
_MILLI = ("N.m", "N")
SMALL = 0.1
"""Size below which a torque or force is shown in mN.m or mN."""

METRE = 2.0
"""Length or speed [SI] from which m is shown and not mm."""


@dataclass(frozen=True)
class Display:
    """A unit to show and the factor from SI to it."""

    unit: str
    factor: float

    def __call__(self, value: float, digits: int = 3) -> str:
        """The number with its unit."""
        number = f"{float(f'{value * self.factor:.{digits}g}'):g}"  # 370, not 3.7e+02
        return number if self.unit == "1" else f"{number} {self.unit}"


def display(unit: str, size: float = math.inf) -> Display:
    """How to show values of an SI unit.

    Parameters
    ----------
    unit : str
        ``rad``, ``m/s``, ``N.m`` and the like.
    size : float
        Typical magnitude in SI; without it no prefix is chosen.
    """
    head, slash, tail = unit.partition("/")
    if head in _PREFERRED and not (head == "m" and METRE <= abs(size) < math.inf):
        name, factor = _PREFERRED[head]
        return Display(f"{name}{slash}{tail}", factor)
    if unit in _MILLI and abs(size) < SMALL:
        return Display(f"m{unit}", 1e3)
    return Display(unit, 1.0)
