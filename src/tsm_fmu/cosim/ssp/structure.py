"""Systems within systems: components, connections and parameters of an SSP brought to one flat system."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...models.contract import InputError
from ..conversion import Definitions, conversion
from ..description import Description, describe
from ..start_values import Value, article, takes_start
from ..system import Component, Connection, System
from .connectors import SILENT, Connector
from .parameters import Parameter
from .transformations import Linear, ValueMapping
from .xml import identifier

Path_ = tuple[str, ...]
Node = tuple[Path_, str]
"""A connector: names of the elements around it from the outside, and its own."""
_GIVING = ("output", "calculatedParameter", "constant", "local")
_TAKING = ("input", "parameter", "structuralParameter")
"""Kinds of connectors, as seen from outside of what they belong to."""


@dataclass(frozen=True)
class Edge:
    """One connection as written.

    Attributes
    ----------
    start, end : Node
        Connectors.
    linear : Linear
        What becomes of the number after units are converted.
    suppressed : bool
        Whether they are not.
    values : ValueMapping or None
        What becomes of single values.
    place : tuple of str
        System that it is in; a connector of that system is seen from inside.
    """

    start: Node
    end: Node
    linear: Linear
    suppressed: bool
    values: ValueMapping | None
    place: Path_


@dataclass
class Structure:
    """What a system description holds, all levels; filled by `read_structure`.

    Signal dictionaries are places as systems are, with an entry as a connector; ``places`` leads from a reference to
    its dictionary.
    """

    path: Path
    fmus: dict[Path_, Path] = field(default_factory=dict)
    systems: set[Path_] = field(default_factory=set)
    connectors: dict[Node, Connector] = field(default_factory=dict)
    edges: list[Edge] = field(default_factory=list)
    bindings: list[tuple[Path_, Parameter]] = field(default_factory=list)
    dictionaries: set[Path_] = field(default_factory=set)
    places: dict[Path_, Path_] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def has(self, place: Path_) -> bool:
        """Whether an element is there."""
        return place in self.fmus or place in self.systems or place in self.places

    def flat(self, name: str) -> System:
        """The flat system; names of nested components are joined by ``_``, which replaces dots and blanks too.

        Raises
        ------
        InputError
            Units or names that do not fit, each named.
        """
        names = self._names()
        described = {place: describe(fmu) for place, fmu in self.fmus.items()}
        self.edges = [self._directed(edge, described) for edge in self.edges]
        drivers: dict[Node, Edge] = {}
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

    def _directed(self, edge: Edge, described: dict[Path_, Description]) -> Edge:
        """The connection in the direction of its signal, which its start and end do not say (SSP 2.0, Connections)."""

        def gives(node: Node) -> bool | None:
            if node[0] in self.fmus:
                port = described[node[0]].ports.get(described[node[0]].elements(node[1])[0])
                kind = "" if port is None else port.causality
            else:
                kind = self._stated(node).kind
            if kind not in (*_GIVING, *_TAKING):
                return None
            return (kind in _GIVING) != (node[0] == edge.place)

        start, end = gives(edge.start), gives(edge.end)
        turned = (start is False and end is not False) or (end is True and start is not True)
        return replace(edge, start=edge.end, end=edge.start) if turned else edge

    def _connection(
        self, last: Edge, drivers: dict[Node, Edge], names: dict[Path_, str], described: dict[Path_, Description]
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
        own = [self._stated(n).unit not in ("", self._port_unit(n, described)[0]) for n in (source, target)]
        values = self._mapped_values(chain, addresses, described)
        if len(chain) == 1 and not any(own):
            return Connection(*addresses, last.linear.factor, last.linear.offset, not last.suppressed, values)
        return replace(self._converted(chain, addresses, described), values=values)

    def _mapped_values(
        self, chain: list[Edge], addresses: tuple[str, str], described: dict[Path_, Description]
    ) -> tuple[tuple[int, int], ...]:
        """What all value mappings on the way make of the values that they name."""
        what = f"SSP {self.path}: connection {addresses[0]} -> {addresses[1]}"
        ports = [described[place].ports.get(described[place].elements(name)[0]) for place, name in self._ends(chain)]
        maps: list[dict[int, int]] = []
        for edge in chain:
            if edge.values is None:
                continue
            kind = edge.values.kind
            for port in ports:
                if port is not None and (port.kind != ("Boolean" if kind == "Boolean" else "Integer")):
                    raise InputError(
                        f"{what} has a mapping of type {kind} on {port.fmi_type} ports -- expected ports of that type "
                        "-- correct the mapping"
                    )
            sides = [
                self._stated(node).items or ({} if port is None else described[end[0]].items(port))
                for node, end, port in zip((edge.start, edge.end), self._ends(chain), ports, strict=True)
            ]
            maps.append(edge.values.numbers(sides[0], sides[1], what))

        def through(value: int) -> int:
            for one in maps:
                value = one.get(value, value)
            return value

        return tuple((value, through(value)) for value in dict.fromkeys(v for one in maps for v in one))

    @staticmethod
    def _ends(chain: list[Edge]) -> tuple[Node, Node]:
        return chain[0].start, chain[-1].end

    def _stated(self, node: Node) -> Connector:
        return self.connectors.get(node, SILENT)

    def _converted(
        self, chain: list[Edge], addresses: tuple[str, str], described: dict[Path_, Description]
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
        stated = self._stated(node)
        if stated.unit or node[0] not in self.fmus:
            return stated.unit, stated.definitions
        return self._port_unit(node, described)

    def _port_unit(self, node: Node, described: dict[Path_, Description]) -> tuple[str, Definitions]:
        description = described[node[0]]
        port = description.ports.get(description.elements(node[1])[0])
        return ("" if port is None else port.unit, description.units)

    def _values(self, described: dict[Path_, Description]) -> dict[Path_, dict[str, Value]]:
        """Start values by component; those of outer systems replace those of inner ones."""
        found: dict[Path_, dict[str, Value]] = {place: {} for place in self.fmus}
        unfit: dict[Path_, list[str]] = {}
        for owner, parameter in sorted(self.bindings, key=lambda b: -len(b[0])):
            reached = list(self._reached(owner, parameter))
            for place, target in reached:
                description = described[place]
                port = description.ports.get(description.elements(target.name)[0])
                address = ".".join((*place, target.name))
                if port is not None and not takes_start(port):
                    self.notes.append(f"parameter {address} is left out: the FMU has {article(port.causality)} there")
                elif port is not None:
                    stated = self._stated((place, target.name))
                    found[place][target.name] = target.of(address, port, description, stated)
                else:
                    reached = []
            if not reached:
                unfit.setdefault(owner, []).append(parameter.name)
        for owner, names in unfit.items():
            self.notes.append(f"no variable of {'.'.join(owner) or 'the system'} for: {', '.join(names)}")
        return found

    def _reached(self, owner: Path_, parameter: Parameter) -> Iterator[tuple[Path_, Parameter]]:
        """Variables of components that a parameter of a component or system gets to."""
        if owner in self.fmus:
            yield owner, parameter
            return
        node = (owner, parameter.name)
        if node in self.connectors:
            stated = self.connectors[node]
            if not parameter.unit and stated.unit:
                parameter = replace(parameter, unit=stated.unit, definitions=stated.definitions)
            for edge in self.edges:
                if edge.start == node:
                    onward = replace(
                        parameter,
                        name=edge.end[1],
                        value=parameter.value if edge.values is None else edge.values.of(parameter.value),
                        unit="" if edge.suppressed else parameter.unit,
                        linear=edge.linear.after(parameter.linear),
                    )
                    yield from self._reached(edge.end[0], onward)
            return
        for inner in (*self.fmus, *sorted(self.systems)):
            if len(inner) == len(owner) + 1 and inner[:-1] == owner and parameter.name.startswith(f"{inner[-1]}."):
                yield from self._reached(inner, replace(parameter, name=parameter.name[len(inner[-1]) + 1 :]))
