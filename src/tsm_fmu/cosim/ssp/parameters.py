"""Parameter sets of SSP: values with their units, prefixes and mappings to other names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fmpy.model_description import BaseUnit

from ...models.contract import InputError
from ..conversion import Definitions, conversion
from ..description import Description, Port
from ..start_values import Value
from .files import Files
from .transformations import UNCHANGED, Linear, transformation
from .xml import child, children, local


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

    def of(self, address: str, port: Port, description: Description) -> Value:
        """The value in the unit and type of a variable.

        Raises
        ------
        InputError
            If its unit measures something else.
        """
        if port.kind == "Integer":
            return str(description.items(port).get(self.value, self.value))
        if port.kind != "Real" or (self.linear.plain and self.unit in ("", port.unit)):
            return self.value
        scale, shift = 1.0, 0.0
        if self.unit and port.unit:
            scale, shift = conversion(
                self.unit, port.unit, f"parameter {address} goes from", (self.definitions, description.units),
                any_to_one=False,
            )  # fmt: skip
        try:
            values = [self.linear.factor * (scale * float(v) + shift) + self.linear.offset for v in self.value.split()]
        except ValueError:
            return self.value  # refused by its name when the system is checked
        return " ".join(repr(v) for v in values)


def units(root: Any) -> dict[str, Any]:
    """Units that a file defines, by name."""
    found: dict[str, Any] = {}
    for unit in children(root, "Units", "Unit"):
        base = child(unit, "BaseUnit")
        if base is not None:
            given = {k: v for k, v in base.attrib.items() if hasattr(BaseUnit(), k)}
            numbers: dict[str, Any] = {k: float(v) if k in ("factor", "offset") else int(v) for k, v in given.items()}
            found[unit.get("name", "")] = BaseUnit(**numbers)
    return found


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
        table = files.table(binding, "ParameterSet", owner, "ParameterValues")
        mapping = child(binding, "ParameterMapping")
        if mapping is not None:
            mapping = files.table(mapping, "ParameterMapping", owner)
        own = {**definitions, **units(table)}
        given = [_parameter(files.path, node, prefix, own) for node in children(table, "Parameters", "Parameter")]
        yield from given if mapping is None else _mapped(files.path, given, mapping, notes)


def _parameter(path: Path, node: Any, prefix: str, definitions: Definitions) -> Parameter:
    typed = next((c for c in node if c.get("value") is not None), None)
    if typed is None or not node.get("name"):
        raise InputError(
            f"SSP {path}: parameter {node.get('name')!r} -- expected a name and a value -- export it again"
        )
    unit = typed.get("unit", "") if local(typed) in ("Real", "Float64", "Float32") else ""
    return Parameter(prefix + node.get("name"), typed.get("value"), unit, definitions)


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
