"""A table as a file holds it: header cells and columns, before names, units and times are understood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

__all__ = ["RawTable"]


@dataclass(frozen=True)
class RawTable:
    """What a reader of one format gives.

    Attributes
    ----------
    cells : list of str
        Header cells, ``name [unit]`` or ``name``.
    units : list of (str or None), or None
        Units that stand elsewhere than in the header cells; None where the format has no such place.
    columns : list of ndarray
        float64 with NaN for a missing number, or objects (str, None) for text and time stamps.
    first_row : int
        Row of the file that holds the first sample, counted from 1.
    notes : sequence of str
        What was found out about the file, one sentence each.
    """

    cells: list[str]
    units: Sequence[str | None] | None
    columns: list[np.ndarray]
    first_row: int = 2
    notes: Sequence[str] = field(default_factory=tuple)
