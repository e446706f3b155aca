"""A channel that hums: a tone of mains or a pump is no noise, and no law of the motion predicts it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.fft import next_fast_len
from scipy.ndimage import maximum_filter1d
from scipy.optimize import minimize_scalar

from ...kernels.arrays import FloatArray
from ...regression.residuals import rms
from ...regression.threads import together
from ..criteria import (
    EFFECT_SPREAD_SHARE,
    NEAR_TONE_MOTION_RATIO,
    NEAR_TONE_SHARE,
    TONE_MOTION_RATIO,
    TONE_SHARE,
    TONE_STEADY_SHARE,
    TONE_WANDER_SHARE,
)
from ..evidence import Tone
from ..runs.motion_signals import Coordinates

FEWEST = 100
"""Samples of each run that a spectrum is taken of."""
PADDING = 4
"""Lines of a spectrum at least for each that its samples make: a tone lies between two of these."""

_Spectrum = tuple[FloatArray, FloatArray]


def tones(
    channels: Sequence[str], residuals: Sequence[FloatArray], places: Sequence[Coordinates], spread: FloatArray
) -> dict[str, Tone]:
    """Tones in what a model leaves, by channel: of one frequency, as loud and in step from end to end of each run.

    Looked for far above the motion, whose own harmonics lie below, or where nothing is loud there nearer to it, if it
    is more of what is left than one harmonic is; told where they are a notable part of that and of the channel. Mains
    wander from run to run: so may the frequency, a little. At a steady speed a tone is not told from a law of the
    position, without a motion not from one of the inputs: there is none then.

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
    of_motion = a / (2.0 * np.pi * v)
    found = {}
    for c, channel in enumerate(channels):
        times, left = _compared(residuals, places, c)
        least = EFFECT_SPREAD_SHARE * spread[c]
        if min(time.size for time in times) < FEWEST or rms(left) <= least:
            continue  # a tone is no larger than what is left
        spectra = [_spectrum(time, y) for time, y in zip(times, left, strict=True)]
        far = _told(times, left, spectra, TONE_MOTION_RATIO * of_motion, TONE_SHARE)
        tone = far or _told(times, left, spectra, NEAR_TONE_MOTION_RATIO * of_motion, NEAR_TONE_SHARE)
        if tone is not None and tone.rms > least:
            found[channel] = tone
    return found


@dataclass(frozen=True)
class RunTone:
    """The tone of one run.

    Attributes
    ----------
    frequency : float
        [Hz]
    cos, sin : float
        Its parts, in the channel's unit.
    """

    frequency: float
    cos: float
    sin: float

    def at(self, time: FloatArray) -> FloatArray:
        """Its values at times [s], shape (n,)."""
        return np.array([self.cos, self.sin]) @ _waves(time, self.frequency)


def tones_of_runs(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], c: int, frequency: float
) -> list[RunTone]:
    """The tone of about a frequency in a channel of each run, however weak; none in a short one.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n, channels)
        One array a run, as in `tones`.
    places : sequence of Coordinates
    c : int
        Column of the channel.
    frequency : float
        [Hz]
    """
    return _nearest_of_runs(*_compared(residuals, places, c), frequency)


def _told(
    times: Sequence[FloatArray], left: Sequence[FloatArray], spectra: Sequence[_Spectrum], lowest: float, share: float
) -> Tone | None:
    """The loudest tone above a frequency [Hz], if it is this part of each half of each run."""
    frequency = _loudest(times, spectra, lowest)
    if frequency is None:
        return None
    of_runs = _nearest_of_runs(times, left, frequency)
    heard = [tone.at(time) for tone, time in zip(of_runs, times, strict=True)]
    if min(_least_share(y, tone) for y, tone in zip(left, heard, strict=True)) <= share:
        return None
    size, beside = (float(rms(of)) for of in (heard, [y - tone for y, tone in zip(left, heard, strict=True)]))
    return Tone(float(np.mean([tone.frequency for tone in of_runs])), size, beside)


