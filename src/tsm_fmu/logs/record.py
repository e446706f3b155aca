"""Measured runs: what every verb reads and every simulation writes."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kernels.arrays import FloatArray
from ..kernels.kernel import Kernel
from ..models.contract import InputError, Variable
from .differentiate import differentiate
from .mapping import LogMapping, mapped, mapping_beside, scaled
from .samples import check_order, check_samples, window_note, window_of
from .stamps import find_time, seconds
from .table import FIRST_ROW, Column, frame_table, read_table, stem_of, write_table
from .units import read_unit, same_quantity

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["KernelInputs", "Record", "cutoff_note", "kernel_inputs", "read_record", "write_record"]


@dataclass(frozen=True)
class Record:
    """One measured or simulated run in SI units.

    Attributes
    ----------
    name : str
        Short name of the run, for tables and keys.
    time : ndarray, shape (n,)
        Time [s], strictly increasing.
    columns : mapping of str to ndarray, shape (n,)
        Channels by name, finite; read-only like `time`.
    units : mapping of str to str
        SI unit of each channel, as FMI writes it.
    source : Path or None
        The file, if there is one.
    sha256 : str
        Digest of the file's bytes; empty without a file.
    first_row : int
        Row of the file that sample 0 is from (the header is row 1).
    notes : tuple of str
        How the file was read where that was not plain: separator, encoding, rows and columns left out, times
        counted from the first, what `log.toml` said.
    begins : float or None
        When time was zero [s since 1970, UTC], where the log's times are dates.
    left_out : tuple of int
        Rows of the file after the first sample's that are no samples, ascending.
    """

    name: str
    time: FloatArray
    columns: Mapping[str, FloatArray]
    units: Mapping[str, str]
    source: Path | None = None
    sha256: str = ""
    first_row: int = FIRST_ROW
    notes: tuple[str, ...] = ()
    begins: float | None = None
    left_out: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        where = str(self.source or self.name)
        time = _frozen(self.time)
        columns = {name: _frozen(values) for name, values in self.columns.items()}
        if set(columns) != set(self.units):
            raise InputError(
                f"{where}: units for {sorted(self.units)} -- expected one each for {sorted(columns)} "
                "-- give every channel its unit"
            )
        check_samples(where, time, columns, self.first_row)
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "columns", MappingProxyType(columns))
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))

    def __reduce__(self) -> tuple[Any, ...]:
        # the read-only views cannot be pickled; a run that goes to another process is made anew there
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return Record, tuple(dict(v) if isinstance(v, MappingProxyType) else v for v in values.values())

    def row(self, sample: int) -> int:
        """Row of the file that holds the sample."""
        row = self.first_row + int(sample)
        for one in self.left_out:
            row += one <= row
        return row

    def without(self, samples: Collection[int]) -> Record:
        """A copy without some of its samples."""
        kept = np.delete(np.arange(self.time.size), list(samples))
        return self._at(kept, {*self.left_out, *map(self.row, samples)})

    def _at(self, kept: slice | NDArray[np.intp], left_out: Collection[int]) -> Record:
        """A copy at some of its samples, with the rows of the file that these leave out between them."""
        first = self.row(np.arange(self.time.size)[kept][0])
        columns = {name: values[kept] for name, values in self.columns.items()}
        between = tuple(sorted(row for row in left_out if row > first))
        return replace(self, time=self.time[kept], columns=columns, first_row=first, left_out=between)

    def to_frame(self) -> pd.DataFrame:
        """The run as a DataFrame with time as its index and header cells ``name [unit]``, SI."""
        import pandas as pd

        columns = {f"{name} [{self.units[name]}]": values for name, values in self.columns.items()}
        return pd.DataFrame(columns, index=pd.Index(self.time, name="time [s]"))

    def require(self, name: str, unit: str) -> FloatArray:
        """The channel called ``name``, in the SI unit ``unit``.

        Raises
        ------
        InputError
            If the run has no such channel, or its unit measures something else.
        """
        where = self.source or self.name
        if name not in self.columns:
            raise InputError(
                f"{where} has no channel {name!r} -- it has {', '.join(self.columns) or 'only time'} "
                f"-- rename one with --map LOG={name}"
            )
        if not same_quantity(self.units[name], unit):
            raise InputError(
                f"{where}: channel {name!r} in {self.units[name]} -- expected a unit such as {unit} "
                "-- correct the header or choose another column with --map"
            )
        return self.columns[name]

    def window(self, start: float | None = None, stop: float | None = None) -> Record:
        """The samples with start <= time <= stop [s].

        Raises
        ------
        InputError
            If fewer than two samples are left.
        """
        keep = window_of(str(self.source or self.name), self.time, start, stop)
        return self._at(keep, self.left_out)

    def inputs_for(self, kernel: Kernel, cutoff: float | None = None) -> FloatArray:
        """Inputs of a kernel as columns in its order, shape (n, number of inputs); see `kernel_inputs`."""
        return kernel_inputs(self, kernel, cutoff).values


@dataclass(frozen=True)
class KernelInputs:
    """Inputs of a kernel from a record.

    Attributes
    ----------
    values : ndarray, shape (n, number of inputs)
        By column in the kernel's order, SI.
    notes : tuple of str
        One sentence for each input that was derived, with the cut-off.
    """

    values: FloatArray
    notes: tuple[str, ...]


def kernel_inputs(record: Record, kernel: Kernel, cutoff: float | None = None) -> KernelInputs:
    """Inputs of a kernel; v and a come from x (v_in from x_in, ...) by a zero-phase differentiator where missing.

    Parameters
    ----------
    record : Record
    kernel : Kernel
    cutoff : float, optional
        Cut-off of the differentiator [Hz]; from the spectrum of x without it (`differentiate.default_cutoff`).

    Raises
    ------
    InputError
        If an input is missing and cannot be derived, or measures something else.
    """
    columns, notes = [], []
    for variable in kernel.inputs:
        origin = None if variable.name in record.columns else _origin(record, variable)
        if origin is None:
            columns.append(record.require(variable.name, variable.quantity.unit))
            continue
        name, order = origin
        unit = variable.quantity.unit
        if not same_quantity(f"{record.units[name]}/s{order}" if order > 1 else f"{record.units[name]}/s", unit):
            raise InputError(
                f"{record.source or record.name}: {variable.name} [{unit}] from channel {name!r} in "
                f"{record.units[name]} -- expected a unit whose derivative is {unit} -- correct the header or use --map"
            )
        derived = differentiate(record.time, record.columns[name], order, cutoff, record.first_row)
        columns.append(derived.values)
        bridged = ", from positions interpolated on an even clock, as the samples jitter" if derived.resampled else ""
        bridged += f", over gaps of {derived.bridged} rows in all that the log lacks" if derived.bridged else ""
        if derived.gaps:
            bridged += f", on each side of {derived.gaps} longer gap{'s' if derived.gaps > 1 else ''} by itself"
        notes.append(
            f"{variable.name} derived from {name} by a zero-phase Savitzky-Golay differentiator, "
            f"cut-off {derived.cutoff:.3g} Hz ({derived.window} samples){bridged}"
        )
    return KernelInputs(np.column_stack(columns) if columns else np.empty((record.time.size, 0)), tuple(notes))


def cutoff_note(cutoff: float | None, records: Sequence[Record], inputs: Sequence[str]) -> tuple[str, ...]:
    """One sentence where a cut-off [Hz] is given but every run holds all ``inputs``; nothing otherwise."""
    if cutoff is None or any(name not in record.columns for record in records for name in inputs):
        return ()
    names = f"the log has {', '.join(inputs)} itself" if inputs else "there is no input"
    return (f"--cutoff {cutoff:g} Hz is not used: {names}, nothing is derived",)


def read_record(
    source: str | os.PathLike[str] | pd.DataFrame,
    *,
    mapping: Mapping[str, str] | None = None,
    scales: Mapping[str, float] | None = None,
    start: float | None = None,
    stop: float | None = None,
    name: str | None = None,
) -> Record:
    """Read a measured run: a text table, Parquet, Excel, MATLAB, HDF5, TDMS or ROS file, or a DataFrame.

    Separator, decimal sign, encoding, a row of units and time stamps are found and told in `Record.notes`; a unit
    that is not there is asked for. A ``log.toml`` beside a file is read too, see `LogMapping`.

    Parameters
    ----------
    source : str, Path or DataFrame
        Units of a DataFrame may also be in ``attrs["units"]``, by column; its time in an index called ``time [s]``.
    mapping : mapping of str to str, optional
        Column of the log to variable name, with its unit where the log has none or another:
        ``{"angle_motor_deg": "x_in [deg]", "enc": "x_out [360/4096 deg]", "t": "time [s]"}``. Columns without a
        unit that it does not name are left out.
    scales : mapping of str to float, optional
        Factor by name, before or after renaming (-1 turns a sign).
    start, stop : float, optional
        Window [s]; samples outside are left out before their values are judged.
    name : str, optional
        Short name; without it the file's stem, or ``run`` of a DataFrame.

    Returns
    -------
    Record

    Raises
    ------
    InputError
        One line with file, row and column for whatever is wrong with the file or the options.
    """
    given, beside = LogMapping(mapping or {}, scales or {}), None
    if isinstance(source, (str, os.PathLike)):
        path = _expanded(source)
        beside = mapping_beside(path)
        table = read_table(path)
        where, stem, file = str(path), stem_of(path), path
    else:
        where, stem, file = name or "DataFrame", "run", None  # a label for messages
        table = frame_table(where, source)
    columns, renamed = mapped(where, table.columns, given, beside)
    at = find_time(where, columns)
    time, timing, begins = seconds(where, columns[at], table.first_row)
    channels, left_out = _measured(where, columns[:at] + columns[at + 1 :], bool(given.names or renamed))
    factors, scalings = scaled(where, [column for column, _ in channels], given, beside)
    check_order(where, time, table.first_row)
    keep = window_of(where, time, start, stop)
    values, units = {}, {}
    for column, unit in channels:
        try:
            si = read_unit(unit)
        except InputError as wrong:
            raise InputError(f"{where}: column {column.name!r}: {wrong}") from None
        factor = factors.get(column.name, 1.0)
        values[column.name] = column.values[keep] * (si.factor * factor) + si.offset * factor
        units[column.name] = si.si
    notes = (*table.notes, *renamed, *scalings, *timing, *left_out, *window_note(time, start, stop))
    first_row = table.first_row + keep.start
    return Record(name or stem, time[keep], values, units, file, table.digest, first_row, notes, begins)


def write_record(path: str | Path, time: ArrayLike, columns: Mapping[str, ArrayLike], units: Mapping[str, str]) -> Path:
    """Write a run in the form `read_record` takes; numbers survive to the last bit.

    Parameters
    ----------
    path : str or Path
        Ends in ``.csv``, ``.csv.gz`` or ``.parquet``.
    time : array_like, shape (n,)
        Time [s].
    columns : mapping of str to array_like, shape (n,)
    units : mapping of str to str
        Unit of each column.
    """
    path = Path(path)
    header = ["time [s]", *(f"{name} [{units[name]}]" for name in columns)]
    write_table(path, header, [np.asarray(c, dtype=float) for c in (time, *columns.values())])
    return path


def _origin(record: Record, variable: Variable) -> tuple[str, int] | None:
    """Channel and order of derivative that give an input: v and a, with the suffix of the channel."""
    letter, suffix = variable.name[:1], variable.name[1:]
    if suffix and not suffix.startswith("_"):
        return None
    candidates = {"v": (("x", 1),), "a": (("v", 1), ("x", 2))}.get(letter, ())
    return next(((c + suffix, order) for c, order in candidates if c + suffix in record.columns), None)


def _expanded(source: str | os.PathLike[str]) -> Path:
    try:
        return Path(source).expanduser()
    except RuntimeError as failure:  # ~nobody
        raise InputError(f"{source}: {failure} -- expected a known user after '~' -- write the path in full") from None


def _measured(where: str, columns: list[Column], selected_by_user: bool) -> tuple[list[tuple[Column, str]], list[str]]:
    """Measurements with their units; text is left out, and what has no unit where columns are ``selected_by_user``."""
    with_unit, texts, without_unit = [], [], []
    for column in columns:
        if column.unit is None:
            (texts if column.is_text else without_unit).append(column)
        elif column.is_text:
            first = next((str(cell) for cell in column.values if cell is not None), "")
            raise InputError(
                f"{where}: column {column.cell or column.name!r} holds text ({first[:40]!r}), in every row seen "
                "-- expected numbers -- write numbers, or remove its unit, then it is left out"
            )
        else:
            with_unit.append((column, column.unit))
    notes = [f"{_listed(texts)}: text, left out"] if texts else []
    if not without_unit:
        return with_unit, notes
    if not selected_by_user:
        more = f" (nor have {len(without_unit) - 1} more: {_listed(without_unit[1:])})" if len(without_unit) > 1 else ""
        given = " ".join(f'--map "{column.name}={column.name} [UNIT]"' for column in without_unit[:3])
        raise InputError(
            f"{where}: column {without_unit[0].cell or without_unit[0].name!r} has no unit{more} "
            "-- expected 'name [unit]' "
            f"-- give what you need its unit: {given}{' ...' if len(without_unit) > 3 else ''}, or let "
            "'tsm-fmu check LOG --model MODEL' propose a log.toml"
        )
    return with_unit, [*notes, f"{_listed(without_unit)}: no unit given, left out"]


def _listed(columns: Sequence[Column]) -> str:
    names = ", ".join(column.name for column in columns[:8])
    return f"{names}, ... ({len(columns)} columns)" if len(columns) > 8 else names


def _frozen(values: ArrayLike) -> FloatArray:
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array
