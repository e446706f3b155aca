"""A channel that hums: a tone of mains or a pump is no noise, and no law of the motion predicts it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from ...kernels.arrays import FloatArray
from ...regression.residuals import rms
from ..criteria import EFFECT_SPREAD_SHARE, TONE_MOTION_RATIO, TONE_SHARE, TONE_STEADY_SHARE
from ..evidence import Tone
from ..runs.motion_signals import Coordinates

FEWEST = 100
"""Samples of each run that a spectrum is taken of."""
PADDING = 4
"""Lines of a spectrum for each that its samples make: a tone lies between two of these."""


def tones(
    channels: Sequence[str], residuals: Sequence[FloatArray], places: Sequence[Coordinates], spread: FloatArray
) -> dict[str, Tone]:
    """Tones in what a model leaves, by channel: of one frequency in all runs, as loud and in step from end to end.

    Looked for far above the motion, whose own harmonics lie below; told where they are a notable part of what is left
    and of the channel. At a steady speed a tone is not told from a law of the position, without a motion not from one
    of the inputs: there is none then.

    Parameters
    ----------
    channels : sequence of str
    residuals : sequence of ndarray, shape (n, channels)
        One array a run, of all its samples: of fewer the frequency would be an alias. NaN where nothing is compared.
    places : sequence of Coordinates
        At the same samples.
    spread : ndarray, shape (channels,)
        Standard deviation of each channel.
    """
    v, a = (float(np.sqrt(np.mean(np.concatenate([getattr(c, n) for c in places]) ** 2))) for n in ("v", "a"))
    speed = np.abs(np.concatenate([c.v for c in places]))
    if v == 0.0 or a == 0.0 or float(speed.std()) < TONE_STEADY_SHARE * float(speed.mean()):
        return {}
    lowest = TONE_MOTION_RATIO * a / (2.0 * np.pi * v)
    found = {}
    for c, channel in enumerate(channels):
        times, left = _compared(residuals, places, c)
        if min(time.size for time in times) < FEWEST:
            continue
        frequency = _loudest(times, left, lowest)
        if frequency is None:
            continue
        heard = [_nearest(time, y, frequency) for time, y in zip(times, left, strict=True)]
        size, beside = (float(rms(of)) for of in (heard, [y - tone for y, tone in zip(left, heard, strict=True)]))
        least = min(_least_share(y, tone) for y, tone in zip(left, heard, strict=True))
        if least > TONE_SHARE and size > EFFECT_SPREAD_SHARE * spread[c]:
            found[channel] = Tone(frequency, size, beside)
    return found


def size_of_tone(residuals: Sequence[FloatArray], places: Sequence[Coordinates], c: int, frequency: float) -> float:
    """RMS of the tone of a frequency in a channel of residuals, however little of them it makes.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n, channels)
    places : sequence of Coordinates
    c : int
        Column of the channel.
    frequency : float
        [Hz]
    """
    times, left = _compared(residuals, places, c)
    return float(rms([_nearest(time, y, frequency) for time, y in zip(times, left, strict=True)]))


def _compared(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], c: int
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Time, and what is left of a channel about its mean, of each run where it is compared."""
    known = [np.isfinite(r[:, c]) for r in residuals]
    times = [one.time[k] for one, k in zip(places, known, strict=True)]
    return times, [r[k, c] - np.mean(r[k, c]) if k.any() else r[k, c] for r, k in zip(residuals, known, strict=True)]


def _loudest(times: Sequence[FloatArray], left: Sequence[FloatArray], lowest: float) -> float | None:
    """Frequency [Hz] above the lowest of which all runs have most; None where their samples know none."""
    longest = max(float(np.ptp(time)) for time in times)
    steps = [float(np.median(np.diff(time))) for time in times]
    grid = np.arange(lowest, 0.5 / max(steps), 1.0 / (PADDING * longest))
    if grid.size < 2:
        return None
    power = np.zeros(grid.size)
    for time, y, step in zip(times, left, steps, strict=True):
        even = np.interp(np.arange(time[0], time[-1], step), time, y)  # over gaps and stamps that jitter
        spectrum = np.abs(np.fft.rfft(even * np.hanning(even.size), PADDING * even.size)) ** 2 / even.size
        power += np.interp(grid, np.fft.rfftfreq(PADDING * even.size, step), spectrum)
    near = float(grid[int(np.argmax(power))])

    def missed(frequency: float) -> float:
        return sum(float(np.sum((y - _nearest(time, y, frequency)) ** 2)) for time, y in zip(times, left, strict=True))

    around = (near - 0.5 / longest, near + 0.5 / longest)
    found: Any = minimize_scalar(missed, bounds=around, method="bounded")
    return float(found.x)


def _nearest(time: FloatArray, y: FloatArray, frequency: float) -> FloatArray:
    """The tone of a frequency that is nearest to a signal."""
    phase = 2.0 * np.pi * frequency * time
    cos, sin = np.cos(phase), np.sin(phase)
    (a, b), *_ = np.linalg.lstsq(np.column_stack([cos, sin]), y)
    return a * cos + b * sin


def _least_share(y: FloatArray, tone: FloatArray) -> float:
    """Part of the mean square of a signal that a tone makes, in that half of it where it makes less."""
    halves = [slice(None, y.size // 2), slice(y.size // 2, None)]
    return min(1.0 - float(np.sum((y[h] - tone[h]) ** 2)) / max(float(np.sum(y[h] ** 2)), 1e-300) for h in halves)
