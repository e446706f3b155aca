"""How well the data determine the parameters, with residuals that are neither white nor independent.

The covariance is the sandwich H^-1 M H^-1: H = J'J, and M the long-run covariance of the scores J'r, summed over
lags with Bartlett weights (Newey and West 1987) within each run. The bandwidth follows the autocorrelation time of
the residual, found with Sokal's window. Parameters on a bound take no part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import BoolArray, FloatArray
from .problem import Problem
from .sensitivity import residual_jacobian, row_edges, sensitivity_scales

BANDWIDTH = 5.0
"""Lags summed, in autocorrelation times: Bartlett weights then miss about a tenth of the variance."""
SINGULAR = 1e-13
"""Eigenvalues of the normalised information matrix below this are rounding: the direction is not determined."""


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors and what goes with them.

    Attributes
    ----------
    stderr : dict of str to float
        Of each shared free parameter, by field; NaN where the log does not determine it.
    per_run : tuple of dict of str to float
        The same for the per-run parameters of each run.
    correlation : ndarray
        Between the shared parameters of `names`.
    names : tuple of str
        Shared fields that are free and not on a bound.
    condition_number : float
        Of the normalised sensitivities of these, the per-run parameters eliminated.
    effective_samples : float
        Independent samples that the residuals are worth.
    correlation_time : float
        Of the residuals [rows of the residual], largest over runs and channels.
    calibration : dict of str to float
        Variance of each of `names` over its element of H^-1: what the residuals' variance would be if they were
        white; NaN where the log does not determine the parameter.
    """

    stderr: dict[str, float]
    per_run: tuple[dict[str, float], ...]
    correlation: FloatArray
    names: tuple[str, ...]
    condition_number: float
    effective_samples: float
    correlation_time: float
    calibration: dict[str, float]


def uncertainty(problem: Problem, table: FloatArray, on_bound: frozenset[str]) -> Uncertainty:
    """Covariance at the solution ``table``; ``on_bound`` names the fields that are held by a bound."""
    shared = [f for f in problem.shared if f not in on_bound]
    per_run = [f for f in problem.per_run if f not in on_bound]
    count, each = len(shared), len(per_run)
    size = count + each * len(problem.runs)
    information, meat = np.zeros((size, size)), np.zeros((size, size))
    effective, longest = 0.0, 1.0
    scales = sensitivity_scales(problem.starting_at(table))
    residuals = problem.residuals(list(enumerate(table)))
    whole = residual_jacobian(problem, table, residuals, [*shared, *per_run], scales)
    edges = row_edges(residuals)
    for k, residual in enumerate(residuals):
        at = np.r_[0:count, count + k * each : count + (k + 1) * each]
        columns = [*range(count), *(count + i * len(problem.runs) + k for i in range(each))]
        jacobian = np.ascontiguousarray(whole[edges[k] : edges[k + 1], columns])
        channels = len(problem.channels)
        by_time = residual.reshape(channels, -1)
        times = [autocorrelation_time(row) for row in by_time]
        effective += sum(by_time.shape[1] / time for time in times)
        longest = max(longest, *times)
        scores = (jacobian * residual[:, None]).reshape(channels, -1, count + each).sum(axis=0)
        lags = min(math.ceil(BANDWIDTH * max(times)), max(1, scores.shape[0] // 10))
        information[np.ix_(at, at)] += jacobian.T @ jacobian
        meat[np.ix_(at, at)] += long_run_covariance(scores, lags)
    norm = np.sqrt(np.diag(information))
    norm[norm == 0.0] = 1.0
    covariance, inverse, lost = _sandwich(information / np.outer(norm, norm), meat / np.outer(norm, norm))
    errors = np.where(lost, np.nan, np.sqrt(np.maximum(np.diag(covariance), 0.0)) / norm)
    white, ratio = np.diag(inverse), np.full(size, np.nan)
    np.divide(np.diag(covariance), white, out=ratio, where=white > 0.0)  # else nothing determines the parameter
    deviation = np.sqrt(np.maximum(np.diag(covariance)[:count], 1e-300))
    return Uncertainty(
        stderr=dict(zip(shared, errors[:count].tolist(), strict=True)),
        per_run=tuple(
            dict(zip(per_run, errors[count + k * each : count + (k + 1) * each].tolist(), strict=True))
            for k in range(len(problem.runs))
        ),
        correlation=covariance[:count, :count] / np.outer(deviation, deviation),
        names=tuple(shared),
        condition_number=_condition_number(information, count),
        effective_samples=effective,
        correlation_time=longest,
        calibration=dict(zip(shared, ratio[:count].tolist(), strict=True)),
    )


def autocorrelation_time(series: FloatArray) -> float:
    """Integrated autocorrelation time 1 + 2 sum rho [samples], cut at Sokal's self-consistent window."""
    centred = series - series.mean()
    power = float(centred @ centred)
    rounding = 1e-14 * float(np.abs(series).max(initial=0.0))  # what is left of a constant
    if power <= series.size * rounding**2 or series.size < 4:
        return 1.0
    length = 1 << (2 * series.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centred, length)) ** 2
    rho = np.fft.irfft(spectrum, length)[: series.size] / power
    times = 2.0 * np.cumsum(rho) - 1.0
    window = np.arange(times.size) >= 5.0 * times
    return max(1.0, float(times[int(np.argmax(window))] if window.any() else times.max()))


def long_run_covariance(scores: FloatArray, lags: int) -> FloatArray:
    """Sum of the autocovariances of ``scores`` (rows in time) with Bartlett weights 1 - j/lags.

    Written as moving sums over windows of ``lags`` rows, which is the same and costs no loop over the lags.
    """
    padded = np.vstack([np.zeros((lags, scores.shape[1])), scores, np.zeros((lags, scores.shape[1]))])
    total = np.cumsum(padded, axis=0)
    windows = total[lags:] - total[:-lags]
    return windows.T @ windows / lags


def _sandwich(information: FloatArray, meat: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Covariance, inverse of the information, and which parameters take part in a direction that is not determined."""
    values, vectors = np.linalg.eigh(information)
    bad = values <= SINGULAR * max(1.0, values[-1] if values.size else 1.0)
    inverse = (vectors[:, ~bad] / values[~bad]) @ vectors[:, ~bad].T
    return inverse @ meat @ inverse, inverse, np.asarray((np.abs(vectors[:, bad]) > 1e-4).any(axis=1))


def _condition_number(information: FloatArray, count: int) -> float:
    if count == 0:
        return 1.0
    cross, rest = information[:count, count:], information[count:, count:]
    reduced = information[:count, :count] - cross @ np.linalg.pinv(rest, hermitian=True) @ cross.T
    norm = np.sqrt(np.maximum(np.diag(information)[:count], 0.0))
    if not (norm > 0.0).all():
        return math.inf
    values = np.linalg.eigvalsh(reduced / np.outer(norm, norm))
    return math.sqrt(values[-1] / values[0]) if values[0] > 0.0 else math.inf
