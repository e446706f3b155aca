"""Text tables as other programs write them: encoding, separator, decimal sign and header found, never guessed.

A reading is taken only where the whole head of the file agrees with it: names over rows of as many numbers. The
numbers themselves are read by Arrow, which refuses what is none.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv

from ..models.contract import InputError
from .header import HEAD_ROWS, MISSING, Layout, find_layout, is_number, name_and_unit, uncommented, unit_cell
from .raw import RawTable

__all__ = ["read_text"]

_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "spaces"}
_MARKS = (
    (codecs.BOM_UTF8, "utf-8", "UTF-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le", "UTF-32"),
    (codecs.BOM_UTF32_BE, "utf-32-be", "UTF-32"),
    (codecs.BOM_UTF16_LE, "utf-16-le", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16-be", "UTF-16"),
)
_LONGEST_HEAD = 1_000_000  # characters
_SPACED = re.compile(r"[^\s\[(]+(?:\s*\[[^\]]*\]|\s*\([^)]*\))?")
_TYPED = 200  # rows that tell numbers from text


@dataclass(frozen=True)
class _Dialect:
    separator: str
    layout: Layout
    cells: list[str]


def read_text(path: Path, content: bytes) -> RawTable:
    """Cells and columns of a text table.

    Raises
    ------
    InputError
        No header over rows of numbers, or a cell that is no number, with row and column.
    """
    text, notes = _decoded(path, content)
    if "\r" in text:
        if "\n" not in text:
            notes.append("lines end in carriage returns")
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    text = text.rstrip() + "\n"
    head = text[:_LONGEST_HEAD].split("\n", HEAD_ROWS)[:HEAD_ROWS]
    if len(text) <= _LONGEST_HEAD and head[-1] == "":
        head.pop()
    dialect = _dialect(head)
    if dialect is None:
        raise InputError(_no_header(path, head))
    notes += _dialect_notes(dialect)
    rows = text.split("\n", dialect.layout.data)
    body = rows[-1] if len(rows) > dialect.layout.data else ""
    if dialect.separator == " ":
        body = "\n".join("\t".join(line.split()) for line in body.split("\n"))
    units = None
    if dialect.layout.units is not None:
        units = [unit_cell(cell) for cell in _split(head[dialect.layout.units], dialect.separator)]
    first_row = dialect.layout.data + 1
    columns, decimal = _columns(path, body, dialect, first_row)
    notes += [decimal] if decimal else []
    return RawTable(dialect.cells, units, columns, first_row, notes)


def _decoded(path: Path, content: bytes) -> tuple[str, list[str]]:
    for mark, codec, name in _MARKS:
        if content.startswith(mark):
            try:
                return content[len(mark) :].decode(codec), [f"byte-order mark: text in {name}"]
            except UnicodeDecodeError as failure:
                raise InputError(
                    f"{path}: byte {len(mark) + failure.start} is not {name}, as its byte-order mark says "
                    f"-- expected text in {name} -- copy it again"
                ) from None
    if b"\x00" in content:
        for codec, zeros in (("utf-16-le", content[1:200:2]), ("utf-16-be", content[0:200:2])):
            if len(content) % 2 == 0 and not any(zeros):
                return content.decode(codec, errors="replace"), ["text in UTF-16, without a byte-order mark"]
        raise InputError(f"{path} holds zero bytes -- expected text -- save it as UTF-8 CSV")
    try:
        return content.decode(), []
    except UnicodeDecodeError as failure:
        from charset_normalizer import from_bytes

        lines = content.split(b"\n", HEAD_ROWS)[:HEAD_ROWS]
        found = from_bytes(b"\n".join(lines)[:_LONGEST_HEAD], cp_isolation=["cp1252", "latin_1"]).best()
        codec = found.encoding if found is not None and found.encoding != "ascii" else "latin_1"
        row = content[: failure.start].count(b"\n") + 1
        text = content.decode(codec, errors="replace")
        return text, [f"text is no UTF-8 (row {row}): read as {codec.replace('_', '-')}"]


def _dialect(head: list[str]) -> _Dialect | None:
    """The one separator that splits the head into names over numbers."""
    uncommented_lines = [uncommented(line) for line in head]
    for k, line in enumerate(uncommented_lines):  # every cell a name with its unit: nothing else can be meant
        for separator in _SEPARATORS:
            cells = _header_cells(line, separator)
            if (len(cells) > 1 or (k == 0 and cells)) and all(name_and_unit(cell)[1] for cell in cells):
                return _Dialect(separator, Layout(k, None, k + 1), cells)
    found = []
    for separator in _SEPARATORS:
        layout = find_layout([_split(line, separator) for line in uncommented_lines])
        cells = _header_cells(uncommented_lines[layout.header], separator) if layout else []
        if layout and cells:
            found.append(_Dialect(separator, layout, cells))
    # a separator of more cells splits all the others' cells too: 'a b;c d' in spaces is no table, so one is left
    return max(found, key=lambda d: (-d.layout.header, len(d.cells))) if found else None


def _split(line: str, separator: str) -> list[str]:
    if separator == " ":
        return _SPACED.findall(line) if "[" in line or "(" in line else line.split()
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a cell of more than 131072 characters
        return []
    return [cell.strip() for cell in cells]


def _header_cells(line: str, separator: str) -> list[str]:
    """Cells of a line of names; none where one of them, or one name alone, holds another separator."""
    cells = _split(line, separator)
    others = set(_SEPARATORS) - {separator, " "}
    return [] if (separator == " " or len(cells) == 1) and any(other in line for other in others) else cells


def _dialect_notes(dialect: _Dialect) -> list[str]:
    notes = []
    if dialect.separator != ",":
        notes.append(f"cells are separated by {_SEPARATORS[dialect.separator]}")
    if dialect.layout.header > 0:
        above = dialect.layout.header
        notes.append(f"header in row {above + 1}; {above} row{'s' if above > 1 else ''} above it left out")
    if dialect.layout.units is not None:
        notes.append(f"units in row {dialect.layout.units + 1}")
    return notes


def _no_header(path: Path, head: Sequence[str]) -> str:
    example = "-- expected a header such as 'time [s],x_in [rad]'"
    if not head or not head[0].strip(" ,;\t|"):
        return f"{path}: row 1 is empty {example} -- add it"
    if any(cells and all(map(is_number, cells)) for cells in (_split(head[0], s) for s in _SEPARATORS)):
        return f"{path}: row 1 holds numbers {example} -- add it"
    return f"{path}: no names over rows of numbers in rows 1 to {len(head)} {example} over numbers -- correct the file"


def _columns(path: Path, body: str, dialect: _Dialect, first_row: int) -> tuple[list[np.ndarray], str]:
    """Columns as float64, or as objects where no cell at the top is a number; and a word on the decimal sign."""
    count = len(dialect.cells)
    if not body.strip():
        return [np.empty(0) for _ in range(count)], ""
    separator = "\t" if dialect.separator == " " else dialect.separator
    top = [_split(line, separator) for line in body.split("\n", _TYPED)[:_TYPED]]
    texts = [_is_text([row[k] for row in top if len(row) == count]) for k in range(count)]
    content, reason = pa.py_buffer(body.encode()), ""
    for decimal in (".", ","):
        try:
            table = pacsv.read_csv(
                pa.BufferReader(content),
                pacsv.ReadOptions(
                    column_names=[str(k) for k in range(count)], use_threads=False, block_size=max(1 << 20, len(body))
                ),
                pacsv.ParseOptions(delimiter=separator, ignore_empty_lines=False, newlines_in_values=False),
                pacsv.ConvertOptions(
                    column_types={str(k): pa.string() if texts[k] else pa.float64() for k in range(count)},
                    null_values=list(MISSING), decimal_point=decimal, strings_can_be_null=True,
                ),
            )  # fmt: skip
        except (pa.ArrowException, OverflowError) as failure:
            reason = reason or str(failure)
            if not re.search(r"invalid value '\s*[-+]?\d*,\d", reason):
                break
        else:
            columns = [
                np.array(c.to_pylist(), dtype=object) if text else np.array(c.to_numpy(), dtype=float)
                for c, text in zip(table.columns, texts, strict=True)
            ]
            return columns, "" if decimal == "." else "decimal commas"
    raise InputError(_failure(path, dialect, reason, first_row))


def _is_text(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell not in MISSING]
    return bool(filled) and not any(map(is_number, filled))


def _failure(path: Path, dialect: _Dialect, reason: str, first_row: int) -> str:
    """Arrow's reason in our words, with rows of the file."""
    if found := re.search(r"column #(\d+): Row #(\d+): .*invalid value '(.*)'", reason, re.DOTALL):
        column, row, text = int(found[1]), int(found[2]) + first_row - 1, " ".join(found[3].split())[:40]
        cell = dialect.cells[column]
        return f"{path}: {text!r} in row {row}, column {cell!r} -- expected a number -- correct or remove the row"
    if found := re.search(r"Row #(\d+): Expected (\d+) columns, got (\d+)", reason):
        row = int(found[1]) + first_row - 1
        return f"{path}: {found[3]} cells in row {row} -- expected {found[2]} as in the header -- correct the row"
    return f"{path}: {reason.splitlines()[0][:120]} -- expected rows of numbers separated by commas -- correct the file"
