"""Times of a log in seconds: numbers with a unit, or time stamps, counted from the first where that is far away."""

from __future__ import annotations

import re

import numpy as np

from ..kernels.arrays import FloatArray
from ..models.contract import InputError
from .table import Column
from .units import read_unit, same_quantity

__all__ = ["find_time", "seconds"]

_NAMES = ("time", "t", "timestamp")
_EPOCH = 1e8
"""Beyond [s] a time is a date (1973 and later in seconds since 1970), not a time since the start of a run."""


def find_time(where: str, columns: list[Column]) -> int:
    """Number of the column that is time: ``time``, or a first column called ``t`` or ``timestamp``.

    Raises
    ------
    InputError
        If there is none, or more than one.
    """
    names = [column.name.casefold() for column in columns]
    if names.count("time") == 1:
        return names.index("time")
    first = columns[0]
    if names.count("time") > 1:
        raise InputError(f"{where}: {names.count('time')} columns are called time -- expected one -- rename the others")
    if names[0] in _NAMES:
        return 0
    likely = next((column for column in columns if _is_time(column.unit)), None)
    raise InputError(
        f"{where}: first column is {first.name!r} -- expected 'time [s]' "
        f'-- say which is time with --map "{likely.name if likely else "LOG"}=time [s]", '
        "or let 'tsm-fmu check LOG --model MODEL' propose it"
    )


def seconds(where: str, column: Column, first_row: int) -> tuple[FloatArray, list[str], float | None]:
    """Times of a column [s], what was done to get them, and the date they are counted from [s since 1970, UTC].

    Time stamps and dates in seconds since 1970 are counted from the first sample.

    Raises
    ------
    InputError
        A unit that is none of time, or cells that are no times.
    """
    if column.is_text:
        return _from_stamps(where, column, first_row)
    if column.unit is None:
        raise InputError(
            f"{where}: column {column.cell or column.name!r} has no unit -- expected 'time [s]' "
            f'-- give it: --map "{column.cell or column.name}=time [UNIT]" with its unit, such as s or ms'
        )
    try:
        known = same_quantity(read_unit(column.unit).si, "s")
    except InputError as wrong:
        raise InputError(f"{where}: column {column.name!r}: {wrong}") from None
    if not known:
        raise InputError(
            f"{where}: time in {column.unit!r} -- expected a unit of time such as s or ms "
            "-- correct the header or give it with --map"
        )
    factor, values = read_unit(column.unit).factor, column.values
    finite = values[np.isfinite(values)]
    if finite.size and _EPOCH <= abs(float(finite[0]) * factor) <= 1e3 * _EPOCH:
        start = float(finite[0])
        # the difference first: milliseconds since 1970 have no bits to spare for a factor
        note = f"time begins at {start:.16g} {column.unit}, a date: counted from there"
        return (values - start) * factor, [note], start * factor
    return values * factor, [], None


def _is_time(unit: str | None) -> bool:
    try:
        return unit is not None and same_quantity(read_unit(unit).si, "s")
    except InputError:
        return False


def _from_stamps(where: str, column: Column, first_row: int) -> tuple[FloatArray, list[str], float | None]:
    import pandas as pd

    cells = pd.Series(column.values, dtype=object).str.replace(",", ".")  # the decimals of seconds
    of_day = all(re.match(r"^\d{1,2}:\d\d:\d\d", str(cell)) for cell in cells if cell is not None)
    try:
        if of_day:
            stamps = pd.to_timedelta(cells).astype("timedelta64[ns]")
        else:
            stamps = pd.to_datetime(cells, format="ISO8601", utc=True).astype("datetime64[ns, UTC]")
    except (ValueError, OverflowError, TypeError, AttributeError):
        wrong = next(k for k, cell in enumerate(cells) if not _is_iso(cell, of_day))
        raise InputError(
            f"{where}: {str(column.values[wrong])[:40]!r} in row {first_row + wrong}, column {column.name!r} "
            "-- expected a number, or a time stamp of ISO 8601 such as 2026-05-04T13:00:00.250 "
            "-- write it so, since days and months cannot be told apart otherwise"
        ) from None
    if not len(stamps) or stamps.isna().iloc[0]:
        return np.full(len(stamps), np.nan), [], None
    elapsed = stamps - stamps.iloc[0]
    times = elapsed.to_numpy(dtype="timedelta64[ns]")
    # whole nanoseconds over 1e9 are the nearest number to what the decimals say
    values = np.where(np.isnat(times), np.nan, times.astype(np.int64) / 1e9)
    begins = None if of_day else stamps.iloc[0].timestamp()
    return values, [f"time stamps, counted from the first, {column.values[0]}"], begins


def _is_iso(cell: object, of_day: bool) -> bool:
    import pandas as pd

    try:
        if of_day:
            pd.to_timedelta(str(cell))
        else:
            pd.to_datetime(pd.Series([cell]), format="ISO8601", utc=True).astype("datetime64[ns, UTC]")
    except (ValueError, OverflowError, TypeError):
        return False
    return True
