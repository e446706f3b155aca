"""Where the numbers of a table begin, what stands above them, and names with units in header cells."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from ..models.contract import InputError
from .units import unit_to_si

__all__ = ["HEAD_ROWS", "Layout", "find_layout", "is_number", "is_stamp", "name_and_unit", "unit_cell"]

HEAD_ROWS = 100
"""Rows of a file in which the header is looked for."""
MISSING = ("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "#N/A", "null", "NULL", "None")
"""Cells that stand for a number that was not taken."""
_BRACKETS = re.compile(r"^(?P<name>[^\[\]]+?(\[[\d,]+\][^\[\]]*?)*)\s*\[(?P<unit>[^\[\]]*)\]$")
_PARENTHESES = re.compile(r"^(?P<name>.*\S)\s*\((?P<unit>[^()]+)\)$")
_NUMBER = re.compile(r"^[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?$|^[-+]?(inf|infinity)$", re.IGNORECASE)
_STAMP = re.compile(r"^\d{4}-\d\d-\d\d([T ]\d\d:\d\d.*)?$|^\d{1,2}:\d\d:\d\d([.,]\d+)?$")
_MARKS = re.compile(r"^\s*(#|%|//)+\s*")
# '(in)' also means input, '(t)' time and '(a)' the first of two: pint would read inch, tonne and year
_NO_UNIT = re.compile(r"^(in|[^smgNAVKW°%1-])$")


@dataclass(frozen=True)
class Layout:
    """Rows of a table by number from 0: names, units (None where they stand with the names), first numbers."""

    header: int
    units: int | None
    data: int


def find_layout(rows: Sequence[Sequence[str]]) -> Layout | None:
    """Names over numbers, as high up as possible; None where the rows show no such thing.

    A header has no number in it and as many cells as the rows of numbers below. Between them may stand one row in
    which every cell is a unit or empty.

    Parameters
    ----------
    rows : sequence of sequence of str
        The head of a table, stripped cells.
    """
    for k, row in enumerate(rows):
        if len(row) < 2 or sum(map(bool, row)) < 2 or any(is_number(c) or is_stamp(c) for c in row):
            continue
        below = rows[k + 1 : k + 8]
        if _is_data(below[:6], len(row)):
            return Layout(k, None, k + 1)
        if below and len(below[0]) == len(row) and _is_units(below[0]) and _is_data(below[1:7], len(row)):
            return Layout(k, k + 1, k + 2)
    return None


def name_and_unit(cell: str) -> tuple[str, str | None]:
    """Name and unit of ``name [unit]`` or ``name (unit)``; the whole cell and None where there is no unit.

    Parentheses may hold anything: only what can be nothing but a unit is taken for one.
    """
    cell = cell.strip()
    if (found := _BRACKETS.match(cell)) and found["unit"].strip():
        return found["name"].strip(), found["unit"].strip()
    if (found := _PARENTHESES.match(cell)) and not _NO_UNIT.match(found["unit"].strip()) and _known(found["unit"]):
        return found["name"].strip(), found["unit"].strip()
    return cell, None


def unit_cell(cell: str) -> str | None:
    """Unit in a cell of a row of units, with or without brackets; None for an empty one."""
    return cell.strip().strip("[]()").strip() or None


def uncommented(line: str) -> str:
    """A line without the mark of a comment: names may stand behind one, as numpy writes them."""
    return _MARKS.sub("", line)


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or a decimal comma."""
    return _NUMBER.match(cell) is not None


def is_stamp(cell: str) -> bool:
    """Whether a cell looks like a date of ISO 8601, with or without a time of day, or a time of day."""
    return _STAMP.match(cell) is not None


def _is_data(rows: Sequence[Sequence[str]], cells: int) -> bool:
    filled = [row for row in rows if any(row)]
    return bool(filled) and all(len(row) == cells and any(map(is_number, row)) for row in filled)


def _is_units(row: Sequence[str]) -> bool:
    return any(row) and all(not cell or _known(unit_cell(cell) or "") for cell in row)


def _known(unit: str) -> bool:
    try:
        unit_to_si(unit)
    except InputError as wrong:
        return "expected one meaning" in str(wrong)  # a unit, to be written otherwise: said where it is converted
    return True
