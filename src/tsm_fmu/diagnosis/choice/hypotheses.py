"""Hypotheses of what is missing: each a set of effects, refitted with the baseline and its nuisance effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...effects import effect_of, looks_like, prefix_of, starts_of
from ...kernels.arrays import FloatArray
from ...models.contract import InputError
from ...regression.held_out import SETTLING
from ...regression.problem import FitRun
from ...regression.thinning import thinned
from ...regression.threads import together
from ..criteria import (
    CONTENDING_RATIO,
    FIT_SPREAD_SHARE,
    LEFT_OUT_PARTS,
    PLACES_OF_AN_EFFECT,
    PROBED_CANDIDATES,
    REFITTED_CANDIDATES,
    RIVAL_COST_RATIO,
)
from ..fits.carried import STEPS as MOVE_STEPS
from ..fits.carried import carried_over, left_out, pooled
from ..fits.disguise import disguised
from ..fits.nuisance import (
    Start,
    begun_with,
    best_refit,
    corrects_model_form,
    nearly_removed,
    refit_with,
    refit_without,
    significant_nuisances,
)
from ..fits.refit import Fitted
from ..fits.screening import Screened

FOLD_STEPS = 6
TWINS = 3
"""Best candidates whose look-alikes are refitted too, where a linear step does not show what these could do."""
PROBE_ROWS = 3000
"""Samples of all runs together on which candidates are probed."""
PROBE_STEPS = 4


@dataclass(frozen=True)
class Hypothesis:
    """Effects after their refit.

    Attributes
    ----------
    added : tuple of str
        Effects over the baseline with its nuisance effects, as ``id`` or ``id@channel``, in order.
    fitted : Fitted
    nuisances : tuple of str
        The nuisance effects.
    measured : ndarray, shape (channels,)
        Mean square left on the measured runs, the gain on reference runs put back.
    held_out : ndarray, shape (channels,), or None
        The same on held-out runs, to which the values may move; see `fits.carried`.
    effective, effective_held_out : ndarray, shape (channels,)
        Independent samples that the residual is worth on either.
    form_corrections : tuple of str
        Effects that correct the form of the model, and nuisance effects that do: none of them is missing.
    nuisance_tests : callable, optional
        Gives `tested`, where another hypothesis with the same fit knows it; only called when it is asked for.
    """

    added: tuple[str, ...]
    fitted: Fitted
    nuisances: tuple[str, ...]
    measured: FloatArray
    held_out: FloatArray | None
    effective: FloatArray
    effective_held_out: FloatArray
    form_corrections: tuple[str, ...] = ()
    nuisance_tests: Callable[[], Mapping[str, tuple[float, Fitted]]] | None = field(
        default=None, repr=False, compare=False
    )

    @property
    def reference_gain(self) -> FloatArray:
        """Mean square that its effects gain on reference runs too."""
        return self.measured - self.fitted.rmse**2

    @property
    def significant(self) -> dict[str, float]:
        """Nuisance effects that are effects of their own, by what they remove."""
        task, spread = self.fitted.task, self.fitted.spread
        used = ((spec, removed) for spec, (removed, _) in self._significant.items())
        return {spec: removed for spec, removed in used if not corrects_model_form(spec, removed, task, spread)}

    @property
    def has_large_nuisance(self) -> bool:
        """Whether a nuisance effect removes as much as a missing effect, form or not: it may stand for another one."""
        return bool(self._significant)

    @cached_property
    def disguised(self) -> bool:
        """Whether one of its effects has lost its signature: it then says nothing of what is missing."""
        return any(disguised(self.fitted, spec) for spec in self.added)

    @cached_property
    def fit_without_nuisances(self) -> Fitted:
        """The fit without the nuisance effects that remove as much as an effect: what else could be there instead?"""
        fitted = self.fitted
        if len(self._significant) == 1:
            return next(iter(self._significant.values()))[1]
        for spec in self._significant:
            fitted = refit_without(fitted, spec, self.nuisances)
        return fitted

    @cached_property
    def tested(self) -> Mapping[str, tuple[float, Fitted]]:
        """Nuisance effects that remove as much as a missing effect: how much, and the fit without each."""
        if self.nuisance_tests is not None:
            return self.nuisance_tests()
        to_test = [
            s for s in self.fitted.effects if s in self.nuisances and s not in (*self.added, *self.form_corrections)
        ]
        return significant_nuisances(self.fitted, to_test, self.nuisances)

    @property
    def _significant(self) -> dict[str, tuple[float, Fitted]]:
        return {s: found for s, found in self.tested.items() if s not in self.form_corrections}

    @property
    def effects(self) -> tuple[str, ...]:
        """All that this hypothesis says is missing."""
        return (*(s for s in self.added if s not in self.form_corrections), *self.significant)

    @property
    def values_of_runs(self) -> int:
        """Values that its effects have of each run: states at the start."""
        starts = [f"{prefix_of(spec)}{name}" for spec in self.added for name in starts_of(effect_of(spec))]
        used = {self.fitted.problem.declared[f].name for f in self.fitted.problem.per_run} if starts else set[str]()
        return len(used.intersection(starts)) * len(self.fitted.problem.runs)

    @property
    def parameter_count(self) -> int:
        """Free parameters with one value for all runs, and `values_of_runs`."""
        return len(self.fitted.problem.shared) + self.values_of_runs

    def parameters(self, spec: str) -> dict[str, float]:
        """Values of an effect's own parameters."""
        return {n.rpartition(".")[2]: self.fitted.values[n] for n in self.parameters_of(spec)}

    def parameters_of(self, spec: str) -> list[str]:
        """Public names of an effect's own parameters."""
        return [n for n in self.fitted.values if n.startswith(prefix_of(spec))]


