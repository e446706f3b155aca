"""Hypotheses of what is missing: each a set of effects, refitted with the baseline and its nuisance freedom."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...models.contract import InputError
from ...regression.held_out import SETTLING
from ...regression.problem import FitRun, FloatArray
from ...regression.thinning import thinned
from ...regression.threads import together
from ..criteria import LEFT_OUT_PARTS, PLACES_OF_AN_EFFECT, PROBED_CANDIDATES, REFITTED_CANDIDATES, RIVAL_COST_RATIO
from ..fits.nuisance import Start, best_of, extended, is_form, material, without
from ..fits.refit import Fitted, effective_samples, rms
from ..fits.screening import Screened

FOLD_STEPS = 6
PROBE_ROWS = 3000
"""Samples of all runs together on which candidates are probed."""
PROBE_STEPS = 4


@dataclass(frozen=True)
class Hypothesis:
    """Effects after their refit.

    Attributes
    ----------
    added : tuple of str
        Effects over the baseline with its nuisance freedom, as ``id`` or ``id@channel``, in order.
    fitted : Fitted
    free : tuple of str
        The nuisance freedom.
    measured : ndarray, shape (channels,)
        Mean square left on the measured runs, the gain on reference runs put back.
    held : ndarray, shape (channels,), or None
        The same on held-out runs.
    effective, effective_held : ndarray, shape (channels,)
        Independent samples that the residual is worth on either.
    form : tuple of str
        Freedoms that are no effects of their own, whatever they remove.
    weighed : dict
        What each freedom removes, and the fit without it, None where it is not material; filled when it is asked for,
        and kept where the same fit is judged otherwise.
    """

    added: tuple[str, ...]
    fitted: Fitted
    free: tuple[str, ...]
    measured: FloatArray
    held: FloatArray | None
    effective: FloatArray
    effective_held: FloatArray
    form: tuple[str, ...] = ()
    weighed: dict[str, tuple[float, Fitted] | None] = field(default_factory=dict, repr=False, compare=False)

    @property
    def reference_gain(self) -> FloatArray:
        """Mean square that its effects gain on reference runs too."""
        return self.measured - self.fitted.rmse**2

    @property
    def material(self) -> dict[str, float]:
        """Freedoms that are effects of their own, by what they remove."""
        task, spread = self.fitted.task, self.fitted.spread
        used = ((spec, removed) for spec, (removed, _) in self._material.items())
        return {spec: removed for spec, removed in used if not is_form(spec, removed, task, spread)}

    @property
    def bends(self) -> bool:
        """Whether a freedom removes as much as an effect of its own, form or not: it may stand for another effect."""
        return bool(self._material)

    @cached_property
    def bare(self) -> Fitted:
        """The fit without the freedoms that remove as much as an effect: what else could be there instead?"""
        fitted = self.fitted
        if len(self._material) == 1:
            return next(iter(self._material.values()))[1]
        for spec in self._material:
            fitted = without(fitted, spec, self.free)
        return fitted

    @property
    def _material(self) -> dict[str, tuple[float, Fitted]]:
        asked = [s for s in self.fitted.effects if s in self.free and s not in (*self.added, *self.form)]
        new = [s for s in asked if s not in self.weighed]
        if new:
            found = material(self.fitted, new, self.free)
            self.weighed.update({s: found.get(s) for s in new})
        return {s: known for s in asked if (known := self.weighed[s]) is not None}

    @property
    def effects(self) -> tuple[str, ...]:
        """All that this hypothesis says is missing."""
        return (*self.added, *self.material)

    def parameters(self, spec: str) -> dict[str, float]:
        """Values of an effect's own parameters."""
        return {n.rpartition(".")[2]: self.fitted.values[n] for n in self.parameters_of(spec)}

    def parameters_of(self, spec: str) -> list[str]:
        """Public names of an effect's own parameters."""
        name, _, channel = spec.partition("@")
        prefix = f"{channel}.{name}." if channel else f"{name}."
        return [n for n in self.fitted.values if n.startswith(prefix)]


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


def hypothesis(
    added: Sequence[str], fitted: Fitted, free: Sequence[str], holdout: Sequence[FitRun],
    reference_gain: FloatArray | float = 0.0,
) -> Hypothesis:  # fmt: skip
    """A fit with what it leaves on the measured and the held-out runs."""
    held, effective = None, np.ones(fitted.rmse.size)
    if holdout:
        residuals = fitted.held_out_errors(holdout)
        held, effective = rms(residuals) ** 2 + reference_gain, effective_samples(residuals)
    return Hypothesis(
        tuple(added), fitted, tuple(free), fitted.rmse**2 + reference_gain, held, fitted.effective, effective
    )


