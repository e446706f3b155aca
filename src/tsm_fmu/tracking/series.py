"""What a value does over runs in their order: nothing, a trend, jumps, or a trend with jumps.

The value of run k is ``y_k`` with the standard error ``s_k`` of its fit. Runs differ by more than that (another motion,
another seat in the rig), so the variance of a run is ``s_k^2 + tau^2``; tau comes from neighbours, ::

    tau^2 = max(0, mean (y_k+1 - y_k)^2 / 2 - mean s_k^2)                                (1)

which a trend or a jump hardly touches (von Neumann 1941). All fits are weighted with it, and their scale is estimated.

Three tests for each value: a line against nothing (Student's t), a jump at any place against nothing, and a jump at any
place beside a line against the line. The latter two take the largest gain over all places of one jump, and over all
pairs of places: a jump and its return hide each other from a search for one. The distribution of these without a jump
is drawn (Gaussian, the same weights), not permuted: of ten runs, no permutation test finds a jump before the third,
since one order in forty-five has it by chance. A saw of many teeth hides its slope and its jumps from all of these; its
jumps stand out from the changes from run to run, whose median is the slope: three or more that do are tested by how
many do so in the lives drawn. The p-values of all values together are adjusted for false discovery (Benjamini and
Hochberg 1995). To jumps found further ones are added as long as the same test shows them beside those
before, and each is moved to its best place given the others.
Among the forms that a test allows the least BIC is taken; a bent curve is one of them, so that a curved trend is not
called a jump.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import false_discovery_control
from scipy.stats import t as student

from ..kernels.arrays import BoolArray, FloatArray

Form = Literal["steady", "trend", "jump", "trend and jump"]
Places = tuple[int, ...]
"""First runs after each jump, from 0."""

LEAST_RUNS = 5
"""Fewer leave no two runs on either side of a jump and one to spare."""
BESIDE_LINE = 7
"""Fewer runs do not tell a jump beside a trend."""
EITHER_SIDE = 2
"""Runs before and after a jump at least: one run alone is an outlier."""
BETWEEN = 3
"""Runs between two jumps at least: two neighbours that stand out are as easily two outliers."""
LEVEL = 0.01
"""False discovery rate: a page that says "wear" has somebody take a machine apart."""
POWER = 0.8
"""What "would be seen" means: so often at `LEVEL`."""
DRAWS = 9999
"""Lives without a jump drawn; the least p-value is two in so many and one."""
PAIRED_PLACES = 50
"""Places at most of which pairs are searched; of longer lives every so-many-th."""
TOOTH = 6.0
"""Standard deviations, by their median, by which a change from run to run stands out from the others."""
TEETH = 3
"""So many at least: one or two jumps are searched for at all places."""
LIKELY = 3.84
"""Places of a jump whose -2 log likelihood is less than this above the best are likely (95 % of chi-squared, 1)."""


@dataclass(frozen=True)
class Jump:
    """A change from one run to the next.

    Attributes
    ----------
    size : float
    interval : (float, float)
        95 %, at this place.
    between : (int, int)
        The last run before it and the first after it (from 0, among the runs with a value).
    likely : (int, int)
        First runs after it that are about as likely, least and largest, the other jumps where they are.
    """

    size: float
    interval: tuple[float, float]
    between: tuple[int, int]
    likely: tuple[int, int]


@dataclass(frozen=True)
class Drift:
    """What a value does over the runs; see the module for how it is found.

    Attributes
    ----------
    form : {'steady', 'trend', 'jump', 'trend and jump'}
    slope, slope_interval : float and (float, float)
        Change per run, with its 95 % interval: of the form found; of a line if steady or a jump.
    jumps : tuple of Jump
        In the order of the runs; none if steady or a trend.
    p_trend, p_jump : float
        Adjusted for false discovery; `p_jump` the less of jumps alone and jumps beside a line.
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
    jumps: tuple[Jump, ...]
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
    """One value with its weights, the p-values of line, jumps, and jumps beside a line, and where these are."""

    y: FloatArray
    weights: FloatArray
    p: tuple[float, float, float]
    jumps: Places
    beside: Places

    @classmethod
    def of(cls, y: FloatArray, stderr: FloatArray, seed: int) -> _Tested:
        y, n = np.asarray(y, dtype=float), len(y)
        extra = max(0.0, float(np.mean(np.diff(y) ** 2)) / 2.0 - float(np.mean(stderr**2)))
        variance = stderr**2 + extra
        if np.ptp(y) == 0.0 or not variance.max() > 0.0:
            return cls(y, np.ones(n), (1.0, 1.0, 1.0), (), ())
        # a run that claims to be known far better than its neighbours agree must not decide alone
        weights = 1.0 / np.maximum(variance, 1e-6 * variance.max())
        weights /= weights.mean()
        draws = np.random.default_rng(seed).standard_normal((DRAWS, n))
        line = _fit(y, _design(n, line=True), weights)
        p_jump, jumps = _found(y, weights, draws, line=False)
        p_beside, beside = _found(y, weights, draws, line=True) if n >= BESIDE_LINE else (1.0, ())
        return cls(y, weights, (float(line.pvalues[1]), p_jump, p_beside), jumps, beside)

    def drift(self, p: FloatArray, level: float) -> Drift:
        y, n = self.y, self.y.size
        line = _fit(y, _design(n, line=True), self.weights)
        forms: list[tuple[Form, FloatArray, Places]] = [("steady", _design(n), ())]
        moves = p < LEVEL
        if moves.any():
            forms = []
            if moves[0] or moves[2]:
                forms.append(("trend", _design(n, line=True), ()))
                if n > 4:
                    forms.append(("trend", _design(n, line=True, bent=True), ()))
            if moves[1]:
                forms.append(("jump", _design(n, at=self.jumps), self.jumps))
            if moves[2]:
                forms.append(("trend and jump", _design(n, line=True, at=self.beside), self.beside))
        fits: list[tuple[Form, Any, int, Places]] = [
            (form, _fit(y, x, self.weights), x.shape[1] + len(at), at) for form, x, at in forms
        ]
        form, best, _, at = min(fits, key=lambda f: n * math.log(max(f[1].ssr, 1e-300)) + f[2] * math.log(n))
        sloped = best if form == "trend and jump" else line
        slope = np.asarray(sloped.conf_int())[1]
        fitted = np.asarray(best.fittedvalues)
        # what an estimate must exceed, and what it falls short of by chance
        reach = student.ppf(1.0 - level / 2.0, max(1, n - 2)) + student.ppf(POWER, max(1, n - 2))
        middle = _fit(y - fitted, _design(n, at=(n // 2,)), self.weights)
        slope_error = float(_fit(y - fitted, _design(n, line=True), self.weights).bse[1])
        return Drift(
            form=form,
            slope=float(sloped.params[1]),
            slope_interval=(float(slope[0]), float(slope[1])),
            jumps=self._jumps(best, at, line=form == "trend and jump"),
            p_trend=float(p[0]),
            p_jump=float(min(p[1:])),
            begin=float(fitted[0]),
            end=float(fitted[-1]),
            scatter=math.sqrt(float(np.sum((y - fitted) ** 2)) / max(1.0, float(best.df_resid))),
            unseen_slope=float(reach * slope_error),
            unseen_jump=float(reach * middle.bse[1]),
            fitted=tuple(fitted.tolist()),
        )

    def _jumps(self, best: Any, at: Places, *, line: bool) -> tuple[Jump, ...]:
        intervals, found = np.asarray(best.conf_int()), []
        for number, place in enumerate(at):
            column = number - len(at)  # steps are the last columns
            size, (low, high) = float(best.params[column]), intervals[column].tolist()
            left = _left_by_place(self.y, self.weights, at, number, line)
            worse = {k: self.y.size * math.log(max(v, 1e-300) / max(left[place], 1e-300)) for k, v in left.items()}
            likely = [k for k, by in worse.items() if by < LIKELY]
            found.append(Jump(size, (low, high), (place - 1, place), (min(likely), max(likely))))
        return tuple(found)


def _design(n: int, *, line: bool = False, bent: bool = False, at: Places = ()) -> FloatArray:
    """Columns: one, the number of the run, its square about the middle, a step at each place."""
    k = np.arange(float(n))
    columns = [np.ones(n)]
    columns += [k] if line else []
    columns += [(k - k.mean()) ** 2] if bent else []
    columns += [(k >= place).astype(float) for place in at]
    return np.column_stack(columns)


def _fit(y: FloatArray, x: FloatArray, weights: Any) -> Any:
    from statsmodels.regression.linear_model import WLS

    with np.errstate(all="ignore"):  # a perfect fit has no scatter: its t is infinite
        return WLS(y, x, weights=weights).fit()


def _found(y: FloatArray, weights: FloatArray, draws: FloatArray, *, line: bool) -> tuple[float, Places]:
    """p-value of the first jump, or of two, and the places of it and of all that the same test adds."""
    n = y.size
    p_first, at = _teeth(y, weights, draws) if line else (1.0, ())
    if at:
        at = _moved(y, weights, at, line)
    while n > 3 + line + EITHER_SIDE * len(at):  # runs enough for one jump more
        p, added = _scan(y, _design(n, line=line, at=at), weights, draws, at)
        if not at:
            p_first = p
        elif p >= LEVEL:
            break
        if not added:
            break
        at = _moved(y, weights, tuple(sorted((*at, *added))), line)
    return p_first, at


def _teeth(y: FloatArray, weights: FloatArray, draws: FloatArray) -> tuple[float, Places]:
    """p-value and places of the jumps of a saw; none where no three stand out from the changes from run to run."""

    def standing_out(samples: FloatArray) -> BoolArray:
        change = np.diff(samples, axis=1)
        off = np.abs(change - np.median(change, axis=1, keepdims=True))
        return off > TOOTH * 1.4826 * np.median(off, axis=1, keepdims=True)

    at: Places = tuple((np.flatnonzero(standing_out(y[None, :])[0]) + 1).tolist())
    free = _free_places(y.size, ())
    if len(at) < TEETH or not set(at) <= set(free) or min(np.diff(at)) < BETWEEN:
        return 1.0, ()
    by_chance = standing_out(draws / np.sqrt(weights)).sum(axis=1)
    p = (1 + int(np.sum(by_chance >= len(at)))) / (1 + len(draws))
    return (p, at) if p < LEVEL else (1.0, ())


def _scan(y: FloatArray, base: FloatArray, weights: FloatArray, draws: FloatArray, at: Places) -> tuple[float, Places]:
    """p-value of the largest gain that one or two jumps more bring to a design, and their places."""
    root, k = np.sqrt(weights), np.arange(y.size)
    q, _ = np.linalg.qr(base * root[:, None])
    places = _free_places(y.size, at)
    steps = np.column_stack([root * (k >= place) for place in places]) if places else np.empty((y.size, 0))
    steps -= q @ (q.T @ steps)
    norms = np.linalg.norm(steps, axis=0)
    places = [place for place, norm in zip(places, norms, strict=True) if norm > 1e-9]
    steps = steps[:, norms > 1e-9] / norms[norms > 1e-9]

    def along(samples: FloatArray) -> FloatArray:
        """What the design leaves of samples, of length one, along each step."""
        rest = samples - (samples @ q) @ q.T
        return rest @ steps / np.maximum(np.linalg.norm(rest, axis=1, keepdims=True), 1e-300)

    here, by_chance = along((root * y)[None, :]), along(draws)
    tried = [gains for two in (False, True) if (gains := _gains(here, by_chance, steps, places, two=two))]
    p, best = min(tried, key=lambda one: one[0], default=(1.0, ()))
    return min(1.0, len(tried) * p), best


def _gains(
    here: FloatArray, by_chance: FloatArray, steps: FloatArray, places: Sequence[int], *, two: bool
) -> tuple[float, Places] | None:
    """p-value of the largest gain of one jump or of two, and where; None without a place."""
    coarse = range(0, len(places), -(-len(places) // PAIRED_PLACES) or 1)
    largest, most, best = np.zeros(len(by_chance)), -1.0, ()
    for i in coarse if two else range(len(places)):
        second = [j for j in coarse if places[j] - places[i] >= BETWEEN] if two else [i]
        together = steps[:, second].T @ steps[:, i] if two else np.zeros(1)
        second = [j for j, r in zip(second, together, strict=True) if abs(r) < 1.0 - 1e-9]
        if not second:
            continue
        r = together[np.abs(together) < 1.0 - 1e-9]
        for along in (here, by_chance):
            a, b = along[:, [i]], along[:, second]
            gain = (a**2 + b**2 - 2.0 * r * a * b) / (1.0 - r**2) if two else b**2
            if along is by_chance:
                np.maximum(largest, gain.max(axis=1), out=largest)
            elif gain.max() > most:
                most, best = float(gain.max()), (places[i], places[second[int(np.argmax(gain))]])
    if not best:
        return None
    return (1 + int(np.sum(largest >= most))) / (1 + len(by_chance)), best if two else best[:1]


def _free_places(n: int, at: Places) -> list[int]:
    """Places with enough runs on either side, up to the next jump or the end."""
    inside = range(EITHER_SIDE, n - EITHER_SIDE + 1)
    return [k for k in inside if all(abs(k - place) >= BETWEEN for place in at)]


def _moved(y: FloatArray, weights: FloatArray, at: Places, line: bool) -> Places:
    """Jumps moved, one after the other, to where they leave least, until none moves."""
    for _ in range(len(y)):
        before = at
        for number in range(len(at)):
            left = _left_by_place(y, weights, at, number, line)
            best = min(left, key=lambda place: left[place])
            if left[best] < left[at[number]]:
                at = tuple(sorted((*at[:number], best, *at[number + 1 :])))
        if at == before:
            break
    return at


def _left_by_place(y: FloatArray, weights: FloatArray, at: Places, number: int, line: bool) -> dict[int, float]:
    """Sum of squares left for each place of one of the jumps, the others where they are."""
    others = (*at[:number], *at[number + 1 :])
    places = sorted({at[number], *_free_places(y.size, others)})
    root = np.sqrt(weights)
    left = {}
    for place in places:
        q, _ = np.linalg.qr(_design(y.size, line=line, at=(*others, place)) * root[:, None])
        rest = root * y - q @ (q.T @ (root * y))
        left[place] = float(rest @ rest)
    return left
