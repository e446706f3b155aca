"""What every model and effect is made of, and the checks that hold for all of them.

A *kernel* is a module with four named tuples, ``Params``, ``State``, ``Inputs`` and ``Outputs``, and
pure functions on them::

    start(p, u)        -> (state, outputs)   at the first input: motion starts there, no jump from zero
    step(p, s, u, dt)  -> (state, outputs)   inputs hold over the step, outputs are those at its end
    check(p)           -> None               joint conditions on the parameters; optional
    warnings(p)        -> (str, ...)         what a user should know about allowed parameters; optional

``warnings`` is for parameters that simulate but bite: one line each, ``what (value) -- consequence -- what to do``.
It runs once at construction; an FMU logs the lines, the command line prints them, nothing is refused.

Each field is declared once, ``name: Annotated[float, Quantity(unit, meaning, ...)] = default``; FMU
variables, documentation, identification bounds and the command line derive from that declaration.
State fields are always floats, so that the compiled form keeps one type from step to step.

This file runs inside an FMU on a host that has only Python: it imports ``typing`` and ``math`` alone.
"""

import math
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

__all__ = ["InputError", "Preset", "Quantity", "Variable", "check_bounds", "variables"]


class InputError(ValueError):
    """Wrong input: one line that says what, the value, what was expected and what to do."""


class Quantity(NamedTuple):
    """Unit, meaning and bounds of one variable, in SI.

    Equal only to one of the same class, unlike other named tuples: each FMU in a process has a copy of this
    file, and ``typing`` hands out ``Annotated[...]`` from a cache, which in Python 3.11.2 looks at equality alone
    and so would answer with another FMU's class.

    Attributes
    ----------
    unit : str
        SI unit as FMI writes it: ``"N"``, ``"rad/s"``, ``"1/rad"``, ``"1"`` for a pure number.
    meaning : str
        What the quantity is, with the source's equation number where it has one.
    lo, hi : float
        Bounds; ``open_lo``/``open_hi`` say that the bound itself is not allowed.
    display : str
        Unit that people prefer to read (``"deg"``, ``"mm"``); empty: the SI unit.
    """

    unit: str
    meaning: str
    lo: float = -math.inf
    hi: float = math.inf
    open_lo: bool = False
    open_hi: bool = False
    display: str = ""

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and tuple.__eq__(self, other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash((type(self), *self))


class Variable(NamedTuple):
    """A declared field: public name, field name in Python, type, start value and `Quantity`."""

    name: str
    field: str
    kind: type
    start: float
    quantity: Quantity


class Preset(NamedTuple):
    """A named parameter set.

    Attributes
    ----------
    source : str
        Where the numbers are from.
    printed : dict of str to (float, str)
        The numbers as the source prints them, with the source's unit.
    si : dict of str to float
        The same in SI, only where they differ from the default of the field.
    """

    source: str
    printed: dict[str, tuple[float, str]]
    si: dict[str, float]


def variables(fields: Any) -> tuple[Variable, ...]:
    """List the declared variables of a named-tuple class in field order.

    A trailing underscore of a field name (``lambda_``) is not part of the public name, and a double
    one inside it (``load_dependence__k``) is its dot. A field without a default starts at 0.

    Raises
    ------
    TypeError
        If a field is not ``Annotated[float | int, Quantity(...)]``.
    """
    hints = get_type_hints(fields, include_extras=True)
    found = []
    for field in fields._fields:
        hint = hints[field]
        if get_origin(hint) is not Annotated or not isinstance(get_args(hint)[1], Quantity):
            raise TypeError(f"{fields.__qualname__}.{field} is not Annotated[type, Quantity(...)]")
        kind, quantity = get_args(hint)[:2]
        start = kind(fields._field_defaults.get(field, 0))
        found.append(Variable(field.rstrip("_").replace("__", "."), field, kind, start, quantity))
    return tuple(found)


def check_bounds(declared: tuple[Variable, ...], values: Any) -> None:
    """Raise `InputError` for the first value that is not finite or lies outside its declared bounds."""
    for variable, value in zip(declared, values, strict=True):
        quantity = variable.quantity
        above = value > quantity.lo or (value == quantity.lo and not quantity.open_lo)
        below = value < quantity.hi or (value == quantity.hi and not quantity.open_hi)
        if not (math.isfinite(value) and above and below):
            raise InputError(
                f"parameter {variable.name} = {with_unit(repr(value), quantity.unit)} ({quantity.meaning}) -- expected "
                f"{_interval(quantity)} -- choose a value inside"
            )


def with_unit(number: str, unit: str) -> str:
    """A number as text with its unit, none for 1."""
    return number if unit == "1" else f"{number} {unit}"


def _interval(quantity: Quantity) -> str:
    if math.isinf(quantity.lo) and math.isinf(quantity.hi):
        return "a finite number"
    left = "(" if quantity.open_lo or math.isinf(quantity.lo) else "["
    right = ")" if quantity.open_hi or math.isinf(quantity.hi) else "]"
    return f"a value in {left}{quantity.lo:g}, {quantity.hi:g}{right}"