def _compared(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], c: int
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Time, and what is left of a channel about its mean, of each run where it is compared."""
    known = [np.isfinite(r[:, c]) for r in residuals]
    times = [one.time[k] for one, k in zip(places, known, strict=True)]
    return times, [r[k, c] - np.mean(r[k, c]) if k.any() else r[k, c] for r, k in zip(residuals, known, strict=True)]


def _loudest(times: Sequence[FloatArray], spectra: Sequence[_Spectrum], lowest: float) -> float | None:
    """Frequency [Hz] above the lowest about which all runs have most; None where their samples know none."""
    line = 1.0 / (PADDING * max(float(np.ptp(time)) for time in times))
    highest = 0.5 / max(float(np.median(np.diff(time))) for time in times)
    if lowest + line >= highest:
        return None
    grid = np.geomspace(lowest, highest, int(np.log(highest / lowest) * highest / line) + 2)
    wander = 2 * int(TONE_WANDER_SHARE * grid.size / np.log(highest / lowest)) + 1
    power = np.zeros(grid.size)
    for lines, of_run in spectra:
        power += maximum_filter1d(np.interp(grid, lines, of_run), wander)
    return float(grid[int(np.argmax(power))])


def _spectrum(time: FloatArray, y: FloatArray) -> _Spectrum:
    """Frequencies [Hz], and the power of a signal there."""
    step = float(np.median(np.diff(time)))
    even = np.interp(np.arange(time[0], time[-1], step), time, y)  # over gaps and stamps that jitter
    padded: Any = next_fast_len(PADDING * even.size, real=True)
    power = np.abs(np.fft.rfft(even * np.hanning(even.size), padded)) ** 2 / even.size
    return np.arange(power.size) / (padded * step), power


def _nearest_of_runs(times: Sequence[FloatArray], left: Sequence[FloatArray], frequency: float) -> list[RunTone]:
    return together(lambda one: _nearest(*one, frequency), list(zip(times, left, strict=True)))


def _nearest(time: FloatArray, y: FloatArray, frequency: float) -> RunTone:
    """The tone of about a frequency that is nearest to a signal."""
    if time.size < FEWEST:
        return RunTone(frequency, 0.0, 0.0)
    line = 1.0 / float(np.ptp(time))
    lines, power = _spectrum(time, y)
    around = np.abs(lines - frequency) <= TONE_WANDER_SHARE * frequency + 0.5 * line
    near = float(lines[around][int(np.argmax(power[around]))]) if around.any() else frequency

    def missed(one: float) -> float:
        waves = _waves(time, one)
        return float(np.sum((y - _parts(waves, y) @ waves) ** 2))

    found: Any = minimize_scalar(missed, bounds=(near - 0.5 * line, near + 0.5 * line), method="bounded")
    frequency = float(found.x)
    cos, sin = _parts(_waves(time, frequency), y)
    return RunTone(frequency, float(cos), float(sin))


def _waves(time: FloatArray, frequency: float) -> FloatArray:
    """Cosine and sine of a frequency, shape (2, n)."""
    phase = 2.0 * np.pi * frequency * time
    return np.stack([np.cos(phase), np.sin(phase)])


def _parts(waves: FloatArray, y: FloatArray) -> FloatArray:
    """What of each of two waves is in a signal; of one that is zero at all samples nothing is."""
    return np.asarray(np.linalg.lstsq(waves @ waves.T, waves @ y)[0], dtype=float)


def _least_share(y: FloatArray, tone: FloatArray) -> float:
    """Part of the mean square of a signal that a tone makes, in that half of it where it makes less."""
    halves = [slice(None, y.size // 2), slice(y.size // 2, None)]
    return min(1.0 - float(np.sum((y[h] - tone[h]) ** 2)) / max(float(np.sum(y[h] ** 2)), 1e-300) for h in halves)
