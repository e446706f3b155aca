"""Connectors of an SSP: what a description says of them beside what their FMUs do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmpy.model_description import BaseUnit

from ...models.contract import InputError
from ..conversion import Definitions
from .xml import child, children, number


@dataclass(frozen=True)
class Connector:
    """A connector as stated.

    Attributes
    ----------
    unit : str
        Empty without.
    definitions : mapping
        Units that its file defines.
    kind : str
        As written; empty without.
    items : mapping of str to int
        Of its enumeration, where it states one that its file defines.
    """

    unit: str = ""
    definitions: Definitions = field(default_factory=dict)
    kind: str = ""
    items: Mapping[str, int] = field(default_factory=dict)


SILENT = Connector()
"""One of which a description says nothing."""


@dataclass(frozen=True)
class Scope:
    """What a file defines for all of itself: units, and enumerations with their items."""

    units: Definitions
    enumerations: Mapping[str, Mapping[str, int]]

    def connector(self, node: Any) -> Connector:
        """As a ``Connector`` or ``DictionaryEntry`` states it."""
        unit = next((kind.get("unit") for kind in node if kind.get("unit")), "")
        named = child(node, "Enumeration")
        items = {} if named is None else self.enumerations.get(named.get("name") or "", {})
        return Connector(unit, self.units, node.get("kind") or "", items)


def scope(path: Path, root: Any) -> Scope:
    """The definitions of a file."""
    enumerations = {
        node.get("name") or "": {
            item.get("name") or "": int(item.get("value") or 0)
            for item in children(node, "Item")
            if (item.get("value") or "").lstrip("-").isdecimal()
        }
        for node in children(root, "Enumerations", "Enumeration")
    }
    return Scope(units(path, root), enumerations)


def units(path: Path, root: Any) -> dict[str, Any]:
    """Units that a file defines, by name.

    Raises
    ------
    InputError
        A factor, offset or exponent that is none.
    """
    found: dict[str, Any] = {}
    for unit in children(root, "Units", "Unit"):
        base = child(unit, "BaseUnit")
        if base is not None:
            name = unit.get("name") or ""
            numbers: dict[str, Any] = {k: number(path, v) for k, v in base.attrib.items() if hasattr(BaseUnit(), k)}
            for key, value in numbers.items():
                if key not in ("factor", "offset") and not value.is_integer():
                    raise InputError(
                        f"SSP {path}: unit {name!r} has the exponent {value!r} of {key} -- expected a whole number "
                        "-- export it again"
                    )
            found[name] = BaseUnit(**numbers)
    return found
