"""Signs: does drive power go in, does the output follow the drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import FloatArray
from ..logs.record import Record
from .criteria import OPPOSITE_EFFORTS, OPPOSITE_POSITIONS, POWER_SHARE
from .finding import Finding, finding

__all__ = ["Power", "check_power"]

_MOTIONS = {"N.m": "rad", "N": "m"}


@dataclass(frozen=True)
class Power:
    """Work of an effort channel along a motion channel.

    Attributes
    ----------
    effort, motion : str
        Channels.
    mean : float
        Mean power [W] over whole strokes there and back, so that what a spring gives back does not count.
    share : float
        The work over the integral of abs(effort - its mean) abs(dx): 1 all one way, 0 neither.
    """

    effort: str
    motion: str
    mean: float
    share: float


def check_power(record: Record) -> tuple[list[Power], list[Finding]]:
    """Work of tau_in over x_in, F over x and their like; a finding where a passive drive would give power."""
    powers, found = [], []
    for effort in record.columns:
        motion = _partner(record, effort)
        if motion is None:
            continue
        power, first, last = _work(record, effort, motion)
        powers.append(power)
        if effort.endswith(("_out", "_load")) or power.share >= -POWER_SHARE:
            continue  # a load may drive: both signs are possible on the output side
        text = (
            f"{effort} * d{motion}/dt is {power.mean:.3g} W on average: the drive would take power out of a rig with "
            f"friction; a sign looks turned: try --scale {effort}=-1 (or {motion}=-1)"
        )
        found.append(finding(record, "power_sign", f"{effort}, {motion}", first, last, text))
    return powers, found + _directions(record)


def _partner(record: Record, effort: str) -> str | None:
    motion_unit = _MOTIONS.get(record.units[effort])
    suffix = effort[effort.index("_") :] if "_" in effort else ""
    side = {"_drive": "_in", "_load": "_out"}.get(suffix, suffix)
    return next((c for c in (f"x{side}", "x") if c in record.columns and record.units[c] == motion_unit), None)


def _work(record: Record, effort: str, motion: str) -> tuple[Power, int, int]:
    x, tau = record.columns[motion], record.columns[effort]
    first, last = _whole_strokes(x)
    dx = np.diff(x[first : last + 1])
    between = 0.5 * (tau[first:last] + tau[first + 1 : last + 1])
    work = float(between @ dx)
    most = float(np.abs(between - between.mean()) @ np.abs(dx))
    seconds = float(record.time[last] - record.time[first])
    return Power(effort, motion, work / seconds, work / most if most > 0.0 else 0.0), first, last


def _whole_strokes(x: FloatArray) -> tuple[int, int]:
    """First and last upward crossing of the middle of the range; the whole run where there are fewer than two."""
    above = x > 0.5 * (float(x.max()) + float(x.min()))
    up = np.flatnonzero(above[1:] & ~above[:-1])
    return (int(up[0]), int(up[-1])) if up.size > 1 else (0, x.size - 1)


def _directions(record: Record) -> list[Finding]:
    found = []
    for a, b in (("x_in", "x_out"), ("tau_in", "tau_out")):
        if a not in record.columns or b not in record.columns:
            continue
        p, q = record.columns[a], record.columns[b]
        if np.ptp(p) == 0.0 or np.ptp(q) == 0.0:
            continue
        r = float(np.corrcoef(p, q)[0, 1])
        if r < (OPPOSITE_POSITIONS if a == "x_in" else OPPOSITE_EFFORTS):
            text = f"{b} falls when {a} grows (correlation {r:.2f}): opposite senses; try --scale {b}=-1"
            found.append(finding(record, "direction", f"{a}, {b}", 0, p.size - 1, text))
    return found
