"""How operations on numbers are written in C: plainly, or on dual numbers, which carry a derivative along.

What raises in Python is a call of a ``checked_`` function of ``checked.h`` that notes a fault; `dual.h` does the same
for numbers with a derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

from .types import BOOL, FLOAT, INT, WHOLE, Array, Mixed, Record, Type

PRIMARY, UNARY, TIMES, PLUS, ORDER, EQUAL, AND, OR, CHOICE = 15, 14, 13, 12, 10, 9, 5, 4, 3
"""Ranks of C's operators: a higher one binds tighter."""

_RANKS = {"*": TIMES, "/": TIMES, "%": TIMES, "+": PLUS, "-": PLUS}
_INFINITE = {math.inf: "INFINITY", -math.inf: "-INFINITY"}
_DUAL = {"+": "dual_add", "-": "dual_sub", "*": "dual_mul"}

FAILING = ("acos", "asin", "atanh", "cos", "cosh", "exp", "expm1", "log", "log1p", "pow", "sin", "sinh", "sqrt", "tan")
"""Functions of `math` that raise outside their domain or range."""
SAFE = ("asinh", "atan", "atan2", "copysign", "degrees", "radians", "tanh")
"""Functions of `math` that take any number."""

RETURN_NOTHING = "return @nothing@;"
"""Stands in for what a failing function returns until the type of its result is known."""
CHECK = f"if (RARELY(fault->raised)) {RETURN_NOTHING}"
"""Follows each statement that may have noted a fault."""


@dataclass(frozen=True)
class Value:
    """An expression in C.

    Attributes
    ----------
    text : str
    type : Type
    rank : int
        Of its outermost operator.
    fails : bool
        Whether it may note a fault.
    number : float or int, optional
        Its value where it is a literal.
    elements : tuple of Value, optional
        Items of a tuple that was written out and needs no variable.
    """

    text: str
    type: Type
    rank: int = PRIMARY
    fails: bool = False
    number: float | int | None = None
    elements: tuple[Value, ...] | None = None


def inside(value: Value, rank: int) -> str:
    """Text of an operand, in parentheses where an operator of ``rank`` binds tighter."""
    return f"({value.text})" if value.rank < rank else value.text


def infix(operator: str, a: Value, b: Value, kind: Type) -> Value:
    """Two operands of a left-associative operator, grouped as in Python: rounding depends on it."""
    rank = _RANKS[operator]
    return Value(f"{inside(a, rank)} {operator} {inside(b, rank + 1)}", kind, rank, a.fails or b.fails)


def call(name: str, kind: Type, *arguments: Value, fault: bool = False) -> Value:
    """Call of a C function; with ``fault`` it gets the pointer to note one."""
    texts = [a.text for a in arguments] + (["fault"] if fault else [])
    return Value(f"{name}({', '.join(texts)})", kind, PRIMARY, fault or any(a.fails for a in arguments))


def literal_text(number: float) -> str:
    """A float as C has it, to the last bit."""
    return _INFINITE.get(number, repr(number))


class Arithmetic(Protocol):
    """Spelling of operations on floats; those on integers and truth values are the same in both."""

    suffix: str
    """Of names of struct types."""

    def spelled(self, scalar: Any) -> str: ...
    def literal(self, number: float) -> Value: ...
    def from_double(self, value: Value) -> Value: ...
    def binary(self, operator: str, a: Value, b: Value) -> Value: ...
    def negative(self, a: Value) -> Value: ...
    def function(self, name: str, kind: Type, arguments: list[Value], fault: bool) -> Value: ...
    def plain(self, a: Value) -> Value: ...


class Plain:
    """Floats are doubles."""

    suffix = ""

    def spelled(self, scalar: Any) -> str:
        return {FLOAT: "double", WHOLE: "double", INT: "int", BOOL: "bool"}[scalar]

    def literal(self, number: float) -> Value:
        return Value(literal_text(number), FLOAT, number=number)  # a negative one is never negated, but folded

    def from_double(self, value: Value) -> Value:
        return value

    def binary(self, operator: str, a: Value, b: Value) -> Value:
        if operator in ("+", "-", "*") or (operator == "/" and b.number):
            return infix(operator, a, b, FLOAT)
        return call({"/": "checked_div", "%": "checked_mod", "**": "checked_power"}[operator], FLOAT, a, b, fault=True)

    def negative(self, a: Value) -> Value:
        return Value(f"-{inside(a, PRIMARY)}", FLOAT, UNARY, a.fails)

    def function(self, name: str, kind: Type, arguments: list[Value], fault: bool) -> Value:
        plain = {"abs": "fabs", "min": "lesser", "max": "greater"}.get(name, name)
        return call(f"checked_{name}" if fault else plain, kind, *arguments, fault=fault)

    def plain(self, a: Value) -> Value:
        return a


class Dual:
    """Floats are dual numbers: a value and its derivative along the direction that the caller chose.

    Nothing is checked that the same step in plain numbers has checked: derivatives are asked for where it succeeded.
    """

    suffix = "_dual"

    def spelled(self, scalar: Any) -> str:
        return {FLOAT: "Dual", WHOLE: "double", INT: "int", BOOL: "bool"}[scalar]

    def literal(self, number: float) -> Value:
        return Value(f"dual({literal_text(number)})", FLOAT, number=number)

    def from_double(self, value: Value) -> Value:
        return call("dual", FLOAT, value)

    def binary(self, operator: str, a: Value, b: Value) -> Value:
        if operator in _DUAL:
            return call(_DUAL[operator], FLOAT, a, b)
        return call({"/": "dual_div", "%": "dual_mod", "**": "dual_pow"}[operator], FLOAT, a, b)

    def negative(self, a: Value) -> Value:
        return call("dual_neg", FLOAT, a)

    def function(self, name: str, kind: Type, arguments: list[Value], fault: bool) -> Value:
        if kind == FLOAT:
            return call(f"dual_{name}", FLOAT, *arguments)
        return call(f"checked_{name}" if fault else name, kind, *map(self.plain, arguments), fault=fault)

    def plain(self, a: Value) -> Value:
        if a.number is not None:
            return Value(literal_text(float(a.number)), FLOAT)
        return Value(f"{inside(a, PRIMARY)}.v", FLOAT, PRIMARY, a.fails) if a.type == FLOAT else a


def type_name(kind: Type, arithmetic: Arithmetic, records: dict[Any, str]) -> str:
    """C's name of a type."""
    if isinstance(kind, Record):
        return records[kind.cls] + arithmetic.suffix
    if isinstance(kind, Array):
        item = type_name(kind.item, arithmetic, records)
        return f"{item[0].upper()}{item[1:]}s{kind.size}"
    if isinstance(kind, Mixed):
        names = [type_name(item, arithmetic, records) for item in kind.items]
        return "_and_".join(name[0].upper() + name[1:] for name in names)
    return arithmetic.spelled(kind)
