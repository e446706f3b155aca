"""Candidates on top of a hypothesis: which are refitted, with what they gain, and refits that let rivals compare."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...kernels.arrays import FloatArray
from ...models.contract import InputError
from ...regression.problem import FitRun
from ...regression.thinning import thinned
from ...regression.threads import together
from ..criteria import (
    CONTENDING_RATIO,
    EARLY_RATIO,
    FIT_SPREAD_SHARE,
    PLACES_OF_AN_EFFECT,
    PROBED_CANDIDATES,
    REFITTED_CANDIDATES,
    RIVAL_COST_RATIO,
)
from ..fits.carried import STEPS as MOVE_STEPS
from ..fits.nuisance import FIRST_STEPS, Start, begun_with, best_refit, refit_with
from ..fits.refit import Fitted
from ..fits.screening import Screened
from .form import beside, with_shapes_beside
from .hypotheses import Hypothesis, hypothesis, with_fit

OVERTAKINGS = 3
"""Times that rivals are refitted from the values of the best, as long as one overtakes it."""
LONG_ROWS = 10_000
EARLY_STEPS = 2
"""Of more samples than these a refit is long: after so many steps candidates far behind are not gone on with."""
PROBE_ROWS = 3000
"""Samples of all runs together on which candidates are probed."""
PROBE_STEPS = 4


def shortlist(screened: Sequence[Screened], most: int = REFITTED_CANDIDATES) -> list[Screened]:
    """Best of the screened candidates, with no effect at more than a few places."""
    taken: dict[str, int] = {}
    found = []
    for s in screened:
        name = s.attached.module.NAME
        if s.gain > 0.0 and taken.get(name, 0) < PLACES_OF_AN_EFFECT:
            taken[name] = taken.get(name, 0) + 1
            found.append(s)
    return found[:most]


def interleaved(one: Sequence[Screened], other: Sequence[Screened]) -> list[Screened]:
    """Best of two screenings of the same candidates in turn; each candidate once, as the first screening has it."""
    mine = {s.attached.spec: s for s in one}
    order = dict.fromkeys(s.attached.spec for pair in zip(one, other, strict=True) for s in pair)
    return [mine[spec] for spec in order]


def probe(base: Fitted, screened: Sequence[Screened], nuisances: Sequence[str]) -> list[Screened]:
    """The first `PROBED_CANDIDATES` candidates by what a few steps of a refit gain, on few samples; best first.

    Beside an effect that is there, one linear step can miss another: parameters that took part of it have far to go.

    Parameters
    ----------
    base : Fitted
    screened : sequence of Screened
        Best first.
    nuisances : sequence of str
        Nuisance effects.
    """
    runs = thinned(base.problem.kernel, base.problem.runs, PROBE_ROWS, PROBE_ROWS // 10)
    small = replace(base.at(runs), task=replace(base.task, runs=runs))

    def one(s: Screened) -> Screened:
        try:
            rmse_after = refit_with(small, s, nuisances, starts=1, steps=PROBE_STEPS).rmse
        except InputError:
            return s  # the values of the linear step are not allowed in the chain
        return replace(s, gain=max(s.gain, float(np.sum(2.0 * np.log(small.rmse / np.maximum(rmse_after, 1e-300))))))

    return sorted(together(one, screened[:PROBED_CANDIDATES]), key=lambda s: -s.gain)


def refit_candidates(
    base: Hypothesis, screened: Sequence[Screened], holdout: Sequence[FitRun], reference_fit: Fitted | None = None,
    starts: Mapping[str, Start] | None = None, progress: Callable[[str], None] = lambda _: None,
    most: int = REFITTED_CANDIDATES,
) -> list[Hypothesis]:  # fmt: skip
    """One hypothesis for each of the best candidates on top of another hypothesis.

    Parameters
    ----------
    base : Hypothesis
    screened : sequence of Screened
        Best first.
    holdout : sequence of FitRun
    reference_fit : Fitted or None
        The same baseline on reference runs: what a candidate gains there is not the missing effect.
    starts : mapping of str to Start, optional
        A second place to start from, by spec.
    progress : callable
        Given what is being done.
    most : int
        Candidates refitted.
    """

    def begun(
        s: Screened, steps: int = FIRST_STEPS, scales: Mapping[str, float] | None = None
    ) -> tuple[Screened, Fitted] | None:
        progress(f"refit with {s.attached.spec}")
        second = (starts or {}).get(s.attached.spec)
        try:
            return s, begun_with(base.fitted, s, base.nuisances, second, steps=steps, scales=scales)
        except InputError:
            return None  # the values of the linear step are not allowed in the chain

    def refitted(one: tuple[Screened, Fitted]) -> Hypothesis:
        s, fitted = one
        contends = _log_mean_square(fitted) <= least + np.log(CONTENDING_RATIO)
        if contends:
            second = (starts or {}).get(s.attached.spec)
            fitted = refit_with(base.fitted, s, base.nuisances, second, begun=fitted)
        gain = base.reference_gain
        if reference_fit is not None:
            gain = gain + _gained(reference_fit, s, base.nuisances, refit_with if contends else begun_with)
        steps = MOVE_STEPS if contends else 0
        found = hypothesis((*base.added, s.attached.spec), fitted, base.nuisances, holdout, gain, steps)
        found = beside(base, s.attached.spec, found)
        return with_shapes_beside(found) if contends else found

    listed = shortlist(screened, most)
    behind: list[tuple[Screened, Fitted]] = []
    if sum(run.time.size for run in base.fitted.problem.runs) > LONG_ROWS:
        a_little = partial(begun, steps=EARLY_STEPS, scales=base.fitted.scales)
        early = [one for one in together(a_little, listed) if one is not None]
        least = min((_log_mean_square(fitted) for _, fitted in early), default=0.0) + np.log(EARLY_RATIO)
        behind = [(s, fitted) for s, fitted in early if _log_mean_square(fitted) > least]
        listed = [s for s, fitted in early if _log_mean_square(fitted) <= least]
    tried = [one for one in together(begun, listed) if one is not None]
    least = min((_log_mean_square(fitted) for _, fitted in tried), default=0.0)
    return together(refitted, [*tried, *behind])


def _gained(
    reference_fit: Fitted, s: Screened, nuisances: Sequence[str],
    way: Callable[[Fitted, Screened, Sequence[str]], Fitted],
) -> FloatArray:  # fmt: skip
    """Mean square that a candidate gains on reference runs; nothing where they cannot run with it."""
    try:
        on_reference = way(reference_fit, s, nuisances)
    except InputError:
        return np.zeros_like(reference_fit.rmse)
    return np.maximum(reference_fit.rmse**2 - on_reference.rmse**2, 0.0)


def _log_mean_square(fitted: Fitted) -> float:
    """Log of the mean squares that a fit leaves, over the spread."""
    return float(np.sum(np.log((fitted.rmse / fitted.spread) ** 2 + FIT_SPREAD_SHARE**2)))


def refit_rivals(hypotheses: Sequence[Hypothesis], holdout: Sequence[FitRun]) -> list[Hypothesis]:
    """The same, the closest rivals of the best fit refitted from its values of the baseline.

    Where fits end in different valleys of the baseline, what they leave says nothing about their effects: an effect
    that holds another one as its special case would seem the better one. A rival that overtakes the best gives the
    others the same chance.
    """
    found, best = list(hypotheses), min(hypotheses, key=lambda h: h.fitted.cost)
    for _ in range(OVERTAKINGS):
        found = _refitted_from(best, found, holdout)
        overtaking = min(found, key=lambda h: h.fitted.cost)
        if overtaking is best:
            break
        best = overtaking
    return found


def _refitted_from(best: Hypothesis, hypotheses: Sequence[Hypothesis], holdout: Sequence[FitRun]) -> list[Hypothesis]:
    """The same, the closest rivals of one of them refitted from its values of the baseline."""

    def refitted_again(one: Hypothesis) -> Hypothesis:
        if one is best or one.fitted.cost > RIVAL_COST_RATIO * best.fitted.cost:
            return one
        names = {n for spec in one.added for n in one.parameters_of(spec)}
        values = {**best.fitted.values, **{n: v for n, v in one.fitted.values.items() if n in names}}
        per_run = {**best.fitted.per_run, **{n: v for n, v in one.fitted.per_run.items() if n in names}}
        try:
            fitted = best_refit(one.fitted, one.fitted.effects, [(values, per_run)], one.nuisances, one.fitted.released)
        except InputError:
            return one  # these values are not allowed with its effects
        if fitted.cost >= one.fitted.cost:
            return one
        return with_fit(one, fitted, holdout)

    return together(refitted_again, hypotheses)
