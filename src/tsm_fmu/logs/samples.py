"""What must hold for the samples of a run, checked in one place."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..kernels.arrays import FloatArray
from ..models.contract import InputError

__all__ = ["check_fitted", "check_order", "check_samples", "check_size", "window_note", "window_of"]

LARGEST = 1e100
"""Largest size of a sample [SI]: no sensor gives more, and mean squares stay finite."""
SMALLEST = 1e-100
"""Smallest size of the largest sample of a channel [SI] that is not zero throughout: mean squares stay above zero."""
STEPS = 1e-12, 1e12
"""Shortest and longest time between samples [s]: frequencies and speeds stay numbers."""


def window_of(where: str, time: FloatArray, start: float | None, stop: float | None) -> slice:
    """Samples with start <= time <= stop; `InputError` where fewer than two are left."""
    for option, bound in (("--from", start), ("--to", stop)):
        if bound is not None and not np.isfinite(bound):
            raise InputError(f"{option} {bound} -- expected a finite time [s] -- correct it")
    first = 0 if start is None else int(np.searchsorted(time, start, side="left"))
    last = time.size if stop is None else int(np.searchsorted(time, stop, side="right"))
    if (start is not None or stop is not None) and last - first < 2:
        span = f"{time[0]:g} to {time[-1]:g} s" if time.size else "no samples"
        begin, end = (time[0] if start is None else start), (time[-1] if stop is None else stop)
        raise InputError(
            f"{where}: {max(last - first, 0)} samples from {begin:g} to {end:g} s -- expected 2 or more inside {span} "
            "-- correct --from and --to"
        )
    return slice(first, last)


def window_note(time: FloatArray, start: float | None, stop: float | None) -> tuple[str, ...]:
    """One sentence for each bound that removes nothing, as one that was meant for another origin of time does."""
    notes = []
    if start is not None and start <= time[0]:
        notes.append(f"--from {start:g} removes nothing: the run begins at {time[0]:g} s")
    if stop is not None and stop >= time[-1]:
        notes.append(f"--to {stop:g} removes nothing: the run ends at {time[-1]:g} s")
    return tuple(notes)


def check_order(where: str, time: FloatArray, first_row: int) -> None:
    """Raise `InputError` where time is not a number, repeats or goes back; rows count from ``first_row``."""
    if time.size < 2:
        raise InputError(f"{where} has {time.size} samples -- expected 2 or more -- give a longer run")
    if not np.isfinite(time).all():
        k = int(np.argmin(np.isfinite(time)))
        raise InputError(f"{where}: time is {time[k]} in row {first_row + k} -- expected a number -- remove the row")
    steps = np.diff(time)
    if not (steps > 0.0).all():
        k = int(np.argmax(steps <= 0.0)) + 1
        sort = "repeats" if time[k] == time[k - 1] else "goes back"
        count = np.count_nonzero(steps <= 0.0)
        more = f" ({count} such rows)" if count > 1 else ""
        raise InputError(
            f"{where}: time {sort} in row {first_row + k}: {time[k]:.9g} s after {time[k - 1]:.9g} s{more} "
            "-- expected increasing time -- sort the log or remove the row"
        )


def check_samples(where: str, time: FloatArray, columns: Mapping[str, FloatArray], first_row: int) -> None:
    """Raise `InputError` for the first sample that no computation should see."""
    check_order(where, time, first_row)
    for name, values in columns.items():
        if values.shape != time.shape:
            raise InputError(
                f"{where}: {name!r} has shape {values.shape} -- expected {time.shape} as time -- give as many"
            )
        bad = ~np.isfinite(values)
        if bad.any():
            k = int(np.argmax(bad))
            text = "NaN or empty" if np.isnan(values[k]) else "infinite"
            raise InputError(
                f"{where}: {text} cell in row {first_row + k}, column {name!r} (t = {time[k]:g} s), {bad.sum()} such "
                "in this column -- expected finite numbers -- repair the log or cut it with --from and --to"
            )


def check_size(where: str, time: FloatArray, columns: Mapping[str, FloatArray], first_row: int) -> None:
    """Raise `InputError` for the first sample too large for a sum of squares, or times that give no rate.

    Results may hold such, a log not.
    """
    steps = np.diff(time)
    for step in (float(steps.min()), float(steps.max())):
        if not STEPS[0] <= step <= STEPS[1]:
            k = int(np.argmax(steps == step))
            raise InputError(
                f"{where}: {step:g} s between rows {first_row + k} and {first_row + k + 1} -- expected from "
                f"{STEPS[0]:g} to {STEPS[1]:g} s between samples -- correct the unit of time"
            )
    for name, values in columns.items():
        far = np.abs(values) > LARGEST
        if far.any():
            k = int(np.argmax(far))
            raise InputError(
                f"{where}: {values[k]:g} in row {first_row + k}, column {name!r} (t = {time[k]:g} s) -- expected "
                f"a size up to {LARGEST:g}, squares overflow beyond -- correct the unit, the --scale or the row"
            )


def check_fitted(where: str, columns: Mapping[str, FloatArray]) -> None:
    """Raise `InputError` for a channel of which nothing is left when it is squared, as a fit does."""
    for name, values in columns.items():
        most = float(np.abs(values).max())
        if 0.0 < most < SMALLEST:
            raise InputError(
                f"{where}: no sample of column {name!r} is larger than {most:g} -- expected 0 throughout or some above "
                f"{SMALLEST:g}, squares vanish below -- correct the unit or the --scale"
            )
