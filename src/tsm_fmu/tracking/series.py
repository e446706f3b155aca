"""What a value does over runs in their order: nothing, a trend, a jump, or a trend with a jump.

The value of run k is ``y_k`` with the standard error ``s_k`` of its fit. Runs differ by more than that (another motion,
another seat in the rig), so the variance of a run is ``s_k^2 + tau^2``; tau comes from neighbours, ::

    tau^2 = max(0, mean (y_k+1 - y_k)^2 / 2 - mean s_k^2)                                (1)

which a trend or a jump hardly touches (von Neumann 1941). All fits are weighted with it, and their scale is estimated.

Three tests for each value: a line against nothing (Student's t), a jump at any place against nothing, and a jump at any
place beside a line against the line. The latter two take the largest gain over all places; its distribution without a
jump is drawn (Gaussian, the same weights), not permuted: of ten runs, no permutation test finds a jump before the
third, since one order in forty-five has it by chance. The p-values of all values together are adjusted for false
discovery (Benjamini and Hochberg 1995). Among the forms that a test allows the least BIC is taken; a bent curve is one
of them, so that a curved trend is not called a jump.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import false_discovery_control
from scipy.stats import t as student

from ..kernels.arrays import FloatArray

Form = Literal["steady", "trend", "jump", "trend and jump"]

LEAST_RUNS = 5
"""Fewer leave no two runs on either side of a jump and one to spare."""
BESIDE_LINE = 7
"""Fewer runs do not tell a jump beside a trend."""
EITHER_SIDE = 2
"""Runs before and after a jump at least: one run alone is an outlier."""
LEVEL = 0.01
"""False discovery rate: a page that says "wear" has somebody take a machine apart."""
POWER = 0.8
"""What "would be seen" means: so often at `LEVEL`."""
DRAWS = 4999
"""Lives without a jump drawn; the least p-value is one in so many and one."""
LIKELY = 3.84
"""Places of a jump whose -2 log likelihood is less than this above the best are likely (95 % of chi-squared, 1)."""


@dataclass(frozen=True)
class Drift:
    """What a value does over the runs; see the module for how it is found.

    Attributes
    ----------
    form : {'steady', 'trend', 'jump', 'trend and jump'}
    slope, slope_interval : float and (float, float)
        Change per run, with its 95 % interval: of the form found; of a line if steady or a jump.
    jump, jump_interval : float or None, and (float, float) or None
        Size of the jump if there is one.
    jump_between : (int, int) or None
        The last run before the jump and the first after it (from 0, among the runs with a value).
    jump_range : (int, int) or None
        First runs after it that are about as likely, least and largest.
    p_trend, p_jump : float
        Adjusted for false discovery; `p_jump` the less of a jump alone and a jump beside a line.
    begin, end : float
        Value of the form at the first and the last run.
    scatter : float
        Standard deviation of a run about the form.
    unseen_slope, unseen_jump : float
        A drift per run, and a jump in the middle, less than which would be missed one time in five or more often.
    fitted : tuple of float
        Value of the form at each run.
    """

    form: Form
    slope: float
    slope_interval: tuple[float, float]
    jump: float | None
    jump_interval: tuple[float, float] | None
    jump_between: tuple[int, int] | None
    jump_range: tuple[int, int] | None
    p_trend: float
    p_jump: float
    begin: float
    end: float
    scatter: float
    unseen_slope: float
    unseen_jump: float
    fitted: tuple[float, ...]


def drifts(values: Sequence[FloatArray], stderr: Sequence[FloatArray], seed: int = 0) -> list[Drift]:
    """What each of several values does over the runs.

    Parameters
    ----------
    values : sequence of ndarray, shape (n,)
        One for each value, in the order of the runs; n may differ, `LEAST_RUNS` or more.
    stderr : sequence of ndarray, shape (n,)
        Standard errors; zeros if there are none.
    seed : int
        Of the lives that are drawn.
    """
    tested = [_Tested.of(y, s, seed) for y, s in zip(values, stderr, strict=True)]
    if not tested:
        return []
    adjusted = np.reshape(false_discovery_control(np.ravel([t.p for t in tested])), (-1, 3))
    return [t.drift(p, LEVEL / adjusted.size) for t, p in zip(tested, adjusted, strict=True)]


@dataclass(frozen=True)
class _Tested:
    """One value with its weights and the p-values of line, jump, and jump beside a line."""

    y: FloatArray
    weights: FloatArray
    p: tuple[float, float, float]
    places: tuple[int, int]

    @classmethod
    def of(cls, y: FloatArray, stderr: FloatArray, seed: int) -> _Tested:
        y, n = np.asarray(y, dtype=float), len(y)
        extra = max(0.0, float(np.mean(np.diff(y) ** 2)) / 2.0 - float(np.mean(stderr**2)))
        variance = stderr**2 + extra
        if np.ptp(y) == 0.0 or not variance.max() > 0.0:
            return cls(y, np.ones(n), (1.0, 1.0, 1.0), (n // 2, n // 2))
        # a run that claims to be known far better than its neighbours agree must not decide alone
        weights = 1.0 / np.maximum(variance, 1e-6 * variance.max())
        weights /= weights.mean()
        draws = np.random.default_rng(seed).standard_normal((DRAWS, n))
        line = _fit(y, _design(n, line=True), weights)
        p_jump, place = _scan(y, _design(n), weights, draws)
        p_beside, beside = _scan(y, _design(n, line=True), weights, draws) if n >= BESIDE_LINE else (1.0, place)
        return cls(y, weights, (float(line.pvalues[1]), p_jump, p_beside), (place, beside))

    def drift(self, p: FloatArray, level: float) -> Drift:
        y, n = self.y, self.y.size
        (place, beside), line = self.places, _fit(y, _design(n, line=True), self.weights)
        shapes: dict[Form, list[tuple[FloatArray, int]]] = {"steady": [(_design(n), 1)]}
        moves = p < LEVEL
        if moves.any():
            shapes = {}
            if moves[0] or moves[2]:
                shapes["trend"] = [(_design(n, line=True), 2)]
                if n > 4:
                    shapes["trend"].append((_design(n, line=True, bent=True), 3))
            if moves[1]:
                shapes["jump"] = [(_design(n, at=place), 3)]
            if moves[2]:
                shapes["trend and jump"] = [(_design(n, line=True, at=beside), 4)]
        fits: list[tuple[Form, Any, int]] = [
            (form, _fit(y, x, self.weights), count) for form, several in shapes.items() for x, count in several
        ]
        form, best, _ = min(fits, key=lambda f: n * math.log(max(f[1].ssr, 1e-300)) + f[2] * math.log(n))
        sloped = best if form == "trend and jump" else line
        jumps = form in ("jump", "trend and jump")
        at = beside if form == "trend and jump" else place
        interval = np.asarray(best.conf_int())
        slope = np.asarray(sloped.conf_int())[1]
        fitted = np.asarray(best.fittedvalues)
        # what an estimate must exceed, and what it falls short of by chance
        reach = student.ppf(1.0 - level / 2.0, max(1, n - 2)) + student.ppf(POWER, max(1, n - 2))
        middle = _fit(y - fitted, _design(n, at=n // 2), self.weights)
        slope_error = float(_fit(y - fitted, _design(n, line=True), self.weights).bse[1])
        return Drift(
            form=form,
            slope=float(sloped.params[1]),
            slope_interval=(float(slope[0]), float(slope[1])),
            jump=float(best.params[-1]) if jumps else None,
            jump_interval=(float(interval[-1, 0]), float(interval[-1, 1])) if jumps else None,
            jump_between=(at - 1, at) if jumps else None,
            jump_range=_likely(y, self.weights, form == "trend and jump") if jumps else None,
            p_trend=float(p[0]),
            p_jump=float(min(p[1:])),
            begin=float(fitted[0]),
            end=float(fitted[-1]),
            scatter=math.sqrt(float(np.sum((y - fitted) ** 2)) / max(1.0, float(best.df_resid))),
            unseen_slope=float(reach * slope_error),
            unseen_jump=float(reach * middle.bse[1]),
            fitted=tuple(fitted.tolist()),
        )


def _design(n: int, *, line: bool = False, bent: bool = False, at: int = 0) -> FloatArray:
    """Columns: one, the number of the run, its square about the middle, the step at a run."""
    k = np.arange(float(n))
    columns = [np.ones(n)]
    columns += [k] if line else []
    columns += [(k - k.mean()) ** 2] if bent else []
    columns += [(k >= at).astype(float)] if at else []
    return np.column_stack(columns)


def _fit(y: FloatArray, x: FloatArray, weights: Any) -> Any:
    from statsmodels.regression.linear_model import WLS

    with np.errstate(all="ignore"):  # a perfect fit has no scatter: its t is infinite
        return WLS(y, x, weights=weights).fit()


def _scan(y: FloatArray, base: FloatArray, weights: FloatArray, draws: FloatArray) -> tuple[float, int]:
    """p-value of the largest gain that a jump at any place brings to a design, and that place."""
    n, root = y.size, np.sqrt(weights)
    q, _ = np.linalg.qr(base * root[:, None])
    places = range(EITHER_SIDE, n - EITHER_SIDE + 1)
    steps = np.column_stack([root * (np.arange(n) >= at) for at in places])
    steps -= q @ (q.T @ steps)
    norms = np.linalg.norm(steps, axis=0)
    steps = steps[:, norms > 1e-9] / norms[norms > 1e-9]
    kept = [at for at, norm in zip(places, norms, strict=True) if norm > 1e-9]

    def gains(samples: FloatArray) -> FloatArray:
        """Gain of each place as a part of what the design leaves, shape (samples, places)."""
        left = samples - (samples @ q) @ q.T
        return (left @ steps) ** 2 / np.sum(left**2, axis=1, keepdims=True)

    found = gains((root * y)[None, :])[0]
    by_chance = gains(draws).max(axis=1)
    p = (1 + int(np.sum(by_chance >= found.max()))) / (1 + len(by_chance))
    return p, kept[int(np.argmax(found))]


def _likely(y: FloatArray, weights: FloatArray, beside_line: bool) -> tuple[int, int]:
    """Least and largest place of a jump that the data do not speak against."""
    n = y.size
    places = list(range(EITHER_SIDE, n - EITHER_SIDE + 1))
    left = np.array([_fit(y, _design(n, line=beside_line, at=at), weights).ssr for at in places])
    worse = n * np.log(np.maximum(left, 1e-300) / max(float(left.min()), 1e-300))
    likely = [at for at, by in zip(places, worse, strict=True) if by < LIKELY]
    return min(likely), max(likely)
