"""Types of the subset of Python that kernels are written in, and how C spells them.

A named tuple becomes a struct of the same name and fields, a tuple of one type a struct around an array, any other
tuple a struct of its items.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class Scalar:
    """A number or truth value; ``whole`` is a whole number kept in a double, as `math.floor` gives it."""

    name: str


FLOAT, WHOLE, INT, BOOL = Scalar("float"), Scalar("whole"), Scalar("int"), Scalar("bool")
NOTHING = Scalar("nothing")
"""What a function gives that returns no value."""


@dataclass(frozen=True)
class Array:
    """A tuple of items of one type."""

    item: Type
    size: int


@dataclass(frozen=True)
class Mixed:
    """A tuple of items of several types."""

    items: tuple[Type, ...]


@dataclass(frozen=True)
class Record:
    """A named-tuple class."""

    cls: Any

    @property
    def fields(self) -> dict[str, Type]:
        return _fields(self.cls)


C_WORDS = frozenset(
    "asm auto bool break case char const continue default do double else enum extern false float for goto if inline "
    "int long main register restrict return short signed sizeof static struct switch true typedef union unsigned "
    "void volatile while fault dual".split()
)
"""Names that a variable cannot have in C, or that the translation uses itself."""

Type = Scalar | Array | Mixed | Record

_SCALARS = {float: FLOAT, int: INT, bool: BOOL}
_KNOWN: dict[Any, dict[str, Type]] = {}


def of_hint(hint: Any) -> Type | None:
    """Type of a resolved annotation; None for one outside the subset, such as Any."""
    if hint in _SCALARS:
        return _SCALARS[hint]
    if is_record(hint):
        return Record(hint)
    if get_origin(hint) is tuple:
        items = [of_hint(h) for h in get_args(hint) if h is not Ellipsis]
        if items and None not in items:
            return of_items([i for i in items if i is not None])
    return None


def of_items(items: list[Type]) -> Array | Mixed:
    """Type of a tuple with these items."""
    if all(item == items[0] for item in items):
        return Array(items[0], len(items))
    return Mixed(tuple(items))


def items_of(kind: Type) -> list[Type] | None:
    """Types of what a tuple or named tuple holds, in order; None for a scalar."""
    if isinstance(kind, Array):
        return [kind.item] * kind.size
    if isinstance(kind, Mixed):
        return list(kind.items)
    if isinstance(kind, Record):
        return list(kind.fields.values())
    return None


def is_record(cls: Any) -> bool:
    """Tell whether an object is a named-tuple class."""
    return isinstance(cls, type) and issubclass(cls, tuple) and hasattr(cls, "_fields")


def _fields(cls: Any) -> dict[str, Type]:
    if cls not in _KNOWN:
        hints = get_type_hints(cls)
        found = {field: of_hint(hints[field]) for field in cls._fields}
        wrong = next((field for field, kind in found.items() if kind is None), None)
        if wrong is not None:
            raise TypeError(f"{cls.__module__}.{cls.__qualname__}.{wrong} has a type outside the subset of kernels")
        _KNOWN[cls] = {field: kind for field, kind in found.items() if kind is not None}
    return _KNOWN[cls]


def c_variable(name: str) -> str:
    """Name of a variable, field or function in C: the same, where C lets it."""
    return f"{name}_" if name in C_WORDS else name


def member(owner: str, name: str) -> str:
    """Text of a part of a struct; ``(*p).x`` is written ``p->x``."""
    return f"{owner[2:-1]}->{name[1:]}" if owner.startswith("(*") else owner + name


def members(kind: Type) -> list[str]:
    """How C reaches each item of a tuple or named tuple."""
    if isinstance(kind, Record):
        return [f".{c_variable(field)}" for field in kind.fields]
    if isinstance(kind, Array):
        return [f".item[{n}]" for n in range(kind.size)]
    return [f".item{n}" for n in range(len(items_of(kind) or ()))]
