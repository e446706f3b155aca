"""Unit texts as people and FMI write them, understood by pint and brought to SI.

pint takes the radian as a pure number, so that it would turn 1 Hz into 1 rad/s and compare a gain with an
angle. Here the radian counts as a base unit: ``deg`` and ``rpm`` convert, ``Hz`` for an angular speed is refused.
"""

from __future__ import annotations

import math
import os
import re
import shutil
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from ..kernels.compiled_cache import cache_root
from ..models.contract import InputError
from ..models.unit_text import written

if TYPE_CHECKING:
    from pint import UnitRegistry

__all__ = ["UnitToSI", "read_unit", "same_quantity", "unit_to_si"]

# Texts that pint reads as something no rig measures, or that mean different things to different people.
_AMBIGUOUS = {
    "C": "degC for a temperature, A.s for a charge",
    "F": "degF for a temperature, N for a force",
    "M": "m for metres",
    "rps": "turn/s or rad/s",
    "cps": "1/s or turn/s",
    "lb.in": "lbf.in", "lb.ft": "lbf.ft", "lb-in": "lbf.in", "lb-ft": "lbf.ft", "in.lb": "lbf.in", "in-lb": "lbf.in",
    "oz.in": "ozf.in", "oz-in": "ozf.in", "in.oz": "ozf.in",
    "kg.m": "kgf.m or N.m", "kg.cm": "kgf.cm", "kg-cm": "kgf.cm", "kg.mm": "kgf.mm", "g.cm": "gf.cm",
    "kg*m": "kgf.m or N.m", "kg*cm": "kgf.cm", "kg cm": "kgf.cm", "kg*mm": "kgf.mm", "oz*in": "ozf.in",
}  # fmt: skip
# The coherent SI unit that keeps the sort of quantity readable: lbf.in becomes N.m, not kg.m2/s2.
_COHERENT = (
    "N",
    "Pa",
    "W",
    "J",
    "V",
    "ohm",
    "C",
    "F",
    "H",
    "T",
    "Wb",
    "Hz",
    "kg",
    "m",
    "rad",
    "s",
    "A",
    "K",
    "mol",
    "cd",
)
_LONGEST = 60
# pint computes what is written: a tower of powers would keep it busy for ever
_POWER = re.compile(
    r"(?<![\d.])\*\*\s*(\(\s*[-+]?\d{1,2}\s*(/\s*\d{1,2}\s*)?\)|[-+]?\d{1,2}(\.\d{1,3})?)(?![\d.]|\s*\*\*)"
)
_SCALED = re.compile(
    r"^(?P<over>[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?)(\s*/\s*(?P<under>(\d+\.?\d*|\.\d+)(e[-+]?\d+)?))?\s+(?P<unit>\S.*)$",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class UnitToSI:
    """How a unit text becomes SI: ``si = factor * value + offset``.

    Attributes
    ----------
    si : str
        Coherent SI unit as FMI writes it (``"N.m"``, ``"rad/s2"``).
    factor, offset : float
        The conversion; the offset is not zero for temperatures only.
    base : tuple of (str, float)
        Exponents of kg, m, s, A, K, mol, cd and rad: two quantities can be compared when these are equal.
    """

    si: str
    factor: float
    offset: float
    base: tuple[tuple[str, float], ...]


@cache
def unit_to_si(text: str) -> UnitToSI:
    """Read a unit as FMI (``m/s2``), pint (``m/s**2``) or people (``Nm``, ``rad/s^2``, ``N·m``, ``µm``) write it.

    Raises
    ------
    InputError
        If pint does not know the unit, or it means different things to different people.
    """
    plain = text.strip()
    if plain in _AMBIGUOUS:
        raise InputError(f"unit {plain!r} -- expected one meaning -- write {_AMBIGUOUS[plain]}")
    registry = _registry()
    try:
        if not plain or len(plain) > _LONGEST:
            raise ValueError("length")
        written = _pint_text(plain)
        if "**" in _POWER.sub("", written):
            raise ValueError("power")
        unit = registry.parse_units(written)
        at_zero, at_one, at_two = (float(registry.Quantity(x, unit).to_base_units().magnitude) for x in (0.0, 1.0, 2.0))
        if abs(at_two - 2.0 * at_one + at_zero) > 1e-9 * abs(at_one):
            raise ValueError("logarithmic")
        _, base = registry.get_base_units(unit)
    except Exception as unknown:  # pint raises over a dozen types, from tokenising to dimensions
        raise InputError(
            f"unit {plain[:_LONGEST]!r} -- expected a unit that pint knows, such as rad, deg, rad/s, N, N.m, mm, ms "
            "(1 for a pure number) -- correct the unit"
        ) from unknown
    exponents = {f"{registry.Unit(name):~}": _real(power) for name, power in base._units.items()}
    return UnitToSI(
        si=_coherent(unit) if at_zero == 0.0 else "K",
        factor=at_one - at_zero,
        offset=at_zero,
        base=tuple(sorted(exponents.items())),
    )


def read_unit(text: str) -> UnitToSI:
    """A unit as `unit_to_si` reads it, or with a factor before it: counts of ``0.0314 deg`` or ``360/4096 deg``.

    Raises
    ------
    InputError
        As `unit_to_si`, or a factor that is 0 or not finite.
    """
    found = _SCALED.match(text.strip())
    if not found:
        return unit_to_si(text)
    unit, under = unit_to_si(found["unit"]), float(found["under"] or 1.0)
    factor = float(found["over"]) / under if under else math.inf
    if not math.isfinite(factor) or factor == 0.0:
        raise InputError(f"unit {text!r} -- expected a finite factor other than 0 -- for example 360/4096 deg")
    return replace(unit, factor=unit.factor * factor)


def same_quantity(a: str, b: str) -> bool:
    """Whether two units measure the same sort of quantity, the radian being a base unit."""
    return unit_to_si(a).base == unit_to_si(b).base


@cache
def _registry() -> UnitRegistry:
    """Pint's units, from what an earlier process has read of their definitions: that takes a third of a second."""
    import pint  # it too: only those who read units pay

    root = cache_root()
    if root is None:
        return pint.UnitRegistry()
    folder = root / f"units-{pint.__version__}"
    try:
        if not folder.is_dir():
            root.mkdir(parents=True, exist_ok=True)
            with TemporaryDirectory(dir=root) as scratch:  # whole, or not there: another process may read it at once
                pint.UnitRegistry(cache_folder=f"{scratch}/made")
                with suppress(OSError):  # another was first
                    os.replace(f"{scratch}/made", folder)
        return pint.UnitRegistry(cache_folder=folder)
    except Exception:  # damaged, or not to be written: whatever unpickling meets, the definitions themselves are there
        shutil.rmtree(folder, ignore_errors=True)
        return pint.UnitRegistry()


def _pint_text(text: str) -> str:
    """FMI and typographic forms in pint's notation."""
    if text in ("-", "1"):
        return "dimensionless"
    text = re.sub("[·⋅]", "*", text).replace("^", "**")
    # pint's own "Nm" is the textile unit number metre, which no rig measures
    text = re.sub(r"\b([kMmuµμ]?N)(mm|cm|m)\b", r"\1*\2", text)
    text = re.sub(r"(?<=[A-Za-z\d)°])\.(?=[A-Za-zµμ°(Ω])", "*", text)  # N.m
    text = re.sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", "*", text)  # N-m
    text = re.sub(r"\)(-?\d)(?![\d.])", r")**\1", text)  # (m/s)2
    return re.sub(r"\b(mm|cm|km|um|m|s|ms|rad|deg|kg|g|A|N|K|V)(-?\d)\b", r"\1**\2", text)  # m/s2


def _coherent(unit: Any) -> str:
    registry = _registry()
    sorts = _coherent_units()
    powers: dict[str, float] = {}
    for name, power in unit._units.items():
        _, base = registry.get_base_units(name)
        if not base._units:
            continue
        symbol = sorts.get(base._units)
        parts = {symbol: 1.0} if symbol else {f"{registry.Unit(n):~}": _real(p) for n, p in base._units.items()}
        for part, exponent in parts.items():
            powers[part] = powers.get(part, 0.0) + exponent * _real(power)
    return written(dict(sorted(powers.items(), key=lambda item: _rank(item[0]))))


@cache
def _coherent_units() -> dict[Any, str]:
    registry = _registry()
    sorts: dict[Any, str] = {}
    for symbol in _COHERENT:
        _, base = registry.get_base_units(registry.parse_units(symbol))
        sorts[base._units] = symbol
    return sorts


def _real(power: Any) -> float:
    return float(power)


def _rank(symbol: str) -> tuple[int, str]:
    return (_COHERENT.index(symbol) if symbol in _COHERENT else len(_COHERENT), symbol)
