"""Units of FMUs and system descriptions: what they mean, and how a value goes from one to another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..logs.units import UnitToSI, unit_to_si
from ..models.contract import InputError

Definitions = Mapping[str, Any]
"""A file's own units by name: objects with the exponents kg, m, s, A, K, mol, cd, rad, and factor and offset."""

_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def meaning(unit: str, definitions: Definitions) -> UnitToSI | None:
    """What a unit is in SI: by its name, or as the file that uses it defines it; None if neither says.

    The name goes first: definitions without any exponent stand for names that their tool does not know either.
    """
    try:
        return unit_to_si(unit)
    except InputError:
        own = definitions.get(unit)
    if own is None:
        return None
    base = tuple(sorted((name, float(power)) for name in _EXPONENTS if (power := int(getattr(own, name) or 0))))
    return UnitToSI(unit, float(own.factor), float(own.offset), base) if base else None


def conversion(
    source: str, target: str, what: str, definitions: tuple[Definitions, Definitions], *, any_to_one: bool = True
) -> tuple[float, float]:
    """Scale and shift of a value on its way from one unit to another.

    Parameters
    ----------
    source, target : str
        The units.
    what : str
        Begin of the message where they do not fit: ``connection a.y -> b.u joins``.
    definitions : tuple of mappings
        Units that the file of each side defines itself.
    any_to_one : bool
        Whether ``1`` takes and gives any unit unchanged, as the sums of other tools declare it.

    Raises
    ------
    InputError
        If they do not convert into each other.
    """
    if source == target or (any_to_one and "1" in (source, target)):
        return 1.0, 0.0
    here, there = meaning(source, definitions[0]), meaning(target, definitions[1])
    if here is not None and there is not None and here.base == there.base:
        return here.factor / there.factor, (here.offset - there.offset) / there.factor
    raise InputError(
        f"{what} [{source}] to [{target}] -- expected units that convert into each other -- choose another "
        "variable, or switch this unit conversion off and state a factor"
    )
