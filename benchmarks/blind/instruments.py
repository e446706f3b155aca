"""What instruments make of the signals: coloured noise, encoder steps, converter levels, clock jitter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from .motions import FloatArray


@dataclass(frozen=True)
class Instruments:
    """Imperfections of a log.

    Attributes
    ----------
    noise : float
        RMS noise of a force or torque channel over the channel's RMS; of a motion channel a fifth of it.
    colour : float
        Correlation of the noise from sample to sample.
    encoder : float
        Step of position readings over the stroke.
    jitter : float
        RMS of the sampling time over the sample period; the log has the true times if ``stamped``, else even ones.
    stamped : bool
    """

    noise: float = 0.006
    colour: float = 0.5
    encoder: float = 2e-5
    jitter: float = 0.0
    stamped: bool = True


def coloured(n: int, colour: float, rng: np.random.Generator) -> FloatArray:
    """First-order noise of unit RMS."""
    white = rng.normal(0.0, 1.0, n + 200)
    return np.asarray(lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], white))[200:]


def sampling(
    n: int, every: int, step: float, how: Instruments, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """True sampling times and the times in the log, from 0 on."""
    even = np.arange(0, n, every, dtype=np.float64) * step
    shift = how.jitter * every * step * np.clip(rng.normal(0.0, 1.0, even.size), -2.5, 2.5)
    shift[0] = 0.0
    true = np.asarray(np.clip(even + shift, 0.0, (n - 1) * step), np.float64)
    return true, true if how.stamped else even


def stepped(y: FloatArray, step: float, truncate: bool = False) -> FloatArray:
    """Reading of a converter with the given step; no step, no change."""
    if step <= 0.0:
        return y
    return step * (np.floor(y / step) + 0.5) if truncate else step * np.round(y / step)
