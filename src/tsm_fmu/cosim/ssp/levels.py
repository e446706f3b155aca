"""Read the elements of a system description, all levels, as a `Structure`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...models.contract import InputError
from ..conversion import Definitions
from .files import Files
from .parameters import bound, units
from .structure import Edge, Node, Path_, Structure
from .transformations import transformation
from .xml import FMU_TYPE, MAIN, SSD_TYPE, SSP_TYPE, child, children, local, parse

MOST_LEVELS = 50


def read_structure(files: Files, root: Any) -> Structure:
    """Read a system description with all its levels.

    Raises
    ------
    InputError
        Components that are no FMU of the archive, damaged transformations: each named.
    """
    found = Structure(files.path)
    _read_system(found, files, child(root, "System"), (), _Scope(units(root), _enumerations(root)))
    return found


@dataclass(frozen=True)
class _Scope:
    """What a file defines for all of itself: units, and enumerations with their items."""

    units: Definitions
    enumerations: dict[str, dict[str, int]]


def _enumerations(root: Any) -> dict[str, dict[str, int]]:
    return {
        node.get("name") or "": {
            item.get("name") or "": int(item.get("value") or 0)
            for item in children(node, "Item")
            if (item.get("value") or "").lstrip("-").isdecimal()
        }
        for node in children(root, "Enumerations", "Enumeration")
    }


def _read_system(found: Structure, files: Files, node: Any, place: Path_, scope: _Scope) -> None:
    if len(place) > MOST_LEVELS:
        raise InputError(
            f"SSP {found.path}: system {'.'.join(place[:4])}... is nested more than {MOST_LEVELS} times -- expected "
            "no description that holds itself -- export it again"
        )
    found.systems.add(place)
    _read_connectors(found, node, place, scope)
    found.bindings += [(place, p) for p in bound(files, node, scope.units, found.notes)]
    for dictionary in children(node, "SignalDictionaries", "SignalDictionary"):
        _read_dictionary(found, files, dictionary, place, scope.units)
    for element in child(node, "Elements") if child(node, "Elements") is not None else ():
        inner = (*place, element.get("name") or "")
        kind = local(element)
        if kind == "System":
            _read_system(found, files, element, inner, scope)
        elif kind == "Component" and element.get("type") in (SSD_TYPE, SSP_TYPE):
            own, file = _nested(files, element, inner)
            root = parse(found.path, file, "SystemStructureDescription")
            _read_system(found, own, child(root, "System"), inner, _Scope(units(root), _enumerations(root)))
            found.bindings += [(inner, p) for p in bound(files, element, scope.units, found.notes)]
        elif kind == "Component":
            _read_component(found, files, element, inner, scope)
        elif kind == "SignalDictionaryReference":
            found.places[inner] = _dictionary(found, element, place)
    for connection in children(node, "Connections", "Connection"):
        _read_connection(found, connection, place)


def _nested(files: Files, element: Any, place: Path_) -> tuple[Files, Path]:
    """A component that is a system: its description, and the files as that sees them."""
    if element.get("type") == SSD_TYPE:
        file = _file(files, element, place)
        return files.beside(file), file
    source, _, description = (element.get("source") or "").partition("#")
    package = files.named(source, f"component {'.'.join(place)!r} with source", "an SSP inside the archive")
    inside = files.inside(package)
    return inside, inside.named(description or MAIN, f"component {'.'.join(place)!r} with description")


def _read_connectors(found: Structure, node: Any, place: Path_, scope: _Scope) -> None:
    for connector in children(node, "Connectors", "Connector"):
        here = (place, connector.get("name") or "")
        found.connectors[here] = (_stated_unit(connector), scope.units)
        found.kinds[here] = connector.get("kind") or ""
        named = child(connector, "Enumeration")
        if named is not None and (items := scope.enumerations.get(named.get("name") or "")):
            found.enumerations[here] = items


def _stated_unit(node: Any) -> str:
    """Of a connector or an entry of a dictionary; empty without."""
    return next((kind.get("unit") for kind in node if kind.get("unit")), "")


def _read_dictionary(found: Structure, files: Files, node: Any, place: Path_, definitions: Definitions) -> None:
    """A dictionary as a place among those of its system: its entries pass on what one element connects to them."""
    table = files.table(node, "SignalDictionary", node)
    here = (*place, f"{_DICTIONARY}{node.get('name') or ''}")
    found.dictionaries.add(here)
    for entry in children(table, "DictionaryEntry"):
        found.connectors[here, entry.get("name") or ""] = (_stated_unit(entry), {**definitions, **units(table)})


_DICTIONARY = "signal dictionary "


def _dictionary(found: Structure, element: Any, place: Path_) -> Path_:
    """Place of the dictionary that a reference names: of its system, or of the nearest around it that has one."""
    name = element.get("dictionary") or ""
    for level in range(len(place), -1, -1):
        candidate = (*place[:level], f"{_DICTIONARY}{name}")
        if candidate in found.dictionaries:
            return candidate
    reference = ".".join((*place, element.get("name") or ""))
    raise InputError(
        f"SSP {found.path}: {reference} refers to the signal dictionary {name!r} -- expected one that its system or "
        "one around it has -- export it again"
    )


def _file(files: Files, element: Any, place: Path_) -> Path:
    what = f"component {'.'.join(place)!r} with source"
    return files.named(element.get("source") or "", what, "an FMU inside the archive")


def _read_component(found: Structure, files: Files, element: Any, place: Path_, scope: _Scope) -> None:
    if element.get("type", FMU_TYPE) != FMU_TYPE:
        raise InputError(
            f"SSP {found.path}: component {'.'.join(place)!r} is of type {element.get('type')!r} -- expected an FMU "
            "inside the archive -- pack it in as one"
        )
    wanted = element.get("implementation", "any")
    if wanted not in ("any", "CoSimulation"):
        found.notes.append(f"component {'.'.join(place)} is meant for {wanted}: its co-simulation runs instead")
    found.fmus[place] = _file(files, element, place)
    _read_connectors(found, element, place, scope)
    found.bindings += [(place, p) for p in bound(files, element, scope.units, found.notes)]


def _read_connection(found: Structure, node: Any, place: Path_) -> None:
    ends: list[Node] = []
    for end in ("start", "end"):
        element, connector = node.get(f"{end}Element"), node.get(f"{end}Connector") or ""
        where = (*place, element) if element else place
        ends.append((found.places.get(where, where), connector))
    source, target = (".".join((*where, name)) for where, name in ends)
    for end in ("start", "end"):
        if indices := node.get(f"{end}Indices"):
            raise InputError(
                f"SSP {found.path}: connection {source} -> {target} has {end}Indices {indices!r} -- expected whole "
                "arrays, or the element by its name, as in u[1,2] -- export it again"
            )
    linear, values = transformation(found.path, node, f"connection {source} -> {target}")
    suppressed = node.get("suppressUnitConversion") in ("true", "1")
    found.edges.append(Edge(ends[0], ends[1], linear, suppressed, values, place))
