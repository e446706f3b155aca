"""How small a gap can be: the noise floor of a channel from repeats or, without any, from what no model follows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..identify.problem import FitRun, FloatArray

SAME_MOTION = 0.02
"""Periods repeat if the input comes back within this part of its span."""


def repeats_floor(runs: Sequence[FitRun], motion: int) -> FloatArray | None:
    """RMS by which each channel does not repeat from period to period; None where no motion repeats.

    Parameters
    ----------
    runs : sequence of FitRun
    motion : int
        Column of the position or speed input.
    """
    squares = [_from_repeats(run, motion) for run in runs]
    found = [(s, run.time.size) for s, run in zip(squares, runs, strict=True) if s is not None]
    if len(found) < len(runs):
        return None
    return np.sqrt(sum(s * n for s, n in found) / sum(n for _, n in found))


def noise_floor(runs: Sequence[FitRun]) -> FloatArray:
    """RMS of what changes from sample to sample, which no motion explains: a lower bound of the noise."""
    return np.sqrt(np.mean([_sample_to_sample(run.targets) for run in runs], axis=0))


def period_of(x: FloatArray) -> int | None:
    """Samples of one period of a motion that repeats at least three times, or None."""
    centred = x - x.mean()
    length = 1 << (2 * x.size - 1).bit_length()
    power = np.fft.irfft(np.abs(np.fft.rfft(centred, length)) ** 2, length)[: x.size]
    power = power / np.maximum(np.arange(x.size, 0, -1), 1)
    if power[0] <= 0.0:
        return None
    power /= power[0]
    below = np.flatnonzero(power < 0.5)
    if not below.size or below[0] >= x.size // 3:
        return None
    lag = int(below[0] + np.argmax(power[below[0] : x.size // 3 + 1]))
    error = np.sqrt(np.mean((x[lag:] - x[:-lag]) ** 2))
    return lag if error < SAME_MOTION * np.ptp(x) else None


def _from_repeats(run: FitRun, motion: int) -> FloatArray | None:
    period = period_of(run.inputs[:, motion])
    if period is None or period < 8:
        return None
    others = np.abs(run.inputs[period:] - run.inputs[:-period])
    if np.any(np.sqrt(np.mean(others**2, axis=0)) > SAME_MOTION * np.maximum(np.ptp(run.inputs, axis=0), 1e-300)):
        return None  # another input does not repeat with the motion
    count = run.time.size // period
    whole = run.targets[run.time.size - count * period :].reshape(count, period, -1)
    if count < 3:
        return None
    whole = whole[1:] if count > 3 else whole  # the first period starts from rest
    spread = whole - whole.mean(axis=0)
    return np.sum(spread**2, axis=(0, 1)) / (period * (whole.shape[0] - 1))


def _sample_to_sample(y: FloatArray) -> FloatArray:
    """Variance of white noise from third differences, which a smooth signal hardly has; median against jumps."""
    third = np.diff(y, n=3, axis=0)
    return (np.median(np.abs(third), axis=0) / 0.6745) ** 2 / 20.0
