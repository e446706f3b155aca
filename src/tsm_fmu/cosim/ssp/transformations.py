"""Transformations of SSP: what becomes of a value on a connection or in a parameter mapping."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...models.contract import InputError
from .xml import children, local, number


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


UNCHANGED = Linear()


@dataclass(frozen=True)
class ValueMapping:
    """Values that become others; those that it does not name stay as they are (SSP 2.0, Transformation Choice).

    Attributes
    ----------
    kind : {"Boolean", "Integer", "Enumeration"}
        Of the values.
    entries : mapping of str to str
        As written; Booleans as ``true`` and ``false``, of an Enumeration the names of its items.
    """

    kind: str
    entries: Mapping[str, str]

    def of(self, value: str) -> str:
        """What a written value becomes."""
        return self.entries.get(_one_writing(self.kind, value), value)

    def numbers(self, source: Mapping[str, int], target: Mapping[str, int], what: str) -> dict[int, int]:
        """The entries as numbers.

        Parameters
        ----------
        source, target : mapping of str to int
            Items of the enumeration on each side, where it is one.
        what : str
            Begin of the message.

        Raises
        ------
        InputError
            If an enumeration has no such item.
        """
        if self.kind == "Boolean":
            return {int(k == "true"): int(v == "true") for k, v in self.entries.items()}
        if self.kind == "Integer":
            return {int(k): int(v) for k, v in self.entries.items()}
        for names, items in ((self.entries.keys(), source), (self.entries.values(), target)):
            if unknown := [name for name in names if name not in items]:
                raise InputError(
                    f"{what} maps {unknown[0]!r} -- expected one of {', '.join(items) or 'an enumeration'} "
                    "-- correct the mapping"
                )
        return {source[k]: target[v] for k, v in self.entries.items()}


def transformation(path: Path, node: Any, what: str) -> tuple[Linear, ValueMapping | None]:
    """The transformation of a connection or mapping entry (``what``); a linear one that changes nothing if none.

    Raises
    ------
    InputError
        Numbers or values that are none, two entries for one value.
    """
    for kind in node:
        if local(kind) == "LinearTransformation":
            return linear(path, kind.attrib), None
        name = local(kind).removesuffix("MappingTransformation")
        if name in ("Boolean", "Integer", "Enumeration") and name != local(kind):
            return UNCHANGED, _mapping(path, kind, name, what)
    return UNCHANGED, None


def _mapping(path: Path, node: Any, kind: str, what: str) -> ValueMapping:
    entries: dict[str, str] = {}
    for entry in children(node, "MapEntry"):
        written = [entry.get(side) for side in ("source", "target")]
        source, target = ("" if text is None else _one_writing(kind, text) for text in written)
        for text in (source, target):
            if None in written or (kind == "Boolean" and text not in ("true", "false")) or not _fits(kind, text):
                raise InputError(
                    f"SSP {path}: {what} maps {written[0]!r} to {written[1]!r} -- expected values of type {kind} "
                    "-- export it again"
                )
        if source in entries:
            raise InputError(f"SSP {path}: {what} maps {source!r} twice -- expected one entry each -- export it again")
        entries[source] = target
    return ValueMapping(kind, entries)


_INTEGER = re.compile(r"[+-]?[0-9]+")


def _fits(kind: str, text: str) -> bool:
    return kind != "Integer" or _INTEGER.fullmatch(text) is not None


def _one_writing(kind: str, text: str) -> str:
    """A value as its mapping has it: 1 is true, and 07 is 7."""
    plain = text.strip()
    if kind == "Boolean":
        return {"1": "true", "0": "false"}.get(plain, plain)
    return str(int(plain)) if kind == "Integer" and _INTEGER.fullmatch(plain) else text


def linear(path: Path, attributes: Mapping[str, str]) -> Linear:
    """Of a ``LinearTransformation``."""
    return Linear(number(path, attributes.get("factor", "1")), number(path, attributes.get("offset", "0")))
