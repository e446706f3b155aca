"""Sampling: rate, jitter, gaps, and rows that the logger wrote again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..logs.record import Record
from ..logs.repeated import repeated_rows
from .criteria import GAP_INTERVALS, JITTER_SHARE, MOST_GAPS_LISTED
from .finding import Finding, finding, rows_text

__all__ = ["Clock", "check_clock", "check_repeated"]


@dataclass(frozen=True)
class Clock:
    """Sampling of a run.

    Attributes
    ----------
    rate : float
        1 / median interval [Hz].
    jitter : float
        RMS deviation of the intervals, gaps left out, from their median [s].
    gaps : int
        Intervals longer than 1.5 medians.
    """

    rate: float
    jitter: float
    gaps: int


def check_clock(record: Record) -> tuple[Clock, list[Finding]]:
    """Rate and jitter; a finding for each of the first gaps, and one for jitter above 5 % of the interval."""
    steps = np.diff(record.time)
    middle = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP_INTERVALS * middle)
    regular = np.delete(steps, gaps)
    jitter = float(np.sqrt(np.mean(np.square(regular - middle)))) if regular.size else 0.0
    found = []
    for k in gaps[:MOST_GAPS_LISTED]:
        missing = round(float(steps[k]) / middle) - 1
        text = (
            f"gap of {steps[k]:.4g} s at {record.time[k]:.3f} s, between rows {record.row(k)} and {record.row(k + 1)}: "
            f"about {missing} samples are missing; nothing is filled in"
        )
        found.append(finding(record, "gap", "time", int(k), int(k) + 1, text))
    if gaps.size > MOST_GAPS_LISTED:
        rest = gaps[MOST_GAPS_LISTED:]
        text = f"{rest.size} more gaps after row {record.row(int(rest[0]))}, the longest {steps[rest].max():.4g} s"
        found.append(finding(record, "gap", "time", int(rest[0]), int(rest[-1]) + 1, text))
    if jitter > JITTER_SHARE * middle:
        text = f"sampling jitters by {jitter:.3g} s RMS around {middle:.4g} s ({100 * jitter / middle:.0f} %)"
        found.append(finding(record, "jitter", "time", 0, record.time.size - 1, text))
    return Clock(1.0 / middle, jitter, int(gaps.size)), found


def check_repeated(record: Record) -> Iterator[Finding]:
    """A finding for each stretch."""
    for first, last in repeated_rows(record):
        text = (
            f"every column repeats from {record.time[first]:.3f} to {record.time[last]:.3f} s "
            f"({rows_text(record, first, last)}) and goes on elsewhere: the logger stood still, the drive did not; "
            "a fit leaves these rows out"
        )
        yield finding(record, "repeated", "time", first, last, text)
