"""Candidates on top of a hypothesis: which are refitted, with what they gain, and refits that let rivals compare."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...effects import looks_like, prefix_of, shapes_of, sizes_of
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
    PROMISING_RATIO,
    REFERENCE_GAIN_SHARE,
    REFITTED_CANDIDATES,
    RIVAL_COST_RATIO,
)
from ..fits.carried import STEPS as MOVE_STEPS
from ..fits.nuisance import FIRST_STEPS, Start, begun_with, best_refit, refit_with
from ..fits.refit import Fitted
from ..fits.screening import Screened
from ..fits.significance import is_play_before_friction
from ..fits.takeover import Place
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


def with_the_simplest(screened: Sequence[Screened], most: int, model: str) -> list[Screened]:
    """`shortlist`, its last place that of the best effect of a single parameter that is not before it.

    One linear step favours laws of many parameters, which bend to anything: what they leave counts against them only
    after the refit. Plays before a friction, laws of what follows a reversal that many friction models bend to, take no
    place of others.
    """
    ranked = shortlist(screened, len(screened))
    most += sum(is_play_before_friction(s.attached.spec, model) for s in ranked[:most])
    kept, others = ranked[: most - 1], ranked[most - 1 :]
    simplest = [s for s in others if len(sizes_of(s.attached.module)) + len(shapes_of(s.attached.module)) == 1]
    return [*kept, *(simplest or others)[:1]]


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
    """One hypothesis for each of the best candidates on top of another hypothesis, close rivals refitted once more.

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

    def refitted(one: tuple[Screened, Fitted]) -> Fitted:
        s, fitted = one
        return refit_with(base.fitted, s, base.nuisances, (starts or {}).get(s.attached.spec), begun=fitted)

    def judged(one: tuple[Screened, Fitted], near: bool) -> Hypothesis:
        s, fitted = one
        gain = base.reference_gain
        if reference_fit is not None:
            least = REFERENCE_GAIN_SHARE * base.fitted.rmse**2 if near else np.inf
            there = replace(s, starts=[_own_values(fitted, [s.attached.spec])], tries=())
            gain = gain + _gained(reference_fit, there, base.nuisances, least)
        steps = MOVE_STEPS if near else 0
        found = hypothesis((*base.added, s.attached.spec), fitted, base.nuisances, holdout, gain, steps)
        return beside(base, s.attached.spec, found)

    listed, far = with_the_simplest(screened, most, base.fitted.model), list[tuple[Screened, Fitted]]()
    if sum(run.time.size for run in base.fitted.problem.runs) > LONG_ROWS:
        a_little = partial(begun, steps=EARLY_STEPS, scales=base.fitted.scales)
        near, far = _near_the_best(together(a_little, listed), EARLY_RATIO)
        listed = [s for s, _ in near]
    near, behind = _near_the_best(together(begun, listed), CONTENDING_RATIO)
    specs = [s for s, _ in near]
    added = [(*base.added, s.attached.spec) for s in specs]
    fits = rivals_refitted(together(refitted, near), added, base.nuisances)
    ended = list(zip(specs, fits, strict=True))
    found = together(lambda one: with_shapes_beside(judged(one, near=True)), ended)
    return [*found, *together(partial(judged, near=False), [*behind, *far])]


def _near_the_best(
    tried: Sequence[tuple[Screened, Fitted] | None], ratio: float
) -> tuple[list[tuple[Screened, Fitted]], list[tuple[Screened, Fitted]]]:
    """Candidates that leave at most so many times the mean square that the best one leaves, and the others.

    What hides behind one of these is near up to `EARLY_RATIO`: the first steps are not to choose between the two.
    """
    there = [(one, _log_mean_square(one[1])) for one in tried if one is not None]
    least = min((left for _, left in there), default=0.0)
    best = [s.attached.spec for (s, _), left in there if left <= least + np.log(ratio)]
    near, behind = list[tuple[Screened, Fitted]](), list[tuple[Screened, Fitted]]()
    for one, left in there:
        most = max(ratio, EARLY_RATIO) if looks_like(one[0].attached.spec, best) else ratio
        (near if left <= least + np.log(most) else behind).append(one)
    return near, behind


