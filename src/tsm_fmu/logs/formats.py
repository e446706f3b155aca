"""Binary formats of logs, by suffix: Excel, MATLAB, HDF5, TDMS and ROS, each read by its well-kept library.

All but MATLAB's old format need an extra: ``pip install tsm-fmu[excel,hdf5,tdms,ros]``.
"""

from __future__ import annotations

import importlib
import io
import re
from collections.abc import Callable, Iterator, Mapping
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..models.contract import InputError
from .header import HEAD_ROWS, MISSING, find_layout, is_number, name_and_unit, unit_cell
from .raw import RawTable

__all__ = ["READERS"]

_T = TypeVar("_T")


def _excel(path: Path, content: bytes) -> RawTable:
    openpyxl = _library("openpyxl", "excel", path)
    book = _opened(path, "Excel", lambda: openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True))
    for sheet in book.worksheets:
        rows = _opened(path, "Excel", lambda sheet=sheet: [_trimmed(row) for row in sheet.iter_rows(values_only=True)])
        width = max((len(row) for row in rows), default=0)
        rows = [row + [None] * (width - len(row)) for row in rows]
        head = [[_cell_text(cell) for cell in row] for row in rows[:HEAD_ROWS]]
        layout = find_layout(head)
        if layout is None:
            continue
        cells, body = head[layout.header], rows[layout.data :]
        units = None if layout.units is None else [unit_cell(cell) for cell in head[layout.units]]
        notes = [f"sheet {sheet.title!r} of {len(book.worksheets)}"] if len(book.worksheets) > 1 else []
        if layout.header:
            notes.append(f"header in row {layout.header + 1}; what stands above it left out")
        if layout.units is not None:
            notes.append(f"units in row {layout.units + 1}")
        first = layout.data + 1
        columns = [_column(path, cell, [row[k] for row in body], first) for k, cell in enumerate(cells)]
        return RawTable(cells, units, columns, first, notes)
    raise InputError(
        f"{path}: no sheet with names over rows of numbers -- expected a header such as 'time [s]', 'x_in [rad]' "
        "-- add it, or save the sheet with the samples alone"
    )


def _matlab(path: Path, content: bytes) -> RawTable:
    if content[:4] != b"MATL" or b"MATLAB 7.3" in content[:128]:
        return _hdf5(path, content)
    from scipy.io import loadmat

    found = _opened(path, "MATLAB", lambda: loadmat(io.BytesIO(content), squeeze_me=True, simplify_cells=True))
    return _from_arrays(path, dict(_leaves({k: v for k, v in found.items() if not k.startswith("__")})), {})


def _hdf5(path: Path, content: bytes) -> RawTable:
    h5py = _library("h5py", "hdf5", path)
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}

    def visit(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset) or name.startswith("#"):
            return
        arrays[name] = np.squeeze(node[()])
        unit = next((node.attrs[key] for key in ("unit", "units", "Unit", "Units") if key in node.attrs), None)
        if unit is not None:
            units[name] = unit.decode() if isinstance(unit, bytes) else str(unit)

    def read() -> None:
        with h5py.File(io.BytesIO(content), "r") as file:
            file.visititems(visit)

    _opened(path, "HDF5", read)
    return _from_arrays(path, dict(_leaves(arrays)), units)


def _tdms(path: Path, content: bytes) -> RawTable:
    nptdms = _library("nptdms", "tdms", path)
    file = _opened(path, "TDMS", lambda: nptdms.TdmsFile.read(io.BytesIO(content)))
    channels = [channel for group in file.groups() for channel in group.channels()]
    names = [c.name if sum(o.name == c.name for o in channels) == 1 else f"{c.group_name}/{c.name}" for c in channels]
    arrays = {name: channel[:] for name, channel in zip(names, channels, strict=True)}
    named = zip(names, channels, strict=True)
    units = {name: str(unit) for name, channel in named if (unit := channel.properties.get("unit_string"))}
    notes = []
    if channels and not any(name_and_unit(name)[0].casefold() in ("time", "t") for name in names):
        step = {float(c.properties.get("wf_increment", 0.0)) for c in channels}
        if len(step) == 1 and (increment := step.pop()) > 0.0:
            start = float(channels[0].properties.get("wf_start_offset", 0.0))
            arrays = {"time": start + increment * np.arange(len(channels[0]))} | arrays
            units["time"] = "s"
            notes.append(f"time from the channels' increment of {increment:g} s")
    return _from_arrays(path, arrays, units, notes)


def _ros(path: Path, content: bytes) -> RawTable:
    del content  # its library wants the file itself
    highlevel = _library("rosbags.highlevel", "ros", path)
    topics: dict[str, dict[str, list[Any]]] = {}

    def read() -> None:
        with highlevel.AnyReader([path], default_typestore=_type_store()) as reader:
            for connection, stamp, raw in reader.messages():
                message = reader.deserialize(raw, connection.msgtype)
                # when it was measured, where the message says so
                own = getattr(getattr(message, "header", None), "stamp", None)
                measured = own.sec * 1_000_000_000 + own.nanosec if own is not None else 0
                row = {"time": measured or stamp} | dict(_fields(message))
                table = topics.setdefault(connection.topic, {key: [] for key in row})
                if set(table) == set(row):  # messages of one topic may differ in length
                    for key, value in row.items():
                        table[key].append(value)

    _opened(path, "ROS", read)
    topics = {topic: table for topic, table in topics.items() if len(table) > 1}
    if len(topics) != 1:
        names = ", ".join(topics) or "none"
        raise InputError(
            f"{path}: topics with numbers: {names} -- expected one, since each has times of its own "
            "-- write the one you need into a file of its own ('ros2 bag convert', 'mcap filter')"
        )
    topic, table = topics.popitem()
    arrays = {key: np.array(values, dtype=float if key != "time" else np.int64) for key, values in table.items()}
    arrays["time"] = (arrays["time"] - arrays["time"][0]) / 1e9
    notes = [f"topic {topic}, times of its messages (header, else recording) counted from the first"]
    return _from_arrays(path, arrays, {"time": "s"}, notes)


