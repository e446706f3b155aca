"""The order of runs in a life: as given, by name, by the date at which they begin, or by a column."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise

from ..logs.record import Record
from ..models.contract import InputError

GIVEN, NAME, START = "given", "name", "start"
ORDERS = {GIVEN: "they were given", NAME: "of their names", START: "of the dates at which they begin"}
"""After "in the order"."""


def ordered(records: Sequence[Record], by: str) -> list[Record]:
    """Runs in time order.

    Parameters
    ----------
    records : sequence of Record
    by : str
        ``given``; ``name``: of the files, numbers by their value, so that day_2 is before day_10; ``start``: the date
        at which a run begins; or a column, by its first value in each run.

    Raises
    ------
    InputError
        A run without dates or without the column, or two runs at the same place.
    """
    if by == GIVEN:
        return list(records)
    if by == NAME:
        return sorted(records, key=lambda record: (_natural(record.name), record.name))
    places = {record.name: _start(record) if by == START else _first_value(record, by) for record in records}
    found = sorted(records, key=lambda record: places[record.name])
    for a, b in pairwise(found):
        if places[a.name] == places[b.name]:
            raise InputError(
                f"--by {by}: runs {a.name} and {b.name} are both at {_shown(places[a.name], by)} -- expected a place "
                "each -- order by something else, or leave one out"
            )
    return found


def order_note(records: Sequence[Record], by: str) -> tuple[str, ...]:
    """One sentence where runs that are not ordered by their dates are in another order than these."""
    starts = [record.begins for record in records if record.begins is not None]
    if by in (GIVEN, NAME) and len(starts) == len(records) and starts != sorted(starts):
        return ("runs are in another order than that of their dates: --by start takes these",)
    return ()


def _natural(name: str) -> list[tuple[int, int, str]]:
    """Parts of a name, numbers by their value."""
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in re.split(r"(\d+)", name) if part]


def _start(record: Record) -> float:
    if record.begins is None:
        raise InputError(
            f"--by start: the times of {record.source or record.name} are no dates -- expected time stamps, or seconds "
            "since 1970 -- order by --by name or --by COLUMN"
        )
    return record.begins + float(record.time[0])


def _first_value(record: Record, column: str) -> float:
    if column not in record.columns:
        raise InputError(
            f"--by {column}: {record.source or record.name} has no such column -- expected one of given, name, start, "
            f"{', '.join(record.columns)} -- correct the name"
        )
    return float(record.columns[column][0])


def _shown(place: float, by: str) -> str:
    return datetime.fromtimestamp(place, UTC).isoformat(sep=" ") if by == START else f"{place:g}"