def shortlist(screened: Sequence[Screened], most: int = REFITTED_CANDIDATES) -> list[Screened]:
    """Best of the screened candidates, with no effect at more than a few places."""
    taken: dict[str, int] = {}
    found = []
    for s in screened:
        name = s.attached.module.NAME
        if s.gain > 0.0 and taken.get(name, 0) < PLACES_OF_AN_EFFECT:
            taken[name] = taken.get(name, 0) + 1
            found.append(s)
    found = found[:most]
    # what is before a run is not in a linear step: such an effect may be there where one that looks like it seems to be
    best = [s.attached for s in found[:TWINS]]
    twins = [
        s for s in screened
        if s not in found and starts_of(s.attached.module)
        and any(one.channel == s.attached.channel and looks_like(one.spec, [s.attached.spec]) for one in best)
    ]  # fmt: skip
    return [*found, *twins]


def interleaved(one: Sequence[Screened], other: Sequence[Screened]) -> list[Screened]:
    """Best of two screenings of the same candidates in turn; each candidate once, as the first screening has it."""
    mine = {s.attached.spec: s for s in one}
    order = dict.fromkeys(s.attached.spec for pair in zip(one, other, strict=True) for s in pair)
    return [mine[spec] for spec in order]


def hypothesis(
    added: Sequence[str], fitted: Fitted, nuisances: Sequence[str], holdout: Sequence[FitRun],
    reference_gain: FloatArray | float = 0.0, move_steps: int = MOVE_STEPS,
) -> Hypothesis:  # fmt: skip
    """A fit with what it leaves on the measured and the held-out runs."""
    holdout_mean_square, effective = None, np.ones(fitted.rmse.size)
    if holdout:
        left = carried_over(fitted, holdout, move_steps)
        holdout_mean_square, effective = left.mean_square + reference_gain, left.effective
    return Hypothesis(
        tuple(added),
        fitted,
        tuple(nuisances),
        fitted.rmse**2 + reference_gain,
        holdout_mean_square,
        fitted.effective,
        effective,
    )


