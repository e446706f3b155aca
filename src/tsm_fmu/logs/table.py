"""Tables of numbers: files of any known format and DataFrames, as columns with the units they are said to have.

Row numbers in messages are those of an editor or spreadsheet: a plain log has its header in row 1, sample 0 in row 2.
"""

from __future__ import annotations

import csv
import gzip
import hashlib
import io
import stat
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ..models.contract import InputError
from .formats import READERS
from .header import name_and_unit
from .raw import RawTable
from .text import read_text
from .whole_file import write_whole

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["FIRST_ROW", "Column", "Table", "frame_table", "read_table", "stem_of", "write_table"]

FIRST_ROW = 2
_READ = ".csv, .csv.gz, .parquet, .txt, " + ", ".join(READERS)


@dataclass(frozen=True)
class Column:
    """One column as the file has it: nothing is converted yet.

    Attributes
    ----------
    name : str
    unit : str or None
        None where the file says none.
    values : ndarray
        float64, NaN where a number is missing; objects (str, None) where the cells are text or time stamps.
    cell : str
        The header cell it comes from.
    """

    name: str
    unit: str | None
    values: np.ndarray
    cell: str = ""

    @property
    def is_text(self) -> bool:
        """Whether the cells are text or time stamps."""
        return self.values.dtype == object


@dataclass(frozen=True)
class Table:
    """Columns of a file or DataFrame, the sha256 of its bytes, the row of sample 0, what was found out on reading."""

    columns: list[Column]
    digest: str
    first_row: int = FIRST_ROW
    notes: tuple[str, ...] = ()


def read_table(path: Path) -> Table:
    """Columns of a file.

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
    reader = READERS.get(path.suffix.lower())
    if content[:4] == b"PAR1" or path.suffix == ".parquet":
        raw = _parquet(path, content)
    elif reader is not None:
        raw = reader(path, content)
    else:
        raw = read_text(path, _unzipped(path, content))
    columns, notes = _named(str(path), raw)
    return Table(columns, digest, raw.first_row, (*raw.notes, *notes))


def frame_table(where: str, frame: pd.DataFrame) -> Table:
    """Columns of a DataFrame, with a sha256 of its header and numbers.

    Parameters
    ----------
    where : str
        What messages call it.
    frame : DataFrame
        Columns ``name [unit]``, or ``name`` with the unit in ``attrs["units"]``; time is a column, or a named index.

    Raises
    ------
    InputError
        No columns, a name twice, or cells that are no numbers.
    """
    import pandas as pd

    if frame.index.name is not None:
        frame = frame.reset_index()
    if not len(frame.columns):
        raise InputError(f"{where} has no columns -- expected 'time [s]', 'x_in [rad]', ... -- give it some")
    units = frame.attrs.get("units", {})
    cells = [str(cell) for cell in frame.columns]
    units_of_frame = [units.get(cell) for cell in frame.columns]
    values = []
    for k, cell in enumerate(cells):
        column = frame.iloc[:, k]
        if pd.api.types.is_datetime64_any_dtype(column):
            values.append(np.array([None if pd.isna(t) else t.isoformat() for t in column], dtype=object))
            continue
        if pd.api.types.is_string_dtype(column):
            values.append(np.array([None if pd.isna(text) else str(text) for text in column], dtype=object))
            continue
        try:
            values.append(np.ascontiguousarray(column.to_numpy(dtype=float, na_value=np.nan)))
        except (TypeError, ValueError):
            raise InputError(
                f"{where}: column {cell!r} is of type {column.dtype} -- expected numbers -- convert it"
            ) from None
    columns, notes = _named(where, RawTable(cells, units_of_frame, values))
    digest = hashlib.sha256()
    for column in columns:
        content = repr(list(column.values)).encode() if column.is_text else column.values.tobytes()
        digest.update(f"{column.name} [{column.unit}]".encode() + content)
    return Table(columns, digest.hexdigest(), notes=tuple(notes))


def stem_of(path: Path) -> str:
    """Name of a log's file without the suffixes of its format."""
    name = path.name.removesuffix(".gz")
    known = (".csv", ".txt", ".tsv", ".parquet", *READERS)
    return next((name[: -len(suffix)] for suffix in known if name.lower().endswith(suffix)), name)


