"""One thing found in a log, and how numbers are written in its sentence."""

from __future__ import annotations

from dataclasses import dataclass

from ..logs.display import display
from ..logs.record import Record

__all__ = ["Finding", "finding", "shown"]


@dataclass(frozen=True)
class Finding:
    """One thing found in a log.

    Attributes
    ----------
    kind : str
        ``gap``, ``jitter``, ``repeated``, ``start_up``, ``glitch``, ``jump``, ``disturbance``, ``clipping``, ``stuck``,
        ``quantisation``, ``direction``, ``power_sign``, ``columns`` or ``coverage``.
    channel : str
        Channel, several joined by ``", "``, or ``time``.
    t0, t1 : float
        Where in the run [s].
    rows : tuple of (int, int)
        The same as rows of the file, both included; the header is row 1.
    text : str
        One sentence.
    """

    kind: str
    channel: str
    t0: float
    t1: float
    rows: tuple[int, int]
    text: str


def finding(record: Record, kind: str, channel: str, first: int, last: int, text: str) -> Finding:
    """A finding between two samples of a record, both included."""
    last = max(first, min(last, record.time.size - 1))
    rows = (record.row(first), record.row(last))
    return Finding(kind, channel, float(record.time[first]), float(record.time[last]), rows, text)


def rows_text(record: Record, first: int, last: int) -> str:
    """Rows of the log from one sample to another, both included, in words."""
    one, other = record.row(first), record.row(last)
    return f"row {one}" if one == other else f"rows {one} to {other}"


def shown(value: float, unit: str) -> str:
    """A number in the unit that people read: deg for rad, mm for m, also in rad/s and the like."""
    return display(unit)(value, 4)
