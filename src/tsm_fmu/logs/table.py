"""Tables of numbers in files: CSV, CSV.gz and Parquet with header cells ``name [unit]``.

Row numbers in messages are those of an editor or spreadsheet: the header is row 1, the first sample row 2.
"""

from __future__ import annotations

import contextlib
import csv
import gzip
import hashlib
import io
import os
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ..models.contract import InputError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["FIRST_ROW", "Column", "frame_table", "read_table", "write_table"]

FloatArray = NDArray[np.float64]
FIRST_ROW = 2
_CELL = re.compile(r"^(?P<name>[^\[\]]+?(\[[\d,]+\][^\[\]]*?)*)\s*\[(?P<unit>[^\[\]]*)\]$")
_MISSING = ["", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "#N/A", "null", "NULL", "None"]


@dataclass(frozen=True)
class Column:
    """One column as the file has it: its unit is not converted yet, a missing number is NaN."""

    name: str
    unit: str
    values: FloatArray


def read_table(path: Path) -> tuple[list[Column], str]:
    """Columns of a file, and the sha256 of its bytes.

    Raises
    ------
    InputError
        For a missing, empty, damaged or malformed file; one line with row and column.
    """
    content = _bytes(path)
    digest = hashlib.sha256(content).hexdigest()
    if not content.strip():
        raise InputError(
            f"{path} is empty -- expected a header row 'time [s],x_in [rad],...' and samples -- record again"
        )
    if content[:4] == b"PAR1" or path.suffix == ".parquet":
        cells, values = _parquet(path, content)
    else:
        cells, values = _csv(path, _unzipped(path, content))
    named = [_header_cell(path, cell) for cell in cells]
    names = [name for name, _ in named]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"{path}: column {name!r} appears {names.count(name)} times -- expected once -- rename one"
            )
    return [Column(name, unit, column) for (name, unit), column in zip(named, values, strict=True)], digest


def frame_table(where: str, frame: pd.DataFrame) -> tuple[list[Column], str]:
    """Columns of a DataFrame, and a sha256 of its header and numbers.

    Parameters
    ----------
    where : str
        What messages call it.
    frame : DataFrame
        Columns ``name [unit]``, or ``name`` with the unit in ``attrs["units"]``; time is the first column, or an
        index called ``time [s]``.

    Raises
    ------
    InputError
        No columns, a header cell without unit, a name twice, or cells that are no numbers.
    """
    if frame.index.name is not None:
        frame = frame.reset_index()
    units = frame.attrs.get("units", {})
    cells = [str(c) if "[" in str(c) or c not in units else f"{c} [{units[c]}]" for c in frame.columns]
    if not cells:
        raise InputError(f"{where} has no columns -- expected 'time [s]', 'x_in [rad]', ... -- give it some")
    named = [_header_cell(Path(where), cell) for cell in cells]
    names = [name for name, _ in named]
    digest = hashlib.sha256()
    columns = []
    for k, (name, unit) in enumerate(named):
        if names.count(name) > 1:
            raise InputError(
                f"{where}: column {name!r} appears {names.count(name)} times -- expected once -- rename one"
            )
        try:
            values = np.ascontiguousarray(frame.iloc[:, k].to_numpy(dtype=float, na_value=np.nan))
        except (TypeError, ValueError):
            raise InputError(
                f"{where}: column {name!r} is of type {frame.dtypes.iloc[k]} -- expected numbers -- convert it"
            ) from None
        digest.update(f"{name} [{unit}]".encode() + values.tobytes())
        columns.append(Column(name, unit, values))
    return columns, digest.hexdigest()


def write_table(path: Path, header: Sequence[str], columns: Sequence[FloatArray]) -> None:
    """Write columns so that reading gives the same numbers to the last bit; the file appears only when complete.

    The suffix decides: ``.csv``, ``.csv.gz`` or ``.parquet``.
    """
    form = "".join(path.suffixes[-2:]) if path.suffix == ".gz" else path.suffix
    if form not in (".csv", ".csv.gz", ".parquet"):
        raise InputError(f"{path} -- expected a name that ends in .csv, .csv.gz or .parquet -- rename it")
    table = pa.table([pa.array(np.asarray(c, dtype=float)) for c in columns], names=list(header))
    text = io.BytesIO()
    if form == ".parquet":
        pq.write_table(table, text)
    else:
        first = io.StringIO()
        csv.writer(first, lineterminator="\n").writerow(header)
        text.write(first.getvalue().encode())
        pacsv.write_csv(table, text, pacsv.WriteOptions(include_header=False))
    # mtime=0: equal samples give equal bytes, hence equal sha256
    content = gzip.compress(text.getvalue(), mtime=0) if form == ".csv.gz" else text.getvalue()
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(content)
        partial.replace(path)
    except OSError as failure:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise InputError(f"{path}: {failure.strerror} -- expected a writable place -- choose another") from failure


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(
            f"{path} does not exist -- expected a measured run (.csv, .csv.gz, .parquet) -- check the path"
        ) from None
    except OSError as failure:
        raise InputError(
            f"{path}: {failure.strerror} -- expected a readable file (.csv, .csv.gz, .parquet) -- check the path"
        ) from None


