"""What a channel's values say about its sensor: converter steps, clipping, a value that does not move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import FloatArray
from ..logs.record import Record
from .coverage import position_channels, speed_channels
from .criteria import (
    COARSE_STEPS,
    LIMIT_SAMPLES,
    LIMIT_SHARE,
    LIMIT_SPEED_SHARE,
    NEAR_LIMIT_SHARE,
    NOISY_SHARE,
    REST_TRAVEL_SHARE,
    STUCK_REPEATS,
    STUCK_SHARE,
    STUCK_TRAVEL_SHARE,
    VISIT_SHARE,
    VISITS_CUT_SHARE,
)
from .finding import Finding, finding, rows_text, shown
from .spikes import without_spikes

__all__ = ["Positions", "check_clipping", "check_quantisation", "check_stuck"]


def check_quantisation(record: Record, name: str, step: float) -> list[Finding]:
    """A finding where the channel's range holds few steps."""
    x = record.columns[name]
    levels = float(np.ptp(x)) / step if step > 0.0 else np.inf
    if levels >= COARSE_STEPS:
        return []
    text = (
        f"{name} moves over {levels:.0f} steps of {shown(step, record.units[name])} only: "
        "the sensor is coarse for this motion"
    )
    return [finding(record, "quantisation", name, 0, x.size - 1, text)]


def check_clipping(record: Record, name: str, step: float, window: int) -> list[Finding]:
    """A finding for each end of the range where the signal stays exactly at a limit, as it would not by itself.

    In a channel with noise, which goes up and down from sample to sample, repeating the largest value is enough.
    Else, a position may rest there by friction: then it has to run into the limit, and leave it, at speed on nearly
    every of several visits.
    """
    x = record.columns[name]
    wobbles = np.diff(x, prepend=x[0]) * np.diff(x, append=x[-1]) < 0.0
    found = []
    lead = max(3, window // 4)
    typical = float(np.sqrt(np.mean(np.square(x[lead:] - x[:-lead])))) if x.size > lead else 0.0
    for end, limit in (("upper", float(x.max())), ("lower", float(x.min()))):
        at_limit = np.abs(x - limit) <= max(0.25 * step, 1e-12 * abs(limit))
        starts, lengths = _runs(at_limit)
        flat = lengths >= 3
        count = int(lengths[flat].sum())
        if typical == 0.0 or count < max(LIMIT_SAMPLES, int(LIMIT_SHARE * x.size)):
            continue
        begins, ends = starts[flat], (starts + lengths - 1)[flat]
        near = (np.abs(x - limit) < NEAR_LIMIT_SHARE * float(np.ptp(x))) & ~at_limit
        noisy = near.any() and float(np.mean(wobbles[near])) > NOISY_SHARE
        if noisy or _runs_into(x, limit, begins, ends, lead, LIMIT_SPEED_SHARE * typical):
            text = (
                f"{name} stays at its {end} limit {shown(limit, record.units[name])} for {count} samples in "
                f"{begins.size} stretches: clipped or against a stop"
            )
            found.append(finding(record, "clipping", name, int(begins[0]), int(ends[-1]), text))
    return found


@dataclass(frozen=True)
class Positions:
    """The channels that are positions, less their spikes: of thousands of them each is compared with all at once.

    Attributes
    ----------
    names : tuple of str
    values : ndarray, shape (n, channels)
    ranges : ndarray, shape (channels,)
    """

    names: tuple[str, ...]
    values: FloatArray
    ranges: FloatArray

    @classmethod
    def of(cls, record: Record) -> Positions:
        """Those of a record."""
        names = tuple(position_channels(record))
        columns = [without_spikes(record.columns[n], record.time) for n in names]  # a glitch is no motion
        values = np.column_stack(columns) if names else np.empty((record.time.size, 0))
        return cls(names, values, np.ptp(values, axis=0))

    def travel(self, first: int, last: int) -> float:
        """Largest share of its range that any of them moves over from a row to another."""
        moved = np.ptp(self.values[first : last + 1], axis=0)
        return float((moved / np.maximum(self.ranges, 1e-300)).max(initial=0.0))


def check_stuck(record: Record, name: str, moving: Positions) -> list[Finding]:
    """A finding where the channel repeats one value exactly while another moves, or far longer than it ever does.

    Parameters
    ----------
    record : Record
    name : str
    moving : Positions
    """
    x = record.columns[name]
    if np.ptp(x) == 0.0:
        text = f"{name} is {shown(float(x[0]), record.units[name])} in every row: not connected, or not measured"
        return [finding(record, "stuck", name, 0, x.size - 1, text)]
    begins = np.flatnonzero(np.diff(x, prepend=np.nan) != 0.0)
    lengths = np.diff(begins, append=x.size)
    longest = int(np.argmax(lengths))
    first, last = int(begins[longest]), int(begins[longest] + lengths[longest]) - 1
    travel = moving.travel(first, last)  # its own is 0: it repeats
    noisy = name not in moving.names and np.median(lengths) <= 3
    usual = float(np.quantile(np.delete(lengths, longest), 0.99)) if lengths.size > 1 else np.inf
    long = (
        lengths[longest] >= max(LIMIT_SAMPLES, int(STUCK_SHARE * x.size)) and lengths[longest] > STUCK_REPEATS * usual
    )
    if travel <= STUCK_TRAVEL_SHARE and not (noisy and long):
        return []
    if x[first] == 0.0 and moving.names and travel <= REST_TRAVEL_SHARE and name in speed_channels(record):
        return []  # the speed of what rests
    while_moving = (
        f" while another position moves over {100 * travel:.0f} % of its range" if travel > STUCK_TRAVEL_SHARE else ""
    )
    text = (
        f"{name} repeats {shown(float(x[first]), record.units[name])} exactly from {record.time[first]:.3f} to "
        f"{record.time[last]:.3f} s{while_moving} ({rows_text(record, first, last)}): "
        "stuck sensor or lost link"
    )
    return [finding(record, "stuck", name, first, last, text)]


def _runs_into(
    x: FloatArray, limit: float, begins: NDArray[np.int64], ends: NDArray[np.int64], lead: int, fast: float
) -> bool:
    visits = _runs(np.abs(x - limit) <= VISIT_SHARE * float(np.ptp(x)))[0].size
    if begins.size < max(2, VISITS_CUT_SHARE * visits):
        return False
    enters, leaves = begins[begins >= lead], ends[ends < x.size - lead]
    speeds = [np.abs(x[enters] - x[enters - lead]), np.abs(x[leaves] - x[leaves + lead])]
    return all(s.size and float(np.median(s)) > fast for s in speeds)


def _runs(flags: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Start and length of the runs of True."""
    edges = np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0, append=0))
    return edges[::2], edges[1::2] - edges[::2]
