"""What the translation of one function asks of the unit that it is translated for."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from types import FunctionType
from typing import Any, Protocol

from .arithmetic import Arithmetic
from .source import Source
from .types import Type


@dataclass(frozen=True)
class Law:
    """A function in C, for one set of argument types.

    Attributes
    ----------
    c_name : str
    source : Source
    arguments : dict of str to Type
    pointers : frozenset of str
        Arguments that come by their address: structs that the function does not assign to.
    returns : Type, optional
    fails : bool
        Whether it gets the pointer to a fault.
    lines : list of str
        Its body.
    """

    c_name: str
    source: Source
    arguments: dict[str, Type]
    pointers: frozenset[str]
    returns: Type | None
    fails: bool
    lines: list[str]

    def called(self, *given: str) -> str:
        """A call with the names of variables, or ``*p`` for what a pointer points to."""
        texts = [
            (text.removeprefix("*") if text.startswith("*") else f"&{text}") if name in self.pointers else text
            for name, text in zip(self.arguments, given, strict=True)
        ]
        return f"{self.c_name}({', '.join([*texts, *(['fault'] if self.fails else [])])})"


class Asked(Protocol):
    """The unit, see `unit.Unit`."""

    def law(
        self, function: FunctionType, kinds: list[Type], arithmetic: Arithmetic, caller: Source, node: ast.AST
    ) -> Law:
        """The function for arguments of these types, translated at its first use."""
        ...

    def type_name(self, kind: Type, arithmetic: Arithmetic) -> str:
        """Name of a type in C; a struct is declared."""
        ...

    def nothing(self, kind: Type, arithmetic: Arithmetic) -> None:
        """Have a constant of zeros of a struct type."""
        ...

    def constant(self, known: dict[str, Any], name: str, number: float | int) -> str:
        """Name in C of a module's constant."""
        ...

    def hint(self, text: Source, name: str) -> Type | None:
        """Type that an annotation names, where it is in the subset."""
        ...
