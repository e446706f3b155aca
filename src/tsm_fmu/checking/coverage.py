"""Coverage: over what range of position, speed, load and frequency the log was taken, and what it cannot show."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks, periodogram

from ..kernels.arrays import FloatArray
from ..kernels.drives import ANGLE
from ..logs.differentiate import differentiate
from ..logs.quantisation import quantisation_step
from ..logs.record import Record
from ..logs.units import same_quantity, unit_to_si
from ..models.contract import InputError
from .criteria import (
    FEWEST_REVERSALS,
    INNER_LOOP_SHARE,
    LINE_POWER_SHARE,
    LOAD_VARIATION_SHARE,
    LONG_REST_S,
    REST_SPEED_SHARE,
    TURN_SENSOR_STEPS,
    TURN_SHARE,
)
from .finding import Finding, finding, shown

__all__ = [
    "MotionCoverage", "drive_channel", "motion_of", "position_channels", "shortest_period", "speed_and_acceleration",
    "with_travel",
]  # fmt: skip

Derivatives = tuple[FloatArray, FloatArray, float | None]


@dataclass(frozen=True)
class MotionCoverage:
    """How the drive moved.

    Attributes
    ----------
    channel : str
        The position these numbers are of.
    unit : str
        Its unit; speed and acceleration are per s and s2.
    x, v, a : tuple of (float, float)
        Lowest and highest value.
    reversals : int
        Turning points.
    amplitudes : tuple of (float, float, float)
        Half strokes between turning points: smallest, median, largest.
    frequencies : tuple of float
        Dominating frequencies [Hz], strongest first.
    dwell : float
        Longest rest inside the motion [s]: speed below 2 % of what it reaches (99 % quantile).
    initial_rest : float
        Rest before the first motion [s].
    cutoff : float or None
        Cut-off of the differentiator [Hz]; None where sampling is uneven and differences were used.
    """

    channel: str
    unit: str
    x: tuple[float, float]
    v: tuple[float, float]
    a: tuple[float, float]
    reversals: int
    amplitudes: tuple[float, float, float]
    frequencies: tuple[float, ...]
    dwell: float
    initial_rest: float
    cutoff: float | None


def position_channels(record: Record) -> list[str]:
    """Channels that are angles or lengths, in the log's order."""
    return [name for name, unit in record.units.items() if same_quantity(unit, "rad") or same_quantity(unit, "m")]


def drive_channel(record: Record) -> str | None:
    """The position the rig is driven by: x_in, x, or the first position that moves; not the angle of a sheath."""
    moving = [name for name in position_channels(record) if name != ANGLE.column and np.ptp(record.columns[name]) > 0.0]
    return next((name for name in ("x_in", "x", "theta_in", *moving) if name in moving), None)


def with_travel(record: Record) -> tuple[Record, str | None]:
    """The record with the integral of its first speed that moves as a channel, and the name of that; None without."""
    for name in speed_channels(record):
        travel, unit = f"integral of {name}", unit_to_si(record.units[name]).si.removesuffix("/s")
        from scipy.integrate import cumulative_trapezoid  # slow to import, seldom needed

        x = cumulative_trapezoid(record.columns[name], record.time, initial=0.0)
        return replace(record, columns={**record.columns, travel: x}, units={**record.units, travel: unit}), travel
    return record, None


def speed_channels(record: Record) -> list[str]:
    """Speeds that move."""
    speeds = [n for n, unit in record.units.items() if same_quantity(unit, "rad/s") or same_quantity(unit, "m/s")]
    return [name for name in speeds if np.ptp(record.columns[name]) > 0.0]


def shortest_period(record: Record, name: str | None) -> float:
    """Shortest period [s] that counts in the motion: 95 % of the channel's power is at longer ones."""
    span = float(record.time[-1] - record.time[0])
    if name is None:
        return 0.5 * span
    frequency, power = _spectrum(record, name)
    below = np.cumsum(power)
    return 1.0 / max(float(frequency[int(np.searchsorted(below, 0.95 * below[-1]))]), 1.0 / span)


def motion_of(record: Record, name: str, derivatives: Derivatives) -> tuple[MotionCoverage, list[Finding]]:
    """Coverage of the motion of one position channel, and findings on what it leaves out."""
    x, time = record.columns[name], record.time
    v, a, cutoff = derivatives
    turns = _turning_points(x)
    half = 0.5 * np.abs(np.diff(x[turns])) if turns.size > 1 else np.array([0.5 * float(np.ptp(x))])
    resting = np.abs(v) < REST_SPEED_SHARE * max(float(np.quantile(np.abs(v), 0.99)), 1e-300)
    edges = np.flatnonzero(np.diff(resting.astype(np.int8), prepend=0, append=0))
    begins, ends = edges[::2], edges[1::2] - 1
    rests = time[ends] - time[begins]
    at_start = bool(begins.size and begins[0] == 0)
    inner = rests[1:] if at_start else rests
    motion = MotionCoverage(
        channel=name,
        unit=record.units[name],
        x=(float(x.min()), float(x.max())),
        v=(float(v.min()), float(v.max())),
        a=(float(a.min()), float(a.max())),
        reversals=int(turns.size),
        amplitudes=(float(half.min()), float(np.median(half)), float(half.max())),
        frequencies=_frequencies(record, name),
        dwell=float(inner.max(initial=0.0)),
        initial_rest=float(rests[0]) if at_start else 0.0,
        cutoff=cutoff,
    )
    return motion, _missing(record, motion)


