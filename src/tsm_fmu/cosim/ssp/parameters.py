"""Parameter sets of SSP: values with their units, prefixes and mappings to other names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...models.contract import InputError
from ..conversion import Definitions, conversion
from ..description import Description, Port
from ..start_values import Value, article
from .connectors import Connector, units
from .files import Files
from .transformations import UNCHANGED, Linear, transformation
from .xml import SSV_TYPE, child, children, local


@dataclass(frozen=True)
class Parameter:
    """One value on its way to a variable.

    Attributes
    ----------
    name : str
        As the set or its mapping calls it, with the prefix of the binding.
    value : str
        As written.
    unit : str
        As written; empty if none, or if it is not to be converted.
    definitions : mapping
        Units that the file defines.
    linear : Linear
        What the mapping does after the conversion.
    """

    name: str
    value: str
    unit: str
    definitions: Definitions
    linear: Linear = UNCHANGED

    def of(self, address: str, port: Port, description: Description, connector: Connector) -> Value:
        """The value in the unit and type of a variable, whose ``connector`` may state them otherwise than its FMU.

        Raises
        ------
        InputError
            If its unit measures something else, or a factor goes to what is no Real.
        """
        if port.kind != "Real" and not self.linear.plain:
            raise InputError(
                f"parameter {address} has a factor or offset on {article(port.fmi_type)} -- expected a Real for that "
                "-- drop it"
            )
        if port.kind == "Integer":
            items = {**connector.items, **description.items(port)}
            texts = [self.value] if self.value in items else self.value.split()
            return " ".join(str(items.get(text, text)) for text in texts)
        if port.kind != "Real":
            return self.value
        text = f"parameter {address} goes from"
        unit, defined = (connector.unit, connector.definitions) if connector.unit else (port.unit, description.units)
        total = self.linear
        if self.unit and unit:
            definitions = (self.definitions, defined)
            total = total.after(Linear(*conversion(self.unit, unit, text, definitions, any_to_one=False)))
        if unit and port.unit:
            total = Linear(*conversion(unit, port.unit, text, (defined, description.units))).after(total)
        if total.plain:
            return self.value
        try:
            values = [total.factor * float(v) + total.offset for v in self.value.split()]
        except ValueError:
            return self.value  # refused by its name when the system is checked
        return " ".join(repr(v) for v in values)


def bound(files: Files, owner: Any, definitions: Definitions, notes: list[str]) -> Iterator[Parameter]:
    """Parameters of all bindings of a component or system, mapped.

    Parameters
    ----------
    files : Files
        As the description sees them.
    owner : element
        With ``ParameterBindings``.
    definitions : mapping
        Units of the file that has the binding.
    notes : list of str
        Gets what a mapping leaves out.

    Raises
    ------
    InputError
        A source outside the archive or of another kind, a parameter without value, a damaged mapping.
    """
    for binding in children(owner, "ParameterBindings", "ParameterBinding"):
        prefix = binding.get("prefix", "")
        table = _table(files, binding, owner)
        mapping = child(binding, "ParameterMapping")
        if mapping is not None:
            mapping = files.table(mapping, "ParameterMapping", owner)
        own = {**definitions, **units(files.path, table)}
        given = [_parameter(files.path, node, prefix, own) for node in children(table, "Parameters", "Parameter")]
        yield from given if mapping is None else _mapped(files.path, given, mapping, notes)


def _table(files: Files, binding: Any, owner: Any) -> Any:
    """The ``ParameterSet`` of a binding; None where it gives no values at all."""
    known = binding.get("type", SSV_TYPE) == SSV_TYPE
    table = files.table(binding, "ParameterSet", owner, "ParameterValues") if known else None
    if table is None and (not known or any(node.get("value") is not None for node in binding.iter())):
        raise InputError(
            f"SSP {files.path}: parameter binding of {local(owner).lower()} {owner.get('name')!r} has no ParameterSet "
            f"-- expected one inside ParameterValues, or the source of one, of type {SSV_TYPE} -- export it again"
        )
    return table


def _parameter(path: Path, node: Any, prefix: str, definitions: Definitions) -> Parameter:
    typed, value = next(((c, text) for c in node if (text := _written(c)) is not None), (None, ""))
    if typed is None or not node.get("name"):
        raise InputError(
            f"SSP {path}: parameter {node.get('name')!r} -- expected a name and a value -- export it again"
        )
    unit = typed.get("unit", "") if local(typed) in ("Real", "Float64", "Float32") else ""
    return Parameter(prefix + node.get("name"), value, unit, definitions)


def _written(typed: Any) -> str | None:
    """The value of an element; of an array of texts (SSP 2.0) it holds them as elements of its own."""
    each = [value.get("value") or value.text or "" for value in children(typed, "Value")]
    return " ".join(each) if each else typed.get("value")


def _mapped(path: Path, given: list[Parameter], mapping: Any, notes: list[str]) -> Iterator[Parameter]:
    """Parameters under the names that a mapping gives them; those that it does not name are not applied (SSP 2.0)."""
    by_name = {parameter.name: parameter for parameter in given}
    used = set()
    for entry in children(mapping, "MappingEntry"):
        source, target = entry.get("source", ""), entry.get("target", "")
        if not source:  # left open in the tool that wrote it
            continue
        if source not in by_name:
            notes.append(f"a mapping names the parameter {source} for {target}, which its set does not have: left out")
            continue
        used.add(source)
        parameter = by_name[source]
        if entry.get("suppressUnitConversion") in ("true", "1"):
            parameter = replace(parameter, unit="")
        linear, values = transformation(path, entry, f"parameter mapping {source} -> {target}")
        value = parameter.value if values is None else values.of(parameter.value)
        yield replace(parameter, name=target, value=value, linear=linear)
    if unused := [name for name in by_name if name not in used]:
        notes.append(f"not applied, because their mapping does not name them: {', '.join(unused)}")
