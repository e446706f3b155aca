"""Parameter sets of SSP: values with their units, prefixes and mappings to other names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fmpy.model_description import BaseUnit

from ...models.contract import InputError
from ..conversion import Definitions, conversion
from ..description import Description, Port
from ..start_values import Value
from .files import Files
from .xml import child, children, local, number


@dataclass(frozen=True)
class Linear:
    """``factor * value + offset``."""

    factor: float = 1.0
    offset: float = 0.0

    def after(self, first: Linear) -> Linear:
        """The two in one, ``first`` before."""
        return Linear(self.factor * first.factor, self.factor * first.offset + self.offset)

    @property
    def plain(self) -> bool:
        """Whether it changes nothing."""
        return (self.factor, self.offset) == (1.0, 0.0)


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
    linear: Linear = Linear()

    def of(self, address: str, port: Port, description: Description) -> Value:
        """The value in the unit and type of a variable.

        Raises
        ------
        InputError
            If its unit measures something else.
        """
        if port.kind == "Integer":
            return _item(self.value, port.name, description)
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


def _item(value: str, name: str, description: Description) -> str:
    """The number of an enumeration's item; anything else as it is."""
    variable = next((v for v in description.model.modelVariables if v.name == name), None)
    items = getattr(getattr(variable, "declaredType", None), "items", None) or ()
    return next((str(item.value) for item in items if item.name == value), value)


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


def bound(files: Files, owner: Any, definitions: Definitions) -> Iterator[Parameter]:
    """Parameters of all bindings of a component or system, mapped.

    Parameters
    ----------
    files : Files
        As the description sees them.
    owner : element
        With ``ParameterBindings``.
    definitions : mapping
        Units of the file that has the binding.

    Raises
    ------
    InputError
        A source outside the archive or of another kind, a parameter without value, a mapping that is not supported.
    """
    for binding in children(owner, "ParameterBindings", "ParameterBinding"):
        prefix = binding.get("prefix", "")
        table = files.table(binding, "ParameterSet", owner, "ParameterValues")
        mapping = child(binding, "ParameterMapping")
        if mapping is not None:
            mapping = files.table(mapping, "ParameterMapping", owner)
        own = {**definitions, **units(table)}
        given = [_parameter(files.path, node, prefix, own) for node in children(table, "Parameters", "Parameter")]
        yield from given if mapping is None else _mapped(files.path, given, mapping)


def _parameter(path: Path, node: Any, prefix: str, definitions: Definitions) -> Parameter:
    typed = next((c for c in node if c.get("value") is not None), None)
    if typed is None or not node.get("name"):
        raise InputError(
            f"SSP {path}: parameter {node.get('name')!r} -- expected a name and a value -- export it again"
        )
    unit = typed.get("unit", "") if local(typed) in ("Real", "Float64", "Float32") else ""
    return Parameter(prefix + node.get("name"), typed.get("value"), unit, definitions)


def _mapped(path: Path, given: list[Parameter], mapping: Any) -> Iterator[Parameter]:
    """Parameters under the names that a mapping gives them; those that it does not name keep theirs."""
    by_name = {parameter.name: parameter for parameter in given}
    used = set()
    for entry in children(mapping, "MappingEntry"):
        source, target = entry.get("source", ""), entry.get("target", "")
        if not source:  # left open in the tool that wrote it
            continue
        if source not in by_name:
            raise InputError(
                f"SSP {path}: a mapping names the parameter {source!r} -- expected one of {', '.join(by_name)} "
                "-- export it again"
            )
        used.add(source)
        parameter = by_name[source]
        if entry.get("suppressUnitConversion") in ("true", "1"):
            parameter = replace(parameter, unit="")
        yield _transformed(path, replace(parameter, name=target), entry)
    yield from (parameter for parameter in given if parameter.name not in used)


def _transformed(path: Path, parameter: Parameter, entry: Any) -> Parameter:
    for node in entry:
        if local(node) == "LinearTransformation":
            return replace(parameter, linear=linear(path, node.attrib))
        if local(node).endswith("MappingTransformation"):
            values = {m.get("source"): m.get("target") for m in children(node, "MapEntry")}
            if parameter.value not in values:
                raise InputError(
                    f"SSP {path}: parameter {parameter.name} = {parameter.value!r} -- expected one of "
                    f"{', '.join(map(str, values))}, which its mapping knows -- correct it"
                )
            return replace(parameter, value=values[parameter.value])
    return parameter


def linear(path: Path, attributes: Mapping[str, str]) -> Linear:
    """Of a ``LinearTransformation``."""
    return Linear(number(path, attributes.get("factor", "1")), number(path, attributes.get("offset", "0")))
