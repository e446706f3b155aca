"""Components, connections and parameters of a co-simulated system, and the check that they fit together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..logs.units import same_quantity, unit_to_si
from ..models.contract import InputError
from .description import Description, Port, describe

Value = float | int | bool | str


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
        Start values by variable name in the FMU's own units; an input that is not connected gets its value here.
    """

    name: str
    fmu: Path
    parameters: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Connection:
    """A signal from an output to an input, ``component.variable`` each.

    The value is converted from the unit of the source to that of the target where both declare one
    (``convert_units``; a port in ``1`` takes any), then ``target = factor * source + offset``: the linear
    transformation of SSP 1.0.
    """

    source: str
    target: str
    factor: float = 1.0
    offset: float = 0.0
    convert_units: bool = True


@dataclass(frozen=True)
class System:
    """Components and the connections between them."""

    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    name: str = "system"

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
    evaluate_from : float
        Statistics are taken from this time on [s].
    tracking_error : str
        Column (in rad) that is a tracking error, reported in degrees; empty if none.
    """

    stop: float
    step: float
    start: float = 0.0
    method: str = "gauss-seidel"
    evaluate_from: float = 0.0
    tracking_error: str = ""

    def window(self, time: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Mark the rows that statistics are taken from; all if the run ends before `evaluate_from`."""
        begin = self.evaluate_from if self.evaluate_from < time[-1] else time[0]
        return time >= begin - 1e-9 * self.step


@dataclass(frozen=True)
class Link:
    """A resolved connection: ``target = gain * source + offset``, unit conversion included."""

    source: tuple[str, str]
    target: tuple[str, str]
    kind: str
    gain: float
    offset: float


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
    for component in system.components:
        if not component.name or "." in component.name or component.name in descriptions:
            raise InputError(
                f"component name {component.name!r} -- expected names without a dot, each used once -- rename it"
            )
        descriptions[component.name] = describe(component.fmu)
    _check_instances(system, descriptions)
    components = tuple(
        replace(c, parameters={n: _start_value(c.name, descriptions[c.name], n, v) for n, v in c.parameters.items()})
        for c in system.components
    )
    links = tuple(_link(connection, descriptions) for connection in system.connections)
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


def _port(address: str, side: str, descriptions: Mapping[str, Description]) -> tuple[str, Port]:
    component, dot, variable = address.partition(".")
    if not dot or component not in descriptions:
        raise InputError(
            f"{side} {address!r} of a connection -- expected component.variable with one of {', '.join(descriptions)} "
            "-- correct the name"
        )
    description = descriptions[component]
    if variable not in description.ports:
        names = [p.name for p in (description.outputs if side == "source" else description.inputs)]
        raise InputError(
            f"{side} {address!r} of a connection: {description.path.name} has no variable {variable!r} -- expected "
            f"one of {', '.join(names) or 'none at all'} -- correct the name"
        )
    return component, description.ports[variable]


def _link(connection: Connection, descriptions: Mapping[str, Description]) -> Link:
    source_component, source = _port(connection.source, "source", descriptions)
    target_component, target = _port(connection.target, "target", descriptions)
    text = f"connection {connection.source} -> {connection.target}"
    if source.causality != "output" or target.causality != "input":
        raise InputError(
            f"{text} goes from {_article(source.causality)} to {_article(target.causality)} -- expected from an output "
            "to an input -- turn it round or choose another port"
        )
    if source.kind != target.kind:
        raise InputError(
            f"{text} joins {source.fmi_type} to {target.fmi_type} -- expected ports of one type -- choose another port"
        )
    if not (math.isfinite(connection.factor) and math.isfinite(connection.offset)):
        raise InputError(
            f"{text} has factor {connection.factor!r} and offset {connection.offset!r} -- expected finite numbers "
            "-- correct them"
        )
    if source.kind != "Real":
        if (connection.factor, connection.offset) != (1.0, 0.0):
            raise InputError(
                f"{text} has a factor or offset on {source.fmi_type} ports -- expected Real ports for that -- drop it"
            )
        scale, shift = 1.0, 0.0
    elif connection.convert_units and source.unit and target.unit:
        scale, shift = _conversion(source.unit, target.unit, text)
    else:
        scale, shift = 1.0, 0.0
    return Link(
        (source_component, source.name),
        (target_component, target.name),
        source.kind,
        connection.factor * scale,
        connection.factor * shift + connection.offset,
    )


def _article(causality: str) -> str:
    return f"{'an' if causality[0] in 'aeiou' else 'a'} {causality}"


def _conversion(source: str, target: str, text: str) -> tuple[float, float]:
    """Scale and shift from one unit to another; ``1`` (a `Sum`, say) takes and gives any unit unchanged."""
    if source == target or "1" in (source, target):
        return 1.0, 0.0
    try:
        if same_quantity(source, target):
            here, there = unit_to_si(source), unit_to_si(target)
            return here.factor / there.factor, (here.offset - there.offset) / there.factor
    except InputError:
        pass  # a unit that pint does not know fits only itself
    raise InputError(
        f"{text} joins [{source}] to [{target}] -- expected units that convert into each other -- choose another "
        "port, or switch the unit conversion of this connection off and state a factor"
    )


def _start_value(component: str, description: Description, name: str, value: Value) -> Value:
    address = f"{component}.{name}"
    port = description.ports.get(name)
    if port is None:
        raise unknown_variable(component, description, name)
    if port.causality in ("output", "independent", "calculatedParameter") or port.variability == "constant":
        raise InputError(
            f"start value {address!r} is {_article(port.causality)} -- expected a parameter or an input -- leave it out"
        )
    return typed_value(address, port, value)


def unknown_variable(component: str, description: Description, name: str) -> InputError:
    """The error for a start value of a variable that the FMU does not have."""
    settable = [p.name for p in description.ports.values() if p.causality in ("parameter", "input")]
    return InputError(
        f"start value '{component}.{name}': {description.path.name} has no such variable -- expected one of "
        f"{', '.join(settable) or 'none at all'} -- correct the name"
    )


def typed_value(address: str, port: Port, value: Value) -> Value:
    """Convert ``value`` (perhaps text from a command line) to the type of ``port``.

    Raises
    ------
    InputError
        If it does not fit.
    """
    text = str(value).strip()
    try:
        if port.kind == "String":
            return str(value)
        if port.kind == "Boolean":
            return {"true": True, "1": True, "false": False, "0": False}[text.lower()]
        number = float(value)
        if port.kind == "Integer":
            if number != int(number):
                raise ValueError
            return int(number)
        if math.isfinite(number):
            return number
    except (KeyError, ValueError, OverflowError, TypeError):
        pass
    wanted = {"Real": "a finite number", "Integer": "an integer", "Boolean": "true or false", "String": "a text"}
    unit = f" [{port.unit}]" if port.unit else ""
    raise InputError(f"start value {address} = {value!r} -- expected {wanted[port.kind]}{unit} -- correct it")


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
