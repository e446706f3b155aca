"""Rows that a logger wrote again while the drive moved on: no measurements, though they look like a rest and a jump."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..kernels.arrays import FloatArray
from .record import Record

__all__ = ["repeated_rows", "without_repeated_rows"]

_BESIDE = 5  # samples on either side whose steps are the usual ones there
_FEWEST = 2  # rows: one is next to no gap
_PROBABILITY = 0.01  # of as many repeats in a run by chance, as often as the liveliest column repeats
_MOVED = 0.3  # part, at least, of what the drive would have moved in as many rows


def repeated_rows(record: Record) -> list[tuple[int, int]]:
    """First and last of the samples of each stretch that repeats the row before it in every column.

    A rest repeats too, where all sensors are coarse, and goes on as it began. A logger that stood still goes on where
    the drive has moved to meanwhile; and of a column that seldom repeats it makes more repeats than come by chance.
    """
    if len(record.columns) < 2:  # one column may stand
        return []
    steps = np.abs(np.diff(np.column_stack(list(record.columns.values())), axis=0))
    same = (steps == 0.0).all(axis=1)
    edges = np.flatnonzero(np.diff(same.astype(np.int8), prepend=0, append=0))
    stretches = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b < len(steps)]
    if not stretches or same.all():
        return []
    seldom = float((steps[~same] == 0.0).mean(axis=0).min())
    chance = math.log(max(seldom, 1.0 / len(steps)))
    fewest = max(_FEWEST, math.log(_PROBABILITY / len(steps)) / chance if chance < 0.0 else math.inf)
    return [(a + 1, b) for a, b in stretches if b - a >= fewest and _moved_on(steps, a, b)]


def _moved_on(steps: FloatArray, first: int, end: int) -> bool:
    """Whether the step after those that are zero holds what a column moved in these, which moves on either side."""
    before, after = steps[max(0, first - _BESIDE) : first], steps[end + 1 : end + 1 + _BESIDE]
    if not before.size or not after.size:
        return False
    usual = np.stack([np.median(before, axis=0), np.median(after, axis=0)])
    times = max(2.0, _MOVED * (end - first + 1))
    return bool(((usual > 0.0).all(axis=0) & (steps[end] > times * usual.max(axis=0))).any())


def without_repeated_rows(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Records without them, gaps of the clock instead, and what is said of it, a sentence for each such record.

    Parameters
    ----------
    records : sequence of Record
    """
    kept, said = [], []
    for record in records:
        found = repeated_rows(record)
        if found:
            rows = ", ".join(f"{record.row(first)} to {record.row(last)}" for first, last in found)
            said.append(f"{record.name}: rows {rows} repeat the one before them in every column and are left out")
            record = record.without([k for first, last in found for k in range(first, last + 1)])
        kept.append(record)
    return kept, said
