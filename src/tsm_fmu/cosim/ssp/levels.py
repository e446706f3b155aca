"""Read the elements of a system description, all levels, as a `Structure`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ...models.contract import InputError
from .connectors import Scope, scope, units
from .files import Files
from .parameters import bound
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
    _read_system(found, files, child(root, "System"), (), scope(files.path, root))
    return found


def _read_system(found: Structure, files: Files, node: Any, place: Path_, within: Scope) -> None:
    if len(place) > MOST_LEVELS:
        raise InputError(
            f"SSP {found.path}: system {'.'.join(place[:4])}... is nested more than {MOST_LEVELS} times -- expected "
            "no description that holds itself -- export it again"
        )
    found.systems.add(place)
    if any(own.get("linearimpedance") for note in children(node, "Annotations") for own in note.iter()):
        raise InputError(
            f"SSP {found.path}: system {'.'.join(place) or node.get('name')!r} has transmission lines (TLM) of "
            "OMSimulator -- expected connections of signals -- export it without them"
        )
    _read_connectors(found, node, place, within)
    found.bindings += [(place, p) for p in bound(files, node, within.units, found.notes)]
    for dictionary in children(node, "SignalDictionaries", "SignalDictionary"):
        _read_dictionary(found, files, dictionary, place, within)
    for element in child(node, "Elements") if child(node, "Elements") is not None else ():
        inner = (*place, element.get("name") or "")
        kind = local(element)
        if found.has(inner):
            raise InputError(
                f"SSP {found.path}: the element {'.'.join(inner)!r} is there twice -- expected names used once in a "
                "system -- rename one"
            )
        if kind == "System":
            _read_system(found, files, element, inner, within)
        elif kind == "Component" and element.get("type") in (SSD_TYPE, SSP_TYPE):
            own, system, defined = _nested(files, element, inner, within)
            _read_system(found, own, system, inner, defined)
            found.bindings += [(inner, p) for p in bound(files, element, within.units, found.notes)]
        elif kind == "Component":
            _read_component(found, files, element, inner, within)
        elif kind == "SignalDictionaryReference":
            found.places[inner] = _dictionary(found, element, place)
    for connection in children(node, "Connections", "Connection"):
        _read_connection(found, connection, place)


def _nested(files: Files, element: Any, place: Path_, within: Scope) -> tuple[Files, Any, Scope]:
    """A component that is a system: the files as that sees them, its element, and what its file defines."""
    what = f"component {'.'.join(place)!r} with"
    source, _, part = (element.get("source") or "").partition("#")
    if not source and part:  # a system of this description, by its id
        system = next((n for n in element.getroottree().iter() if local(n) == "System" and n.get("id") == part), None)
        if system is None:
            raise InputError(
                f"SSP {files.path}: {what} source '#{part}' -- expected the id of a System of its description -- "
                "export it again"
            )
        return files, system, within
    if element.get("type") == SSD_TYPE:
        file = files.named(source, f"{what} source", "a description inside the archive")
        own = files.beside(file)
    else:
        own = files.inside(files.named(source, f"{what} source", "an SSP inside the archive"))
        file = own.named(part or MAIN, f"{what} description")
    root = parse(files.path, file, "SystemStructureDescription")
    return own, child(root, "System"), scope(files.path, root)


def _read_connectors(found: Structure, node: Any, place: Path_, within: Scope) -> None:
    for connector in children(node, "Connectors", "Connector"):
        name = connector.get("name") or ""
        found.connectors[place, name] = within.connector(connector)
        if any(
            port.get("default") for annotations in children(connector, "Annotations") for port in annotations.iter()
        ):
            found.notes.append(f"another tool's start value of {'.'.join((*place, name))} in an annotation is not read")


def _read_dictionary(found: Structure, files: Files, node: Any, place: Path_, within: Scope) -> None:
    """A dictionary as a place among those of its system: its entries pass on what one element connects to them."""
    table = files.table(node, "SignalDictionary", node)
    here = (*place, f"{_DICTIONARY}{node.get('name') or ''}")
    found.dictionaries.add(here)
    own = replace(within, units={**within.units, **units(files.path, table)})
    for entry in children(table, "DictionaryEntry"):
        found.connectors[here, entry.get("name") or ""] = own.connector(entry)


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


def _read_component(found: Structure, files: Files, element: Any, place: Path_, within: Scope) -> None:
    if element.get("type", FMU_TYPE) != FMU_TYPE:
        raise InputError(
            f"SSP {found.path}: component {'.'.join(place)!r} is of type {element.get('type')!r} -- expected an FMU "
            "inside the archive -- pack it in as one"
        )
    wanted = element.get("implementation", "any")
    if wanted not in ("any", "CoSimulation"):
        found.notes.append(f"component {'.'.join(place)} is meant for {wanted}: its co-simulation runs instead")
    what = f"component {'.'.join(place)!r} with source"
    found.fmus[place] = files.named(element.get("source") or "", what, "an FMU inside the archive")
    _read_connectors(found, element, place, within)
    found.bindings += [(place, p) for p in bound(files, element, within.units, found.notes)]


def _read_connection(found: Structure, node: Any, place: Path_) -> None:
    ends: list[Node] = []
    for end in ("start", "end"):
        element, connector = node.get(f"{end}Element"), node.get(f"{end}Connector") or ""
        where = (*place, element) if element else place
        ends.append((found.places.get(where, where), connector))
    source, target = (".".join((*where, name)) for where, name in ends)
    if delay := node.get("information_delay"):
        found.notes.append(f"connection {source} -> {target}: the delay of {delay} s that ssp4sim adds is left out")
    for where, _ in ends:
        if not found.has(where) and where not in found.dictionaries:
            raise InputError(
                f"SSP {found.path}: connection {source} -> {target}: there is no element {'.'.join(where)!r} -- "
                "expected one of its system -- correct the connection"
            )
    for end in ("start", "end"):
        if indices := node.get(f"{end}Indices"):
            raise InputError(
                f"SSP {found.path}: connection {source} -> {target} has {end}Indices {indices!r} -- expected whole "
                "arrays, or the element by its name, as in u[1,2] -- export it again"
            )
    linear, values = transformation(found.path, node, f"connection {source} -> {target}")
    suppressed = node.get("suppressUnitConversion") in ("true", "1")
    found.edges.append(Edge(ends[0], ends[1], linear, suppressed, values, place))
