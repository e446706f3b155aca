"""Systems within systems: components, connections and parameters of an SSP brought to one flat system."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ...models.contract import InputError
from ..conversion import Definitions, conversion
from ..description import Description, describe
from ..start_values import Value, article, takes_start
from ..system import Component, Connection, System
from .files import Files
from .parameters import Linear, Parameter, bound, linear, units
from .xml import FMU_TYPE, SSD_TYPE, child, children, identifier, local, parse

Path_ = tuple[str, ...]
Node = tuple[Path_, str]
"""A connector: names of the elements around it from the outside, and its own."""


@dataclass(frozen=True)
class _Edge:
    start: Node
    end: Node
    linear: Linear
    suppressed: bool


@dataclass
class Structure:
    """What a system description holds, all levels; filled by `read_structure`.

    Signal dictionaries are places as systems are, with an entry as a connector; ``places`` leads from a reference to
    its dictionary.
    """

    path: Path
    fmus: dict[Path_, Path] = field(default_factory=dict)
    systems: set[Path_] = field(default_factory=set)
    connectors: dict[Node, tuple[str, Definitions]] = field(default_factory=dict)
    edges: list[_Edge] = field(default_factory=list)
    bindings: list[tuple[Path_, Parameter]] = field(default_factory=list)
    dictionaries: set[Path_] = field(default_factory=set)
    places: dict[Path_, Path_] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def flat(self, name: str) -> System:
        """The flat system; names of nested components are joined by ``_``, which replaces dots and blanks too.

        Raises
        ------
        InputError
            Units or names that do not fit, each named.
        """
        names = self._names()
        described = {place: describe(fmu) for place, fmu in self.fmus.items()}
        drivers: dict[Node, _Edge] = {}
        for edge in self.edges:
            if edge.end in drivers and edge.end[0] not in self.fmus:  # of a component the system's check says it
                raise InputError(
                    f"SSP {self.path}: connector {'.'.join((*edge.end[0], edge.end[1]))} is driven twice -- expected "
                    "one connection -- export it again"
                )
            drivers.setdefault(edge.end, edge)
        connections = [
            found
            for edge in self.edges
            if edge.end[0] in self.fmus
            for found in [self._connection(edge, drivers, names, described)]
            if found is not None
        ]
        values = self._values(described)
        driven = {connection.target for connection in connections}
        components = []
        for place, fmu in self.fmus.items():
            open_inputs = {
                p.name: p.start
                for p in described[place].inputs
                if not {f"{names[place]}.{n}" for n in (p.name, p.array)} & driven
                and not {p.name, p.array} & values[place].keys()
                and p.start is not None
            }
            if open_inputs:
                kept = ", ".join(f"{names[place]}.{n} = {v}" for n, v in open_inputs.items())
                self.notes.append(f"nothing drives {kept}: the FMU's own start values stay")
            components.append(Component(names[place], fmu, {**values[place], **open_inputs}))
        return System(tuple(components), tuple(connections), name, tuple(self.notes))

    def _names(self) -> dict[Path_, str]:
        found: dict[Path_, str] = {}
        for place in self.fmus:
            name = identifier("_".join(place))
            while name in found.values():
                name += "_"
            found[place] = name
        return found

    def _connection(
        self, last: _Edge, drivers: dict[Node, _Edge], names: dict[Path_, str], described: dict[Path_, Description]
    ) -> Connection | None:
        """From the component that drives an input, through the connectors of systems; None if none does."""
        chain = [last]
        while chain[0].start[0] not in self.fmus:
            before = drivers.get(chain[0].start)
            if before is None or before in chain:
                return None
            chain.insert(0, before)
        source, target = chain[0].start, last.end
        addresses = (f"{names[source[0]]}.{source[1]}", f"{names[target[0]]}.{target[1]}")
        own = [self._declared(node, described) for node in (source, target)]
        if len(chain) == 1 and not any(own):
            return Connection(addresses[0], addresses[1], last.linear.factor, last.linear.offset, not last.suppressed)
        return self._converted(chain, addresses, described)

    def _declared(self, node: Node, described: dict[Path_, Description]) -> str:
        """Unit that a connector of a component states where it is another than that of the FMU's variable."""
        unit = self.connectors.get(node, ("", {}))[0]
        port = described[node[0]].ports.get(node[1])
        return unit if unit and port is not None and port.unit not in ("", unit) else ""

    def _converted(
        self, chain: list[_Edge], addresses: tuple[str, str], described: dict[Path_, Description]
    ) -> Connection:
        """All units and transformations on the way as one factor and offset."""
        text = f"SSP {self.path}: connection {addresses[0]} -> {addresses[1]} joins"
        units_of = {node: self._unit(node, described) for edge in chain for node in (edge.start, edge.end)}

        def converted(here: tuple[str, Definitions], there: tuple[str, Definitions]) -> Linear:
            if not here[0] or not there[0]:
                return Linear()
            return Linear(*conversion(here[0], there[0], text, (here[1], there[1])))

        source, target = chain[0].start, chain[-1].end
        total, unit = converted(self._port_unit(source, described), units_of[source]), units_of[source]
        for edge in chain:
            following = units_of[edge.end]
            if not edge.suppressed:
                total = converted(unit, following).after(total)
            total = edge.linear.after(total)
            changed = edge.suppressed or not edge.linear.plain
            unit = following if following[0] or changed else unit
        total = converted(units_of[target], self._port_unit(target, described)).after(total)
        return Connection(addresses[0], addresses[1], total.factor, total.offset, convert_units=False)

    def _unit(self, node: Node, described: dict[Path_, Description]) -> tuple[str, Definitions]:
        """Unit of a connector: as stated, or of a component as its FMU has it."""
        stated = self.connectors.get(node, ("", {}))
        return stated if stated[0] or node[0] not in self.fmus else self._port_unit(node, described)

    def _port_unit(self, node: Node, described: dict[Path_, Description]) -> tuple[str, Definitions]:
        description = described[node[0]]
        port = description.ports.get(description.elements(node[1])[0])
        return ("" if port is None else port.unit, description.units)

    def _values(self, described: dict[Path_, Description]) -> dict[Path_, dict[str, Value]]:
        """Start values by component; those of outer systems replace those of inner ones."""
        found: dict[Path_, dict[str, Value]] = {place: {} for place in self.fmus}
        for owner, parameter in sorted(self.bindings, key=lambda b: -len(b[0])):
            reached = list(self._reached(owner, parameter))
            for place, target in reached:
                description = described[place]
                port = description.ports.get(description.elements(target.name)[0])
                address = ".".join((*place, target.name))
                if port is not None and not takes_start(port):
                    self.notes.append(f"parameter {address} is left out: the FMU has {article(port.causality)} there")
                elif port is not None:
                    found[place][target.name] = target.of(address, port, description)
                elif owner in self.fmus:
                    found[place][target.name] = target.value  # refused by its name when the system is checked
                else:
                    reached = []
            if not reached:
                self.notes.append(f"parameter {parameter.name} of {'.'.join(owner) or 'the system'} fits no variable")
        return found

    def _reached(self, owner: Path_, parameter: Parameter) -> Iterator[tuple[Path_, Parameter]]:
        """Variables of components that a parameter of a component or system gets to."""
        if owner in self.fmus:
            yield owner, parameter
            return
        node = (owner, parameter.name)
        if node in self.connectors:
            unit, definitions = self.connectors[node]
            if not parameter.unit and unit:
                parameter = replace(parameter, unit=unit, definitions=definitions)
            for edge in self.edges:
                if edge.start == node:
                    onward = replace(
                        parameter,
                        name=edge.end[1],
                        unit="" if edge.suppressed else parameter.unit,
                        linear=edge.linear.after(parameter.linear),
                    )
                    yield from self._reached(edge.end[0], onward)
            return
        for inner in (*self.fmus, *sorted(self.systems)):
            if len(inner) == len(owner) + 1 and inner[:-1] == owner and parameter.name.startswith(f"{inner[-1]}."):
                yield from self._reached(inner, replace(parameter, name=parameter.name[len(inner[-1]) + 1 :]))