def _named(where: str, raw: RawTable) -> tuple[list[Column], list[str]]:
    """Columns with names; a row index without a name and columns without name and numbers are left out."""
    columns: list[Column] = []
    notes: list[str] = []
    beside = raw.units or [None] * len(raw.cells)
    for k, (cell, unit, values) in enumerate(zip(raw.cells, beside, raw.columns, strict=True)):
        name, own = name_and_unit(cell)
        if not cell or cell == "Unnamed: 0":
            if values.dtype == object:
                empty = all(value is None for value in values)
            else:
                empty = bool(np.isnan(values).all()) if len(raw.cells) > 1 else False
                if k == 0 and values.size and np.array_equal(values, np.arange(values.size)):
                    notes.append("first column has no name and counts the rows: left out")
                    continue
            if empty:
                notes.append(f"column {k + 1} is empty: left out")
                continue
            name = f"column {k + 1}"
        columns.append(Column(name, own or unit, values, cell))
    names = [column.name for column in columns]
    for name in names:
        if (times := names.count(name)) > 1:
            raise InputError(f"{where}: column {name!r} appears {times} times -- expected once -- rename one")
    return columns, notes


def write_table(path: Path, header: Sequence[str], columns: Sequence[NDArray[Any]]) -> None:
    """Write columns so that reading gives the same numbers to the last bit; the file appears only when complete.

    Columns of texts stay texts, all others become floats.

    The suffix decides: ``.csv``, ``.csv.gz`` or ``.parquet``.
    """
    form = "".join(path.suffixes[-2:]) if path.suffix == ".gz" else path.suffix
    if form not in (".csv", ".csv.gz", ".parquet"):
        raise InputError(f"{path} -- expected a name that ends in .csv, .csv.gz or .parquet -- rename it")
    arrays = [
        pa.array(c) if np.asarray(c).dtype.kind in "UO" else pa.array(np.asarray(c, dtype=float)) for c in columns
    ]
    table = pa.table(arrays, names=list(header))
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
    write_whole(path, content)


def _bytes(path: Path) -> bytes:
    try:
        mode = path.stat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # a pipe would wait for ever, a device never end
            raise InputError(f"{path} is a pipe or a device -- expected a regular file -- save it to a file first")
        return path.read_bytes()
    except InputError:  # it is a ValueError too
        raise
    except FileNotFoundError:
        raise InputError(f"{path} does not exist -- expected a measured run ({_READ}) -- check the path") from None
    except OSError as failure:
        raise InputError(
            f"{path}: {failure.strerror} -- expected a readable file ({_READ}) -- check the path"
        ) from None
    except ValueError as failure:  # a zero byte in the name
        raise InputError(f"{str(path)!r}: {failure} -- expected the name of a file -- check the path") from None


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


def _parquet(path: Path, content: bytes) -> RawTable:
    try:
        table = pq.read_table(pa.BufferReader(content))
    except (pa.ArrowException, OSError) as failure:
        reason = str(failure).splitlines()[0][:120]
        raise InputError(f"{path}: {reason} -- expected a whole Parquet file -- copy it again") from failure
    columns = []
    for cell, column in zip(table.column_names, table.columns, strict=True):
        if pa.types.is_timestamp(column.type):
            stamps = column.cast(pa.string()).to_pylist()
            columns.append(np.array(stamps, dtype=object))
        elif pa.types.is_floating(column.type) or pa.types.is_integer(column.type):
            columns.append(np.array(column.cast(pa.float64(), safe=False).to_numpy(), dtype=float))
        elif pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
            columns.append(np.array(column.to_pylist(), dtype=object))
        else:
            raise InputError(f"{path}: column {cell!r} holds {column.type} -- expected numbers -- convert or remove it")
    return RawTable([str(cell) for cell in table.column_names], None, columns)