def _missing(record: Record, motion: MotionCoverage) -> list[Finding]:
    """What this motion cannot show, and what motion would."""
    texts = []
    low, middle, high = motion.amplitudes
    if motion.reversals < FEWEST_REVERSALS:
        texts.append(f"{motion.reversals} reversals: a loop is not repeated; drive at least two whole periods")
    if len(motion.frequencies) == 1:
        texts.append(
            f"one frequency only ({motion.frequencies[0]:.3g} Hz): rate dependence, delay and "
            "inertia cannot be told apart; add a run at three times the speed or a multi-sine"
        )
    if motion.reversals >= FEWEST_REVERSALS and low > INNER_LOOP_SHARE * high:
        texts.append(
            f"all half strokes are near {shown(middle, motion.unit)}: no inner loops, so memory of earlier "
            "reversals is not seen; add smaller strokes about several positions"
        )
    loads = [c for c in ("tau_out", "tau_load", "T_load", "T_out", "T_in", "tau_in", "tau", "F") if c in record.columns]
    if not loads:
        texts.append("no force or torque in the log: friction and load dependence cannot be judged")
    elif (spread := _load_spread(record.columns[loads[0]])) < LOAD_VARIATION_SHARE:
        texts.append(
            f"{loads[0]} varies by {100 * spread:.0f} % of its size: load dependence is not seen; "
            "add a run with another load"
        )
    if motion.dwell < LONG_REST_S:
        texts.append(
            f"no rest longer than {motion.dwell:.2g} s: creep and breakaway after a hold are not seen; "
            "add holds of 1 to 30 s"
        )
    last = record.time.size - 1
    return [finding(record, "coverage", motion.channel, 0, last, text) for text in texts]


def _load_spread(load: FloatArray) -> float:
    low, high = np.quantile(load, (0.01, 0.99))
    return float(high - low) / max(float(np.abs(load).mean()), 1e-300)


def speed_and_acceleration(record: Record, name: str, cutoff: float | None = None) -> Derivatives:
    """Speed, acceleration and the cut-off [Hz] of the differentiator (None: plain differences) of a channel."""
    x, time = record.columns[name], record.time
    try:
        v, a = (differentiate(time, x, order, cutoff, record.first_row) for order in (1, 2))
    except InputError:
        if cutoff is not None:
            raise
        # uneven or too short: ranges are still worth a look
        v = np.gradient(x, time)
        return v, np.gradient(v, time), None
    return v.values, a.values, v.cutoff


def _turning_points(x: FloatArray) -> NDArray[np.int64]:
    """Samples where the motion turns; wobble below 2 % of the range or three sensor steps is none."""
    least = max(TURN_SHARE * float(np.ptp(x)), TURN_SENSOR_STEPS * quantisation_step(x))
    if least == 0.0:
        return np.empty(0, dtype=np.int64)
    up, _ = find_peaks(x, prominence=least)
    down, _ = find_peaks(-x, prominence=least)
    return np.sort(np.concatenate((up, down)))


def _spectrum(record: Record, name: str) -> tuple[FloatArray, FloatArray]:
    x, time = record.columns[name], record.time
    period = float(time[-1] - time[0]) / (time.size - 1)
    even = time[0] + period * np.arange(time.size)
    frequency, power = periodogram(np.interp(even, time, x), 1.0 / period, window="hann", detrend="constant")
    return frequency[1:], power[1:]


def _frequencies(record: Record, name: str) -> tuple[float, ...]:
    """Lines of the spectrum above a part of the strongest's power, harmonics included, strongest first."""
    frequency, power = _spectrum(record, name)
    padded = np.concatenate(([0.0], power, [0.0]))
    peaks, _ = find_peaks(
        padded, height=LINE_POWER_SHARE * float(power.max()), prominence=0.5 * LINE_POWER_SHARE * float(power.max())
    )
    strongest = peaks[np.argsort(-padded[peaks])][:5]
    return tuple(_between(frequency, power, int(k) - 1) for k in strongest)


def _between(frequency: FloatArray, power: FloatArray, k: int) -> float:
    """Frequency of a peak between the lines of a Hann spectrum (Gaussian through three)."""
    if not 0 < k < power.size - 1 or power[k - 1] <= 0.0 or power[k + 1] <= 0.0:
        return float(frequency[k])
    left, mid, right = np.log(power[k - 1 : k + 2])
    return float(frequency[k] + 0.5 * (left - right) / (left - 2.0 * mid + right) * (frequency[1] - frequency[0]))
