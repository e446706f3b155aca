"""What is left after a fit: is it white, and how much of it does the measurement itself not repeat?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import FloatArray
from .problem import FitRun
from .uncertainty import autocorrelation_time

TESTED_ROWS = 4000
REPEATS = 0.05
"""A motion repeats when it differs from itself one period later by less than this part of its RMS."""


@dataclass(frozen=True)
class ResidualTests:
    """Tests of one channel's residual over the runs.

    Attributes
    ----------
    correlation_time_s : float
        Integrated autocorrelation time [s], largest of the runs.
    durbin_watson : float
        2 for white residuals, towards 0 for slow ones.
    ljung_box_p : float
        Probability of such autocorrelation in white residuals, smallest of the runs, Bonferroni-corrected.
    jarque_bera_p : float
        Probability of such skewness and kurtosis in normal residuals; information only: friction residuals are not.
    """

    correlation_time_s: float
    durbin_watson: float
    ljung_box_p: float
    jarque_bera_p: float


def residual_tests(times: list[FloatArray], errors: list[FloatArray]) -> ResidualTests:
    """Whiteness and normality of the errors of one channel."""
    from statsmodels.stats.diagnostic import acorr_ljungbox  # slow to import: only those who ask for tests pay
    from statsmodels.stats.stattools import durbin_watson, jarque_bera

    longest, whiteness, normality, watson = 0.0, 1.0, 1.0, []
    for time, error in zip(times, errors, strict=True):
        tau = autocorrelation_time(error)
        longest = max(longest, tau * float(np.median(np.diff(time))))
        some = error[: (error.size // TESTED_ROWS or 1) * TESTED_ROWS : error.size // TESTED_ROWS or 1]
        if some.size < 20 or np.ptp(some) == 0.0:
            continue
        watson.append(float(durbin_watson(some)))
        whiteness = min(whiteness, float(acorr_ljungbox(some, lags=[10])["lb_pvalue"].iloc[0]) * len(errors))
        independent = error[:: max(1, math.ceil(tau))]  # a test of normality takes independent samples
        if independent.size >= 8:
            normality = min(normality, float(jarque_bera(independent)[1]) * len(errors))
    return ResidualTests(
        longest, float(np.mean(watson)) if watson else math.nan, min(1.0, whiteness), min(1.0, normality)
    )


def noise_floor(run: FitRun) -> FloatArray | None:
    """RMS by which each channel does not repeat from period to period; None where the motion has no period.

    A model driven by the same inputs gives the same outputs each period, so no such model can fit better.
    """
    period = period_of(run)
    if period is None:
        return None
    count = run.time.size // period
    folded = run.targets[: count * period].reshape(count, period, -1)
    return np.sqrt(np.mean(folded.var(axis=0, ddof=1), axis=0))


def mean_square_beside(columns: FloatArray, y: FloatArray) -> float:
    """Mean square of a signal, shape (n,), that columns, shape (n, k), do not make, each as large as fits best."""
    return float(np.mean((y - columns @ np.linalg.lstsq(columns, y)[0]) ** 2))


def rms(residuals: Sequence[FloatArray]) -> FloatArray:
    """Root mean square over the samples of all runs, by channel; infinite where they are too large to be squared."""
    with np.errstate(over="ignore"):
        return np.sqrt(np.mean(np.concatenate(list(residuals)) ** 2, axis=0))


def white_noise(samples: FloatArray) -> FloatArray:
    """RMS of what changes from sample to sample, by column: a lower bound of the noise.

    From third differences, which a smooth signal hardly has; their median, against jumps.

    Parameters
    ----------
    samples : ndarray, shape (n,) or (n, channels)
    """
    return np.median(np.abs(np.diff(samples, n=3, axis=0)), axis=0) / 0.6745 / np.sqrt(20.0)


def period_of(run: FitRun) -> int | None:
    """Samples after which all inputs repeat, at least twice in the run."""
    inputs = run.inputs - run.inputs.mean(axis=0)
    level = np.sqrt(np.mean(inputs**2, axis=0))
    inputs = inputs[:, level > 0.0] / level[level > 0.0]
    if not inputs.size or not np.allclose(np.diff(run.time), np.median(np.diff(run.time)), rtol=1e-3):
        return None
    n = inputs.shape[0]
    length = 1 << (2 * n - 1).bit_length()
    rho = np.fft.irfft(np.abs(np.fft.rfft(inputs[:, 0], length)) ** 2, length)[:n] / np.arange(n, 0, -1)
    below = np.flatnonzero(rho < 0.0)
    if not below.size or below[0] >= n // 2:
        return None
    peaks = rho[below[0] : n // 2]
    first = int(below[0] + np.argmax(peaks > 0.9 * peaks.max()))  # on the flank of the first peak, not of a multiple
    candidates = range(first, min(n // 2, first + max(2, first // 4)) + 1)
    differs = [np.sqrt(np.mean((inputs[p:] - inputs[:-p]) ** 2, axis=0)) for p in candidates]
    best = int(np.argmin([d.max() for d in differs]))
    return candidates[best] if (differs[best] < REPEATS).all() else None
