"""Integers and Booleans on their way from an output to an input: what becomes of them, and what the input takes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from ..models.contract import InputError
from .description import Port


@dataclass(frozen=True)
class ValueTable:
    """What a connection makes of a value.

    Attributes
    ----------
    text : str
        The connection, as messages name it.
    values : mapping of int to int
        Values that become others; those that are not in it stay as they are.
    taken : collection of int or None
        What the input takes; None for all.
    expected : str
        The same in words.
    """

    text: str
    values: Mapping[int, int]
    taken: Collection[int] | None
    expected: str

    def takes(self, value: int) -> bool:
        """Whether the input takes what becomes of a value."""
        return self.taken is None or self.of(value) in self.taken

    def of(self, value: int) -> int:
        """What becomes of a value."""
        return self.values.get(value, value)

    def refusal(self, value: int, time: float) -> str:
        """The line for a value that the input does not take."""
        become = "" if self.of(value) == value else f", which becomes {self.of(value)}"
        return (
            f"{self.text} hands on {value}{become} at t = {time:g} s -- expected {self.expected} -- map the value, or "
            "correct its source"
        )


def value_table(
    text: str, source: Port, target: Port, values: Sequence[tuple[int, int]], items: Mapping[str, int]
) -> ValueTable | None:
    """Table of a connection; None if it changes nothing and the input takes all that the output can have.

    Parameters
    ----------
    text : str
        The connection.
    source, target : Port
        Its ends.
    values : sequence of (int, int)
        What becomes of what.
    items : mapping of str to int
        Of the input, if it is an Enumeration.

    Raises
    ------
    InputError
        Values on ports that are neither Integer nor Boolean, or that the input does not take.
    """
    if values and source.kind not in ("Integer", "Boolean"):
        raise InputError(
            f"{text} maps values of {source.fmi_type} ports -- expected Integer, Enumeration or Boolean -- drop the "
            "mapping"
        )
    taken: Collection[int] | None = None
    expected = ""
    if items and (values or source.fmi_type != "Enumeration"):
        taken = frozenset(items.values())
        expected = f"an item of the Enumeration {target.name}: {', '.join(f'{v} {k}' for k, v in items.items())}"
    elif not items and target.kind == "Integer":
        here, there = _range(source.fmi_type), _range(target.fmi_type)
        if here.start < there.start or here.stop > there.stop:
            taken, expected = there, f"{there.start} to {there.stop - 1}, which {target.fmi_type} holds"
    table = ValueTable(text, dict(values), taken, expected)
    for old, new in values:
        if not table.takes(old):
            raise InputError(f"{text} maps {old} to {new} -- expected {expected} -- correct the mapping")
    return None if taken is None and not values else table


def _range(fmi_type: str) -> range:
    """What an integer type holds; Integer and Enumeration of FMI 2.0 have 32 bits."""
    size = fmi_type.partition("Int")[2]
    bits = int(size) if size.isdecimal() else 32
    return range(2**bits) if fmi_type.startswith("U") else range(-(2 ** (bits - 1)), 2 ** (bits - 1))
