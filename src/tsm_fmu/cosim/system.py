"""Components, connections and parameters of a co-simulated system, and the check that they fit together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..models.contract import InputError
from .conversion import conversion
from .description import Description, Port, describe
from .start_values import Value, article, start_values
from .value_table import ValueTable, value_table


@dataclass(frozen=True)
class Component:
    """One FMU instance.

    Attributes
    ----------
    name : str
        Name in the system, without a dot.
    fmu : Path
        The FMU file.
    parameters : mapping of str to value
        Start values by variable name in the FMU's own units; an input that is not connected gets its value here. An
        array takes a text of all its elements, or values by ``name[i]``.
    """

    name: str
    fmu: Path
    parameters: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Connection:
    """A signal from an output to an input, ``component.variable`` each; arrays of one size element by element.

    The value is converted from the unit of the source to that of the target where both declare one
    (``convert_units``; a port in ``1`` takes any), then ``target = factor * source + offset``: the linear
    transformation of SSP 1.0. An Integer may go to a Real input.

    Attributes
    ----------
    source, target, factor, offset, convert_units
        As above.
    values : tuple of (int, int)
        Integers (of an Enumeration the numbers of its items, of a Boolean 0 and 1) that become others on the way, the
        mapping transformations of SSP; all others stay as they are.
    """

    source: str
    target: str
    factor: float = 1.0
    offset: float = 0.0
    convert_units: bool = True
    values: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class System:
    """Components and the connections between them.

    Attributes
    ----------
    components, connections : tuple
        What it is made of.
    name : str
        What messages call it.
    notes : tuple of str
        What a user should know of how it came about; a run says it.
    """

    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    name: str = "system"
    notes: tuple[str, ...] = ()

    def with_values(self, values: Mapping[str, Value]) -> System:
        """Return the system with start values replaced, by ``component.variable``.

        Raises
        ------
        InputError
            If a name does not address a component.
        """
        names = [c.name for c in self.components]
        changed = {c.name: dict(c.parameters) for c in self.components}
        for address, value in values.items():
            component, dot, variable = address.partition(".")
            if not dot or component not in changed:
                raise InputError(
                    f"{address!r} in system {self.name} -- expected component.variable with one of {', '.join(names)} "
                    "-- correct the name"
                )
            changed[component][variable] = value
        return replace(self, components=tuple(replace(c, parameters=changed[c.name]) for c in self.components))


@dataclass(frozen=True)
class Experiment:
    """How to run a system.

    Attributes
    ----------
    stop, step, start : float
        Time and communication step [s].
    method : {"gauss-seidel", "jacobi"}
        Order of the exchange.
    loops : {"refuse", "delay", "iterate"}
        What becomes of algebraic loops.
    evaluate_from : float
        Statistics are taken from this time on [s].
    tracking_error : str
        Column (in rad) that is a tracking error, reported in degrees; empty if none.
    step_error : float or None
        Largest relative error of a step, where the step is chosen by it (`simulate_system`); None: it is fixed.
    """

    stop: float
    step: float
    start: float = 0.0
    method: str = "gauss-seidel"
    loops: str = "refuse"
    evaluate_from: float = 0.0
    tracking_error: str = ""
    step_error: float | None = None

    def window(self, time: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Mark the rows that statistics are taken from; all if the run ends before `evaluate_from`."""
        begin = self.evaluate_from if self.evaluate_from < time[-1] else time[0]
        return time >= begin - 1e-9 * self.step


@dataclass(frozen=True)
class Link:
    """A resolved connection: ``target = gain * source + offset``, unit conversion included.

    ``values`` goes before that; None where all Integers and Booleans stay as they are.
    """

    source: tuple[str, str]
    target: tuple[str, str]
    kind: str
    gain: float
    offset: float
    values: ValueTable | None = None


@dataclass(frozen=True)
class Wiring:
    """A system whose names, types and units have been checked against its FMUs.

    Attributes
    ----------
    system : System
        What was checked; parameter values are of the type that the FMU declares.
    descriptions : mapping of str to Description
        By component name.
    links : tuple of Link
        The connections, resolved.
    """

    system: System
    descriptions: Mapping[str, Description]
    links: tuple[Link, ...]


def check_system(system: System) -> Wiring:
    """Check names, directions, types, units and start values of a system against its FMUs.

    Raises
    ------
    InputError
        One line that names the component and variable: name used twice, unknown component or variable,
        connection that does not go from an output to an input, input driven twice, types or units that do
        not fit, start value that cannot be set, input that is neither connected nor given a value.
    """
    if not system.components:
        raise InputError(f"system {system.name} has no component -- expected at least one -- add a Component")
    descriptions: dict[str, Description] = {}
    described = {fmu: describe(fmu) for fmu in dict.fromkeys(c.fmu for c in system.components)}
    for component in system.components:
        if not component.name or "." in component.name or component.name in descriptions:
            raise InputError(
                f"component name {component.name!r} -- expected names without a dot, each used once -- rename it"
            )
        descriptions[component.name] = described[component.fmu]
    _check_instances(system, descriptions)
    components = tuple(
        replace(c, parameters=start_values(c.name, descriptions[c.name], c.parameters)) for c in system.components
    )
    links = tuple(link for connection in system.connections for link in _links(connection, descriptions))
    _check_inputs(components, descriptions, links)
    return Wiring(replace(system, components=components), descriptions, links)