def with_fit(one: Hypothesis, fitted: Fitted, holdout: Sequence[FitRun]) -> Hypothesis:
    """A copy whose fit is another refit of the same effects."""
    found = hypothesis(one.added, fitted, one.nuisances, holdout, one.reference_gain)
    return replace(found, form_corrections=one.form_corrections)


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

    def begun(s: Screened) -> tuple[Screened, Fitted] | None:
        progress(f"refit with {s.attached.spec}")
        try:
            return s, begun_with(base.fitted, s, base.nuisances, (starts or {}).get(s.attached.spec))
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
        return beside(base, s.attached.spec, found)

    tried = [one for one in together(begun, shortlist(screened, most)) if one is not None]
    least = min((_log_mean_square(fitted) for _, fitted in tried), default=0.0)
    return together(refitted, tried)


def beside(base: Hypothesis, spec: str, one: Hypothesis) -> Hypothesis:
    """A hypothesis with one effect more than another, which corrects the form of the model if it removes no more.

    Unless next to nothing is left with it of what the model without nuisance effects leaves, or a nuisance effect that
    was one of its own does nothing any more beside it: no correction of a form does that.
    """
    spread = one.fitted.spread
    share = float(np.max(np.sqrt(np.maximum(base.measured - one.measured, 0.0)) / np.maximum(spread, 1e-300)))
    corrects = corrects_model_form(spec, share, one.fitted.task, spread)
    before = base.measured if base.added else np.maximum(base.measured, one.fitted.task.gap**2)
    with_form = replace(one, form_corrections=(*base.form_corrections, spec))
    if (
        corrects
        and not nearly_removed(before, one.measured).any()
        and base.significant.keys() <= with_form.significant.keys()
    ):
        return with_form
    return replace(one, form_corrections=base.form_corrections)


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
    that holds another one as its special case would seem the better one.
    """
    best = min(hypotheses, key=lambda h: h.fitted.cost)

    def refitted_again(one: Hypothesis) -> Hypothesis:
        if one is best or one.fitted.cost > RIVAL_COST_RATIO * best.fitted.cost:
            return one
        names = {n for spec in one.added for n in one.parameters_of(spec)}
        values = {**best.fitted.values, **{n: v for n, v in one.fitted.values.items() if n in names}}
        try:
            fitted = best_refit(
                one.fitted, one.fitted.effects, [(values, best.fitted.per_run)], one.nuisances, one.fitted.released
            )
        except InputError:
            return one  # these values are not allowed with its effects
        if fitted.cost >= one.fitted.cost:
            return one
        return with_fit(one, fitted, holdout)

    return together(refitted_again, hypotheses)


def find_significant_nuisances(hypotheses: Sequence[Hypothesis]) -> None:
    """Find `Hypothesis.tested` of all, side by side: each takes refits."""
    together(lambda one: one.effects, hypotheses)


def can_leave_out(runs: Sequence[FitRun]) -> bool:
    """Whether each run can be judged by a fit to the others."""
    return len(runs) > 1 and all(np.ptp(run.time) > 2.0 * SETTLING for run in runs)


def left_out_in_turn(one: Hypothesis) -> Hypothesis:
    """A copy whose held-out error is what it leaves on runs that are left out in turn."""
    runs, parts = one.fitted.problem.runs, []
    for k in range(min(LEFT_OUT_PARTS, len(runs))):
        out = range(k, len(runs), LEFT_OUT_PARTS)
        kept = [j for j in range(len(runs)) if j not in out]
        task = replace(one.fitted.task, runs=[runs[j] for j in kept])
        start = one.fitted.values, {name: values[kept] for name, values in one.fitted.per_run.items()}
        fitted = best_refit(
            replace(one.fitted, task=task), one.fitted.effects, [start], one.nuisances, one.fitted.released, FOLD_STEPS
        )
        parts.append(left_out(one.fitted, fitted, out))
    left = pooled(parts)
    return replace(
        one,
        held_out=left.mean_square,
        effective_held_out=left.effective,
        nuisance_tests=lambda: one.tested,
    )