def read_structure(files: Files, root: Any) -> Structure:
    """Read a system description with all its levels.

    Raises
    ------
    InputError
        Value mappings on connections, components that are no FMU of the archive: each named.
    """
    found = Structure(files.path)
    _read_system(found, files, child(root, "System"), (), units(root))
    return found


def _read_system(found: Structure, files: Files, node: Any, place: Path_, definitions: Definitions) -> None:
    found.systems.add(place)
    _read_connectors(found, node, place, definitions)
    found.bindings += [(place, p) for p in bound(files, node, definitions)]
    for dictionary in children(node, "SignalDictionaries", "SignalDictionary"):
        _read_dictionary(found, files, dictionary, place, definitions)
    for element in child(node, "Elements") if child(node, "Elements") is not None else ():
        inner = (*place, element.get("name") or "")
        kind = local(element)
        if kind == "System":
            _read_system(found, files, element, inner, definitions)
        elif kind == "Component" and element.get("type") == SSD_TYPE:
            file = _file(files, element, inner)
            root = parse(found.path, file, "SystemStructureDescription")
            _read_system(found, files.beside(file), child(root, "System"), inner, units(root))
            found.bindings += [(inner, p) for p in bound(files, element, definitions)]
        elif kind == "Component":
            _read_component(found, files, element, inner, definitions)
        elif kind == "SignalDictionaryReference":
            found.places[inner] = _dictionary(found, element, place)
    for connection in children(node, "Connections", "Connection"):
        _read_connection(found, connection, place)


def _read_connectors(found: Structure, node: Any, place: Path_, definitions: Definitions) -> None:
    for connector in children(node, "Connectors", "Connector"):
        found.connectors[place, connector.get("name") or ""] = (_stated_unit(connector), definitions)


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


def _read_component(found: Structure, files: Files, element: Any, place: Path_, definitions: Definitions) -> None:
    if element.get("type", FMU_TYPE) != FMU_TYPE:
        raise InputError(
            f"SSP {found.path}: component {'.'.join(place)!r} is of type {element.get('type')!r} -- expected an FMU "
            "inside the archive -- pack it in as one"
        )
    wanted = element.get("implementation", "any")
    if wanted not in ("any", "CoSimulation"):
        found.notes.append(f"component {'.'.join(place)} is meant for {wanted}: its co-simulation runs instead")
    found.fmus[place] = _file(files, element, place)
    _read_connectors(found, element, place, definitions)
    found.bindings += [(place, p) for p in bound(files, element, definitions)]


def _read_connection(found: Structure, node: Any, place: Path_) -> None:
    ends: list[Node] = []
    for end in ("start", "end"):
        element, connector = node.get(f"{end}Element"), node.get(f"{end}Connector") or ""
        where = (*place, element) if element else place
        ends.append((found.places.get(where, where), connector))
    transformation = Linear()
    for kind in node:
        if local(kind) == "LinearTransformation":
            transformation = linear(found.path, kind.attrib)
        elif local(kind).endswith("MappingTransformation"):
            source, target = (".".join((*where, name)) for where, name in ends)
            raise InputError(
                f"SSP {found.path}: connection {source} -> {target} has a value mapping -- expected a linear one "
                "-- put an FMU that maps the values between"
            )
    suppressed = node.get("suppressUnitConversion") in ("true", "1")
    found.edges.append(_Edge(ends[0], ends[1], transformation, suppressed))
