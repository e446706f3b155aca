"""Start values of a component: which variables take one, and of what type."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..models.contract import InputError
from .description import Description, Port

Value = float | int | bool | str


def start_values(component: str, description: Description, values: Mapping[str, Value]) -> dict[str, Value]:
    """The values by scalar or element of an array, of the type that the FMU declares.

    Raises
    ------
    InputError
        Unknown variable, one that takes no start value, another type, or another number of elements.
    """
    found: dict[str, Value] = {}
    for name, value in values.items():
        elements = description.elements(name)
        if elements == (name,):
            found[name] = _start_value(component, description, name, value)
            continue
        given = str(value).split()
        if len(given) not in (1, len(elements)):
            raise InputError(
                f"start value {component}.{name} = {value!r} has {len(given)} numbers -- expected {len(elements)}, "
                f"one for each of {elements[0]} to {elements[-1]} -- complete it"
            )
        given = given * len(elements) if len(given) == 1 else given
        found |= {e: _start_value(component, description, e, v) for e, v in zip(elements, given, strict=True)}
    return found


def _start_value(component: str, description: Description, name: str, value: Value) -> Value:
    address = f"{component}.{name}"
    port = description.ports.get(name)
    if port is None:
        raise unknown_variable(component, description, name)
    if not takes_start(port):
        raise InputError(
            f"start value {address!r} is {article(port.causality)} -- expected a parameter or an input -- leave it out"
        )
    typed = typed_value(address, port, value)
    if port.causality == "structuralParameter" and typed != typed_value(address, port, port.start or 0):
        raise InputError(
            f"start value {address} = {value!r} changes the size of arrays -- expected its default {port.start}, which "
            "the FMU is wired for -- leave it out"
        )
    return typed


def takes_start(port: Port) -> bool:
    """Whether a user may give it a start value: not what the FMU computes, nor a constant."""
    if port.causality == "output" and port.initial not in ("exact", "approx"):
        return False
    return port.causality not in ("independent", "calculatedParameter") and port.variability != "constant"


def unknown_variable(component: str, description: Description, name: str) -> InputError:
    """The error for a start value of a variable that the FMU does not have."""
    settable = [p.array or p.name for p in description.ports.values() if p.causality in ("parameter", "input")]
    return InputError(
        f"start value '{component}.{name}': {description.path.name} has no such variable -- expected one of "
        f"{', '.join(dict.fromkeys(settable)) or 'none at all'} -- correct the name"
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
        if port.kind == "Integer" and text.lstrip("+-").isdecimal():
            return int(text)  # 64 bits are more than a float keeps
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


def article(word: str) -> str:
    """The word after its indefinite article."""
    return f"{'an' if word[0] in 'aeiouEI' else 'a'} {word}"