def _check_instances(system: System, descriptions: Mapping[str, Description]) -> None:
    seen: dict[str, str] = {}
    for component in system.components:
        model = descriptions[component.name].model
        if model.guid in seen and model.coSimulation.canBeInstantiatedOnlyOncePerProcess:
            raise InputError(
                f"components {seen[model.guid]} and {component.name} are the same FMU ({component.fmu.name}), which "
                "allows one instance in a process -- expected one component of it -- build a second FMU"
            )
        seen[model.guid] = component.name


def _ports(address: str, side: str, descriptions: Mapping[str, Description]) -> tuple[str, tuple[Port, ...]]:
    component, dot, variable = address.partition(".")
    if not dot or component not in descriptions:
        raise InputError(
            f"{side} {address!r} of a connection -- expected component.variable with one of {', '.join(descriptions)} "
            "-- correct the name"
        )
    description = descriptions[component]
    elements = description.elements(variable)
    if elements[0] not in description.ports:
        if unusable := next((v for v in description.model.modelVariables if v.name == variable), None):
            raise InputError(
                f"{side} {address!r} of a connection is {article(unusable.type)}, or too large an array -- expected a "
                "number, a Boolean or a text -- leave the connection out"
            )
        names = [p.array or p.name for p in (description.outputs if side == "source" else description.inputs)]
        raise InputError(
            f"{side} {address!r} of a connection: {description.path.name} has no variable {variable!r} -- expected "
            f"one of {', '.join(dict.fromkeys(names)) or 'none at all'} -- correct the name"
        )
    return component, tuple(description.ports[name] for name in elements)


def _links(connection: Connection, descriptions: Mapping[str, Description]) -> list[Link]:
    source_component, sources = _ports(connection.source, "source", descriptions)
    target_component, targets = _ports(connection.target, "target", descriptions)
    if len(sources) != len(targets):
        raise InputError(
            f"connection {connection.source} -> {connection.target} joins {len(sources)} to {len(targets)} elements "
            "-- expected arrays of one size -- connect single elements, as in name[1]"
        )
    pairs = zip(sources, targets, strict=True)
    return [
        _link(connection, source_component, source, target_component, target, descriptions) for source, target in pairs
    ]


def _link(
    connection: Connection,
    source_component: str,
    source: Port,
    target_component: str,
    target: Port,
    descriptions: Mapping[str, Description],
) -> Link:
    text = f"connection {source_component}.{source.name} -> {target_component}.{target.name}"
    if source.causality != "output" or target.causality != "input":
        raise InputError(
            f"{text} goes from {article(source.causality)} to {article(target.causality)} -- expected from an output "
            "to an input -- turn it round or choose another port"
        )
    if source.kind != target.kind and (source.kind, target.kind) != ("Integer", "Real"):
        raise InputError(
            f"{text} joins {source.fmi_type} to {target.fmi_type} -- expected ports of one type, or an Integer that "
            "goes to a Real -- choose another port"
        )
    if not (math.isfinite(connection.factor) and math.isfinite(connection.offset)):
        raise InputError(
            f"{text} has factor {connection.factor!r} and offset {connection.offset!r} -- expected finite numbers "
            "-- correct them"
        )
    if target.kind != "Real":
        if (connection.factor, connection.offset) != (1.0, 0.0):
            raise InputError(
                f"{text} has a factor or offset on {source.fmi_type} ports -- expected Real ports for that -- drop it"
            )
        scale, shift = 1.0, 0.0
    elif connection.convert_units and source.unit and target.unit:
        scale, shift = conversion(
            source.unit,
            target.unit,
            f"{text} joins",
            (descriptions[source_component].units, descriptions[target_component].units),
        )
    else:
        scale, shift = 1.0, 0.0
    return Link(
        (source_component, source.name),
        (target_component, target.name),
        target.kind,
        connection.factor * scale,
        connection.factor * shift + connection.offset,
        value_table(text, source, target, connection.values, descriptions[target_component].items(target)),
    )


def _check_inputs(
    components: Sequence[Component], descriptions: Mapping[str, Description], links: Sequence[Link]
) -> None:
    drivers: dict[tuple[str, str], Link] = {}
    for link in links:
        if link.target in drivers:
            first = drivers[link.target]
            raise InputError(
                f"input {'.'.join(link.target)} is driven by {'.'.join(first.source)} and by {'.'.join(link.source)} "
                "-- expected one connection -- remove one, or add them in a Sum"
            )
        drivers[link.target] = link
    free = [
        f"{c.name}.{p.name}"
        for c in components
        for p in descriptions[c.name].inputs
        if (c.name, p.name) not in drivers and p.name not in c.parameters
    ]
    if free:
        raise InputError(
            f"{'input' if len(free) == 1 else 'inputs'} {', '.join(free)} not connected -- expected a connection or a "
            f"value -- connect, or set for example {free[0]}=0"
        )