READERS: Mapping[str, Callable[[Path, bytes], RawTable]] = {
    ".xlsx": _excel, ".xlsm": _excel, ".mat": _matlab, ".h5": _hdf5, ".hdf5": _hdf5, ".tdms": _tdms,
    ".mcap": _ros, ".bag": _ros, ".db3": _ros,
}  # fmt: skip
"""Reader by suffix in lower case."""


def _library(name: str, extra: str, path: Path) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(
            f"{path}: {name.partition('.')[0]} is not installed -- expected the extra {extra!r} for {path.suffix} "
            f"files -- pip install 'tsm-fmu[{extra}]'"
        ) from None


def _opened(path: Path, sort: str, read: Callable[[], _T]) -> _T:
    try:
        return read()
    except InputError:
        raise
    except Exception as failure:  # the libraries raise what their own code meets in a damaged file
        reason = " ".join(f"{type(failure).__name__} {failure}".split())[:120]
        raise InputError(f"{path}: {reason} -- expected a whole {sort} file -- copy or save it again") from failure


def _trimmed(row: tuple[Any, ...]) -> list[Any]:
    cells = list(row)
    while cells and cells[-1] is None:
        cells.pop()
    return cells


def _cell_text(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, (datetime, date, time)):
        return cell.isoformat()
    if isinstance(cell, timedelta):
        return str(cell)
    return str(cell).strip()


def _column(path: Path, name: str, cells: list[Any], first_row: int) -> np.ndarray:
    """Numbers with NaN for empty cells; objects where no cell is a number."""
    texts = [None if (text := _cell_text(cell)) in MISSING else text for cell in cells]
    filled = [text for text in texts if text is not None]
    if filled and not any(map(is_number, filled)):
        return np.array(texts, dtype=object)
    values = np.full(len(cells), np.nan)
    for k, (cell, text) in enumerate(zip(cells, texts, strict=True)):
        if text is None:
            continue
        try:
            values[k] = float(cell) if isinstance(cell, (int, float)) else float(text.replace(",", "."))
        except (ValueError, OverflowError):
            raise InputError(
                f"{path}: {text[:40]!r} in row {first_row + k}, column {name!r} -- expected a number "
                "-- correct or remove the row"
            ) from None
    return values


def _leaves(tree: Mapping[str, Any], under: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Arrays of numbers in nested structures, by dotted name; a matrix column by column."""
    for key, value in tree.items():
        name = f"{under}{key}"
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{name}.")
            continue
        array = np.asarray(value)
        if array.dtype.names:
            yield from _leaves({field: array[field] for field in array.dtype.names}, f"{name}.")
        elif array.dtype.kind in "iuf" and array.ndim == 1:
            yield name, array
        elif array.dtype.kind in "iuf" and array.ndim == 2:
            rows = array if array.shape[0] >= array.shape[1] else array.T
            yield from ((f"{name}({k + 1})", rows[:, k]) for k in range(rows.shape[1]))


def _from_arrays(
    path: Path, arrays: Mapping[str, Any], units: Mapping[str, str], notes: list[str] | None = None
) -> RawTable:
    """A table of the arrays as long as most are, by the last part of their names where that tells them apart."""
    notes = notes or []
    vectors = {name: np.asarray(values) for name, values in arrays.items() if np.ndim(values) == 1}
    lengths = [values.size for values in vectors.values() if values.size > 1]
    if not lengths:
        raise InputError(f"{path} has no vectors of numbers -- expected one each for time and channels -- save them")
    usual = max(set(lengths), key=lambda n: (lengths.count(n), n))
    table = {name: values for name, values in vectors.items() if values.size == usual}
    others = [name for name in vectors if name not in table]
    if others:
        notes = [*notes, f"{', '.join(others[:8])}: not {usual} samples long, left out"]
    short = [re.split(r"[./]", name)[-1] for name in table]
    cells = short if len(set(short)) == len(short) else list(table)
    columns = []
    for values in table.values():
        if values.dtype.kind == "M":  # time stamps
            columns.append(np.array([str(stamp) for stamp in values], dtype=object))
        elif values.dtype.kind in "iuf":
            columns.append(np.array(values, dtype=float))
        else:
            columns.append(np.array([str(value) for value in values], dtype=object))
    return RawTable(cells, [units.get(name) for name in table], columns, 1, notes)


def _fields(message: Any, under: str = "") -> Iterator[tuple[str, float]]:
    """Numbers of a ROS message by dotted name, without its header; elements of arrays by number, or by ``name``."""
    names = getattr(message, "name", None)
    for key, value in vars(message).items():
        if key.startswith("_") or key == "header":
            continue
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            yield f"{under}{key}", float(value)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "iuf":
            labels = names if isinstance(names, list) and len(names) == value.size else range(value.size)
            yield from ((f"{under}{key}.{label}", float(x)) for label, x in zip(labels, value, strict=True))
        elif hasattr(value, "__msgtype__"):
            yield from _fields(value, f"{under}{key}.")


def _type_store() -> Any:
    typesys = importlib.import_module("rosbags.typesys")
    return typesys.get_typestore(typesys.Stores.LATEST)
