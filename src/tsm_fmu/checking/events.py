"""Glitches, jumps and disturbances: what stands out from the local motion and does not recur.

Two residuals are looked at: the signal less its running median over a tenth of the shortest period of the
motion (leaves short excursions), and the increment less the running median of the increments around it (leaves
jumps). An event is where a residual is several times what it is in most other parts of the run, so that noise
and stick-slip, which recur, are no events. Friction changes sign where the drive turns, so
near a turn a force may change abruptly by its whole usual range. A drive goes where it is sent: what it does no faster
than in other places of the run is a move, and what other channels do then follows it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from ..kernels.arrays import FloatArray
from ..logs.quantisation import quantisation_step
from ..logs.record import Record
from .criteria import (
    EVENT_FOOT_SHARE,
    EVENT_RANGE_SHARE,
    EVENT_SENSOR_STEPS,
    EVENT_TIMES_USUAL,
    FEWEST_BLOCKS,
    GLITCH_SAMPLES,
    JUMP_KEPT_SHARE,
    JUMP_SAMPLES,
    MOVE_PLACES,
    MOVE_SPEED_RATIO,
    USUAL_QUANTILE,
)
from .finding import Finding, finding, rows_text, shown

__all__ = ["Event", "check_events", "events"]


@dataclass(frozen=True)
class Event:
    """Samples ``first`` to ``last``, both included; ``size`` is the largest excursion, in the channel's unit."""

    kind: str
    first: int
    last: int
    size: float