def _gained(
    reference_fit: Fitted, s: Screened, nuisances: Sequence[str], least: FloatArray | float
) -> FloatArray:  # fmt: skip
    """Mean square that a candidate gains on reference runs; nothing where they cannot run with it.

    By the first steps of a refit; by all of it where these gain at least so much of a channel.
    """
    before = reference_fit.rmse**2
    try:
        begun = begun_with(reference_fit, s, nuisances)
        if (before - begun.rmse**2 > least).any():
            begun = refit_with(reference_fit, s, nuisances, begun=begun)
    except InputError:
        return np.zeros_like(before)
    return np.maximum(before - begun.rmse**2, 0.0)


def _own_values(fitted: Fitted, specs: Sequence[str]) -> Place:
    """What a fit found for some of its effects: their parameters, and those that each run has of its own."""
    names = tuple(map(prefix_of, specs))
    own = {n: v for n, v in fitted.values.items() if n.startswith(names)}
    return own, {n: v for n, v in fitted.per_run.items() if n.startswith(names)}


def _log_mean_square(fitted: Fitted) -> float:
    """Log of the mean squares that a fit leaves, over the spread."""
    return float(np.sum(np.log((fitted.rmse / fitted.spread) ** 2 + FIT_SPREAD_SHARE**2)))


def refit_rivals(hypotheses: Sequence[Hypothesis], holdout: Sequence[FitRun]) -> list[Hypothesis]:
    """The same, refitted as `rivals_refitted`."""
    nuisances = hypotheses[0].nuisances
    fits = rivals_refitted([h.fitted for h in hypotheses], [h.added for h in hypotheses], nuisances)

    def judged(one: tuple[Hypothesis, Fitted]) -> Hypothesis:
        before, fitted = one
        return before if fitted is before.fitted else with_fit(before, fitted, holdout)

    return together(judged, list(zip(hypotheses, fits, strict=True)))


def rivals_refitted(
    fits: Sequence[Fitted], added: Sequence[Sequence[str]], nuisances: Sequence[str]
) -> list[Fitted]:  # fmt: skip
    """The same fits, the closest rivals of the best one refitted from its values of the baseline.

    Where fits end in different valleys of the baseline, what they leave says nothing about their effects: an effect
    that holds another one as its special case would seem the better one. A rival that overtakes the best gives the
    others the same chance.

    Parameters
    ----------
    fits : sequence of Fitted
    added : sequence of sequence of str
        Effects of each over the baseline: they begin from their own values.
    nuisances : sequence of str
    """
    found = list(fits)
    for _ in range(OVERTAKINGS if found else 0):
        best = min(found, key=lambda f: f.cost)
        found = _refitted_from(best, found, added, nuisances)
        if min(found, key=lambda f: f.cost) is best:
            break
    return found


def _refitted_from(
    best: Fitted, fits: Sequence[Fitted], added: Sequence[Sequence[str]], nuisances: Sequence[str]
) -> list[Fitted]:
    """The same, the closest rivals of one of them refitted from its values of the baseline."""

    def refitted_again(fit: tuple[Fitted, Sequence[str]]) -> Fitted:
        one, own = fit
        if one is best or one.cost > RIVAL_COST_RATIO * best.cost:
            return one
        values, per_run = _own_values(one, own)
        start, limit = ({**best.values, **values}, {**best.per_run, **per_run}), PROMISING_RATIO * one.cost
        try:
            fitted = best_refit(
                one, one.effects, [start], nuisances, one.released, scales=one.scales, at_most=limit
            )  # fmt: skip
        except InputError:
            return one  # these values are not allowed with its effects
        return fitted if fitted.cost < one.cost else one

    return together(refitted_again, list(zip(fits, added, strict=True)))