def _unzipped(path: Path, content: bytes) -> bytes:
    if content[:2] != b"\x1f\x8b":
        if path.suffix == ".gz":
            raise InputError(
                f"{path} does not start as gzip -- expected gzip data in a .gz file -- rename or copy it again"
            )
        return content
    try:
        return gzip.decompress(content)
    except (EOFError, OSError, zlib.error) as failure:
        raise InputError(f"{path}: {failure} -- expected a whole gzip file -- copy it again") from failure


def _parquet(path: Path, content: bytes) -> tuple[list[str], list[FloatArray]]:
    try:
        table = pq.read_table(pa.BufferReader(content))
    except (pa.ArrowException, OSError) as failure:
        reason = str(failure).splitlines()[0][:120]
        raise InputError(f"{path}: {reason} -- expected a whole Parquet file -- copy it again") from failure
    columns = []
    for cell, column in zip(table.column_names, table.columns, strict=True):
        if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
            raise InputError(f"{path}: column {cell!r} holds {column.type} -- expected numbers -- convert or remove it")
        columns.append(np.array(column.cast(pa.float64()).to_numpy(), dtype=float))
    return [str(cell) for cell in table.column_names], columns


def _csv(path: Path, content: bytes) -> tuple[list[str], list[FloatArray]]:
    content = content.removeprefix(b"\xef\xbb\xbf")
    try:
        content.decode()
    except UnicodeDecodeError as failure:
        row = content[: failure.start].count(b"\n") + 1
        raise InputError(
            f"{path}: byte 0x{content[failure.start]:02x} in row {row} is not UTF-8 "
            "-- expected UTF-8 text -- save it as UTF-8"
        ) from None
    if b"\x00" in content:
        raise InputError(f"{path} holds zero bytes -- expected UTF-8 text -- save it as UTF-8 CSV")
    content = content.rstrip() + b"\n"
    first = content.split(b"\n", 1)[0].decode().rstrip("\r")
    cells = [cell.strip() for cell in next(csv.reader([first], skipinitialspace=True), [])]
    _check_header(path, first, cells)
    if content.count(b"\n") < 2:
        return cells, [np.empty(0) for _ in cells]
    try:
        table = pacsv.read_csv(
            pa.BufferReader(content),
            pacsv.ReadOptions(skip_rows=1, column_names=[str(k) for k in range(len(cells))], use_threads=False),
            pacsv.ParseOptions(ignore_empty_lines=False, newlines_in_values=False),
            pacsv.ConvertOptions(column_types={str(k): pa.float64() for k in range(len(cells))}, null_values=_MISSING),
        )
    except pa.ArrowException as failure:
        raise InputError(_csv_failure(path, cells, str(failure))) from None
    return cells, [column.to_numpy() for column in table.columns]


def _check_header(path: Path, first: str, cells: list[str]) -> None:
    if not any(cells):
        raise InputError(f"{path}: row 1 is empty -- expected a header such as 'time [s],x_in [rad]' -- add it")
    if len(cells) == 1 and re.search(r"\][\s\"]*[;\t]", first):
        raise InputError(f"{path}: header {first[:60]!r} -- expected commas between cells -- save it with commas")
    if all(_is_number(cell) for cell in cells):
        raise InputError(f"{path}: row 1 holds numbers -- expected a header such as 'time [s],x_in [rad]' -- add it")


def _csv_failure(path: Path, cells: list[str], reason: str) -> str:
    """Arrow's reason in our words; it counts rows from 1 at the header as we do."""
    if found := re.search(r"column #(\d+): Row #(\d+): .*invalid value '(.*)'", reason, re.DOTALL):
        column, row, text = int(found[1]), found[2], " ".join(found[3].split())[:40]
        return (
            f"{path}: {text!r} in row {row}, column {cells[column]!r} -- expected a number -- correct or remove the row"
        )
    if found := re.search(r"Row #(\d+): Expected (\d+) columns, got (\d+)", reason):
        return f"{path}: {found[3]} cells in row {found[1]} -- expected {found[2]} as in the header -- correct the row"
    return f"{path}: {reason.splitlines()[0][:120]} -- expected rows of numbers separated by commas -- correct the file"


def _header_cell(path: Path, cell: str) -> tuple[str, str]:
    found = _CELL.match(cell.strip())
    if not found or not found["unit"].strip():
        raise InputError(
            f"{path}: column {cell!r} has no unit -- expected 'name [unit]' -- write for example 'x_in [rad]'"
        )
    return found["name"].strip(), found["unit"].strip()


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