def events(x: FloatArray, window: int, turning: NDArray[np.bool_] | None = None) -> list[Event]:
    """Events of one channel.

    Parameters
    ----------
    x : ndarray, shape (n,)
    window : int
        Samples over which the motion itself changes little.
    turning : ndarray of bool, shape (n,), optional
        Where the drive turns or breaks away, for a force.
    """
    window = max(min(window, x.size // FEWEST_BLOCKS) | 1, JUMP_SAMPLES)
    usual_range = float(np.subtract(*np.quantile(x, (0.99, 0.01))))
    floor = max(EVENT_RANGE_SHARE * usual_range, EVENT_SENSOR_STEPS * quantisation_step(x))
    if usual_range == 0.0 or x.size < FEWEST_BLOCKS * window:
        return []
    excursion = np.abs(x - median_filter(x, window, mode="nearest"))
    steps = np.diff(x, prepend=x[0])
    jump = np.abs(steps - median_filter(steps, JUMP_SAMPLES, mode="nearest"))
    outside = []
    for residual in (excursion, jump):
        limit = np.full(x.size, max(floor, EVENT_TIMES_USUAL * _usual(residual, window)))
        if turning is not None:
            limit[turning] = np.maximum(limit[turning], usual_range)
        outside.append(residual > limit)
    return [
        _described(x, a, b, np.where(outside[0], excursion, 0.0), outside[1], window)
        for a, b in _spans(outside[0] | outside[1], window)
    ]


def check_events(
    record: Record, window: int, positions: Sequence[str], turning: NDArray[np.bool_], drives: Sequence[str] = ()
) -> list[Finding]:
    """Findings for the events of all channels; what happens at once in several channels is one finding.

    Parameters
    ----------
    record : Record
    window : int
        As for `events`.
    positions : sequence of str
        Channels that are positions; all others may change fast at a turn.
    turning : ndarray of bool, shape (n,)
        Where the drive turns or breaks away.
    drives : sequence of str, optional
        Channels that say how the rig is driven: its position, and its speed.
    """
    found = {n: events(x, window, None if n in positions else turning) for n, x in record.columns.items()}
    moves = [
        event for name in drives for event in found[name] if _recurs(record.columns[name], event, found[name], window)
    ]
    per_channel = [
        (name, event) for name, every in found.items() for event in every
        if event.kind == "glitch" or not any(_at_once(event, move, window) for move in moves)
    ]  # fmt: skip
    groups: list[list[tuple[str, Event]]] = []
    for item in sorted(per_channel, key=lambda pair: pair[1].first):
        if groups and any(_at_once(item[1], event, window) for _, event in groups[-1]):
            groups[-1].append(item)
        else:
            groups.append([item])
    return [_finding(record, group, window, positions) for group in groups]


def _at_once(one: Event, other: Event, window: int) -> bool:
    return max(one.first, other.first) <= min(one.last, other.last) + window // 2


def _recurs(x: FloatArray, event: Event, every: Sequence[Event], window: int) -> bool:
    """Whether a channel moves about as fast as in an event in several other places; other jumps are none of these."""
    if event.kind == "glitch":
        return False
    samples = event.last - event.first + 1
    lag = samples if event.kind == "jump" else max(1, samples // 2)
    moved = np.abs(x[lag:] - x[:-lag])
    begins = slice(max(0, event.first - lag), event.last + 1)
    fast = moved >= moved[begins].max(initial=0.0) / MOVE_SPEED_RATIO
    fast[begins] = False
    for jump in (e for e in every if e.kind != "disturbance"):
        fast[max(0, jump.first - lag) : jump.last + 1] = False
    return np.unique(np.flatnonzero(fast) // window).size >= MOVE_PLACES


def _finding(record: Record, group: list[tuple[str, Event]], window: int, positions: Sequence[str]) -> Finding:
    first, last = min(e.first for _, e in group), max(e.last for _, e in group)
    sizes: dict[str, float] = {}
    for name, event in group:
        sizes[name] = max(sizes.get(name, 0.0), event.size)
    kinds = [event.kind for _, event in group]
    early = first < window
    kind = "start_up" if early else next(k for k in ("disturbance", "jump", "glitch") if k in kinds)
    t0, t1 = record.time[first], record.time[last]
    moved = " and ".join(f"{name} by {shown(size, record.units[name])}" for name, size in sizes.items())
    where = f"at {t0:.3f} s" if last - first < GLITCH_SAMPLES else f"from {t0:.3f} to {t1:.3f} s"
    sudden = "lost counts or a slipped coupling" if set(sizes) <= set(positions) else "something that slips or lets go"
    what = {
        "start_up": f"start-up transient until {t1:.3f} s: {moved}; leave it out with --from",
        "glitch": f"{moved} {where}, for {last - first + 1} samples only: a glitch of the measurement, or a knock",
        "jump": f"{moved} {where} and stays there: a jump, as of {sudden}",
        "disturbance": f"{moved} {where} away from the motion around it: a disturbance",
    }[kind]
    rows = f" ({rows_text(record, first, last)})"
    return finding(record, kind, ", ".join(sizes), 0 if early else first, last, what + rows)


def _usual(residual: FloatArray, window: int) -> float:
    """What the largest residual of a block is in three of four blocks."""
    starts = np.arange(0, residual.size - window // 2, max(1, window // 2))
    return float(np.quantile(np.maximum.reduceat(residual, starts), USUAL_QUANTILE))


def _spans(outside: NDArray[np.bool_], window: int) -> list[tuple[int, int]]:
    """First and last samples of the runs of True; runs closer than half a window are one."""
    at = np.flatnonzero(outside)
    if not at.size:
        return []
    breaks = np.flatnonzero(np.diff(at) > window // 2)
    return [(int(a), int(b)) for a, b in zip(at[np.r_[0, breaks + 1]], at[np.r_[breaks, at.size - 1]], strict=True)]


def _described(
    x: FloatArray, first: int, last: int, excursion: FloatArray, jump: NDArray[np.bool_], window: int
) -> Event:
    """What an event is: its level afterwards tells a jump, its length a glitch."""
    reach = max(JUMP_SAMPLES, window // 2)
    before, after = x[max(0, first - reach) : first], x[last + 1 : last + 1 + reach]
    part = excursion[first : last + 1]
    # a wide event pulls the running median along: what is below a part of its height is not the event
    away = first + np.flatnonzero(part > (EVENT_FOOT_SHARE if first > window else 0.0) * part.max())
    jumps = first + np.flatnonzero(jump[first : last + 1])
    steps = np.diff(x, prepend=x[0])
    if jumps.size and before.size and after.size:
        around = np.median(steps[max(0, first - reach) : last + 1 + reach])
        net_step = abs(float(np.sum(steps[jumps] - around)))
        if net_step > JUMP_KEPT_SHARE * float(np.max(np.abs(steps[jumps]))):
            return Event("jump", int(jumps[0]), int(jumps[-1]), net_step)
    if away.size:
        first, last = int(away[0]), int(away[-1])
    level = float(np.median(before)) if before.size else float(x[last])
    size = float(np.max(np.abs(x[first : last + 1] - level)))
    return Event("glitch" if last - first < GLITCH_SAMPLES else "disturbance", first, last, size)
