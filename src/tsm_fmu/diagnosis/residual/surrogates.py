"""What a residual would look like by chance: noise of its own colour, but without the lines that a motion draws.

Phase-randomised surrogates (Theiler et al., Physica D 58, 1992) keep the spectrum. Under a periodic motion a missing
law is nothing but spectral lines, which they keep as well, so that they can never be told from it. Here the spectrum
is first reduced to its continuous background, the running median of the periodogram (Mann and Lees, Climatic Change
33, 1996): noise without lines passes unchanged, a median follows any slope, and lines drop out. A motion of few
periods crowds the lines so that some of them stay: the test then misses laws, it does not invent them.
"""

from __future__ import annotations

import numpy as np
from scipy.fft import dct
from scipy.ndimage import median_filter
from scipy.stats import chi2, gamma

from ...kernels.arrays import FloatArray

HALF_WIDTH = 12
"""Bins of the periodogram on each side that the running median looks at."""


SMALLEST = 1e-6
"""Probabilities are not extrapolated below."""


def surrogates(series: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Gaussian series with the continuous part of a series' spectrum, unrelated to any motion.

    Parameters
    ----------
    series : ndarray, shape (n,)
    count : int
    rng : numpy Generator

    Returns
    -------
    ndarray, shape (n, count)
        Each with the mean of the series.
    """
    mean, n = float(series.mean()), series.size
    power = np.append(background(np.asarray(dct(series - mean, norm="ortho"), float) ** 2), 0.0)
    gaussian = rng.normal(size=(n + 1, count)) + 1j * rng.normal(size=(n + 1, count))
    whole = np.fft.irfft(gaussian * np.sqrt(n * power)[:, None], 2 * n, axis=0)[:n]  # a circle would join the ends
    return whole - whole.mean(axis=0) + mean


def background(power: FloatArray) -> FloatArray:
    """Continuous part of a periodogram (of a cosine transform), its lines removed; its low end by narrower windows."""
    found = median_filter(power, 2 * HALF_WIDTH + 1, mode="nearest")
    for k in range(1, min(HALF_WIDTH + 1, power.size // 2)):
        found[k] = np.median(power[1 : 2 * k])
    found /= chi2.median(1)  # of its mean
    found[1:3] = np.mean(power[1:3])  # too few for a median
    found[0] = found[1]
    return found


def tail(value: float, by_chance: FloatArray) -> float:
    """Probability of ``value`` or more in the population that ``by_chance`` was drawn from.

    The tail comes from a gamma distribution with the mean, variance and skewness of the surrogates (Winkler et al.,
    NeuroImage 141, 2016), so that a few hundred of them give small probabilities as well.

    Parameters
    ----------
    value : float
        Larger where there is more of a law.
    by_chance : ndarray, shape (count,)
        Of surrogates.
    """
    counted = (1.0 + np.count_nonzero(by_chance >= value)) / (1.0 + by_chance.size)
    spread = float(by_chance.std())
    if counted > 0.1 or spread <= 0.0:
        return float(counted)
    skew = float(np.clip(np.mean(((by_chance - by_chance.mean()) / spread) ** 3), 0.05, 4.0))
    shape = 4.0 / skew**2
    return max(SMALLEST, float(gamma.sf((value - by_chance.mean()) / spread * np.sqrt(shape) + shape, shape)))
