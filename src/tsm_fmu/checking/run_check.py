"""All checks of one run in one result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import FloatArray
from ..logs.quantisation import quantisation_step
from ..logs.record import Record
from .clock import Clock, check_clock, check_repeated
from .coverage import (
    MotionCoverage,
    drive_channel,
    motion_of,
    shortest_period,
    speed_and_acceleration,
    speed_channels,
    with_travel,
)
from .criteria import BREAK_AWAY_SHARE, SLOW_SPEED_SHARE
from .events import check_events
from .finding import Finding, finding
from .power import Power, check_power
from .sensor import Positions, check_clipping, check_quantisation, check_stuck

__all__ = ["Channel", "RunCheck", "check_record"]


@dataclass(frozen=True)
class Channel:
    """One column in SI.

    Attributes
    ----------
    unit : str
    lowest, highest : float
    step : float
        Quantisation step; 0.0 where none was found.
    noise : float
        Standard deviation of sample-to-sample noise, from the median of the second differences; no less than the
        step over the root of 12, which is what quantisation adds.
    """

    unit: str
    lowest: float
    highest: float
    step: float
    noise: float


@dataclass(frozen=True)
class RunCheck:
    """What is in a run.

    Attributes
    ----------
    name : str
    sha256 : str
    samples : int
    t0, t1 : float
        First and last time [s].
    clock : Clock
    channels : dict of str to Channel
    motion : MotionCoverage or None
        Of the drive; None where no channel is a position that moves.
    powers : list of Power
    findings : list of Finding
        In order of time; ``coverage`` last.
    """

    name: str
    sha256: str
    samples: int
    t0: float
    t1: float
    clock: Clock
    channels: dict[str, Channel]
    motion: MotionCoverage | None
    powers: list[Power]
    findings: list[Finding]


def check_record(record: Record, cutoff: float | None = None) -> RunCheck:
    """Check a run; see `RunCheck`. Nothing is repaired.

    Parameters
    ----------
    record : Record
    cutoff : float, optional
        Cut-off [Hz] of the differentiator for speed and acceleration; from the data without it.

    Raises
    ------
    InputError
        If a cut-off is given that rate, length or gaps of the run do not allow.
    """
    clock, found = check_clock(record)
    drive, driven = drive_channel(record), record
    if not drive:
        driven, drive = with_travel(record)
    positions = Positions.of(record)
    window = max(3, int(0.1 * shortest_period(driven, drive) * clock.rate))
    channels = {name: _channel(record, name) for name in record.columns}
    for name, channel in channels.items():
        found += check_quantisation(record, name, channel.step)
        clipped = check_clipping(record, name, channel.step, window)
        # a clipped channel repeats its limit: one finding says it
        found += clipped or check_stuck(record, name, positions)
    motion, coverage, turning = None, [], np.zeros(record.time.size, dtype=bool)
    if drive:
        derivatives = speed_and_acceleration(driven, drive, cutoff)
        motion, coverage = motion_of(driven, drive, derivatives)
        turning = _turning(driven.columns[drive], derivatives[0], window)
    speeds = speed_channels(record)
    drives = [name for name in record.columns if name == drive or name in speeds]
    repeated = list(check_repeated(record))
    found += repeated
    found += [e for e in check_events(record, window, list(positions.names), turning, drives) if not _in(e, repeated)]
    powers, signs = check_power(record)
    found += signs
    if motion and motion.initial_rest * clock.rate > 0.5 * window:
        found.append(_rest(record, motion))
    if not record.columns:
        text = "no channel beside time: nothing can be checked; add measured columns such as 'x_in [rad]'"
        found.append(finding(record, "columns", "time", 0, record.time.size - 1, text))
    elif not drive:
        still = (
            f"{', '.join(positions.names)}: no motion"
            if positions.names
            else "no channel is an angle, a length or a speed"
        )
        text = f"{still}; strokes, reversals and frequencies cannot be judged; log the drive's position, such as x_in"
        coverage.append(finding(record, "coverage", "time", 0, record.time.size - 1, text))
    found.sort(key=lambda f: f.t0)
    t0, t1 = float(record.time[0]), float(record.time[-1])
    return RunCheck(
        record.name, record.sha256, record.time.size, t0, t1, clock, channels, motion, powers, found + coverage
    )


def _in(event: Finding, stretches: Sequence[Finding]) -> bool:
    """Whether an event begins or ends where a logger stood still."""
    return any(event.rows[0] <= s.rows[1] + 1 and event.rows[1] >= s.rows[0] - 1 for s in stretches)


def _channel(record: Record, name: str) -> Channel:
    x = record.columns[name]
    # white noise of standard deviation 1 has second differences of root 6; 1.4826 makes a median a deviation
    noise = float(1.4826 * np.median(np.abs(np.diff(x, 2))) / np.sqrt(6.0)) if x.size > 2 else 0.0
    step = quantisation_step(x)
    return Channel(record.units[name], float(x.min()), float(x.max()), step, max(noise, step / np.sqrt(12.0)))


def _turning(x: FloatArray, v: FloatArray, window: int) -> NDArray[np.bool_]:
    """Where the drive is slow, until it has moved away by a tenth of its range, and a window around."""
    slow = np.abs(v) < SLOW_SPEED_SHARE * max(float(np.quantile(np.abs(v), 0.99)), 1e-300)
    edges = np.flatnonzero(np.diff(slow.astype(np.int8), prepend=0, append=0))
    marked = np.zeros(x.size, dtype=bool)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        away = np.abs(x[end:] - x[end - 1]) > BREAK_AWAY_SHARE * float(np.ptp(x))
        broken = end + (int(np.argmax(away)) if away.any() else away.size)
        marked[max(0, begin - window) : broken + window] = True
    return marked


def _rest(record: Record, motion: MotionCoverage) -> Finding:
    end = int(np.searchsorted(record.time, record.time[0] + motion.initial_rest, side="right")) - 1
    text = (
        f"{motion.channel} rests until {record.time[end]:.3f} s; the state of friction and backlash is not known "
        "before the first reversals, so do not score the start"
    )
    return finding(record, "start_up", motion.channel, 0, end, text)