def with_fit(one: Hypothesis, fitted: Fitted, holdout: Sequence[FitRun]) -> Hypothesis:
    """The same hypothesis after another refit."""
    return hypothesis(one.added, fitted, one.free, holdout, one.reference_gain)


def probed(base: Fitted, screened: Sequence[Screened], free: Sequence[str]) -> list[Screened]:
    """The first `PROBED_CANDIDATES` candidates by what a few steps of a refit gain, on few samples; best first.

    Beside an effect that is there, one linear step can miss another: parameters that took part of it have far to go.

    Parameters
    ----------
    base : Fitted
    screened : sequence of Screened
        Best first.
    free : sequence of str
        Nuisance freedom.
    """
    runs = thinned(base.problem.kernel, base.problem.runs, PROBE_ROWS, PROBE_ROWS // 10)
    small = replace(base.at(runs), task=replace(base.task, runs=runs))

    def one(s: Screened) -> Screened:
        try:
            left = extended(small, s, free, starts=1, steps=PROBE_STEPS).rmse
        except InputError:
            return s  # the values of the linear step are not allowed in the chain
        return replace(s, gain=max(s.gain, float(np.sum(2.0 * np.log(small.rmse / np.maximum(left, 1e-300))))))

    return sorted(together(one, screened[:PROBED_CANDIDATES]), key=lambda s: -s.gain)


def tried(
    base: Hypothesis, screened: Sequence[Screened], holdout: Sequence[FitRun], calm: Fitted | None = None,
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
    calm : Fitted or None
        The same baseline on reference runs: what a candidate gains there is not the missing effect.
    starts : mapping of str to Start, optional
        A second place to start from, by spec.
    progress : callable
        Given what is being done.
    most : int
        Candidates refitted.
    """

    def one(s: Screened) -> Hypothesis | None:
        progress(f"refit with {s.attached.spec}")
        try:
            fitted = extended(base.fitted, s, base.free, (starts or {}).get(s.attached.spec))
            gain = base.reference_gain
            if calm is not None:
                gain = gain + np.maximum(calm.rmse**2 - extended(calm, s, base.free).rmse ** 2, 0.0)
        except InputError:
            return None  # the values of the linear step are not allowed in the chain
        return hypothesis((*base.added, s.attached.spec), fitted, base.free, holdout, gain)

    return [h for h in together(one, shortlist(screened, most)) if h is not None]


def rivals_again(hypotheses: Sequence[Hypothesis], holdout: Sequence[FitRun]) -> list[Hypothesis]:
    """The same, the closest rivals of the best fit refitted from its values of the baseline.

    Where fits end in different valleys of the baseline, what they leave says nothing about their effects: an effect
    that holds another one as its special case would seem the better one.
    """
    best = min(hypotheses, key=lambda h: h.fitted.cost)

    def again(one: Hypothesis) -> Hypothesis:
        if one is best or one.fitted.cost > RIVAL_COST_RATIO * best.fitted.cost:
            return one
        names = {n for spec in one.added for n in one.parameters_of(spec)}
        values = {**best.fitted.values, **{n: v for n, v in one.fitted.values.items() if n in names}}
        try:
            fitted = best_of(
                one.fitted, one.fitted.effects, [(values, best.fitted.per_run)], one.free, one.fitted.released
            )
        except InputError:
            return one  # these values are not allowed with its effects
        if fitted.cost >= one.fitted.cost:
            return one
        return with_fit(one, fitted, holdout)

    return together(again, hypotheses)


def weigh(hypotheses: Sequence[Hypothesis]) -> None:
    """Fill `Hypothesis.weighed` of all, side by side: which freedoms are effects takes refits."""
    together(lambda one: one.effects, hypotheses)


def foldable(runs: Sequence[FitRun]) -> bool:
    """Whether each run can be judged by a fit to the others."""
    return len(runs) > 1 and all(np.ptp(run.time) > 2.0 * SETTLING for run in runs)


def folded(one: Hypothesis) -> Hypothesis:
    """The same with what it leaves on runs that are left out in turn, as if they were held out."""
    runs, residuals = one.fitted.problem.runs, []
    for k in range(min(LEFT_OUT_PARTS, len(runs))):
        kept = [j for j in range(len(runs)) if j % LEFT_OUT_PARTS != k]
        task = replace(one.fitted.task, runs=[runs[j] for j in kept])
        start = one.fitted.values, {name: values[kept] for name, values in one.fitted.per_run.items()}
        fitted = best_of(
            replace(one.fitted, task=task), one.fitted.effects, [start], one.free, one.fitted.released, FOLD_STEPS
        )
        residuals += fitted.held_out_errors(runs[k::LEFT_OUT_PARTS])
    return replace(one, held=rms(residuals) ** 2, effective_held=effective_samples(residuals))
