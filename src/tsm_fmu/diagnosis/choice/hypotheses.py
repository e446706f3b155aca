"""Hypotheses of what is missing: each a set of effects, refitted with the baseline and its nuisance effects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...effects import effect_of, prefix_of, starts_of
from ...kernels.arrays import BoolArray, FloatArray
from ...kernels.chain import attach
from ...kernels.kernel import kernel
from ...regression.held_out import SETTLING
from ...regression.problem import FitRun
from ...regression.threads import together
from ..criteria import (
    CLEAN_EFFECT_SPREAD_SHARE,
    FURTHER_EFFECT_SPREAD_SHARE,
    LEFT_OUT_PARTS,
    MUCH_LESS_RATIO,
    REFERENCE_RATIO,
)
from ..fits.carried import STEPS as MOVE_STEPS
from ..fits.carried import carried_over, left_out, pooled
from ..fits.disguise import disguised
from ..fits.nuisance import best_refit, refit_without
from ..fits.references import serve_both, serve_both_but_for_one
from ..fits.refit import Fitted
from ..fits.significance import corrects_model_form, is_play_before_friction, significant_nuisances, unlike_references

FOLD_STEPS = 6


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
    folded : bool
        Whether ``held_out`` is of measured runs that were left out in turn.
    holdout : sequence of FitRun
        Held-out runs; none where ``held_out`` is of measured ones.
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
    folded: bool = False
    holdout: Sequence[FitRun] = field(default=(), repr=False, compare=False)
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
        used = ((spec, removed) for spec, (removed, _) in self._significant.items())
        least = FURTHER_EFFECT_SPREAD_SHARE if self.missing else 0.0
        found = {spec: removed for spec, removed in used if removed > least}
        return {spec: removed for spec, removed in found.items() if not self._is_form(spec, removed)}

    def _is_form(self, spec: str, removed: float) -> bool:
        """Whether a nuisance effect that removes this part of a channel's spread corrects the form of the model.

        Not where it makes measured and held-out runs as good as reference runs are, and those without it.
        """
        task = self.fitted.task
        if not corrects_model_form(spec, removed, task, self.fitted.spread):
            return False
        as_good = unlike_references(spec, self.tested[spec][1].rmse, self.fitted)
        if self.held_out is not None:
            as_good &= self.held_out <= (REFERENCE_RATIO * task.discrepancy) ** 2
        return not as_good.any()

    @property
    def has_large_nuisance(self) -> bool:
        """Whether a nuisance effect removes as much as a missing effect, form or not: it may stand for another one."""
        return bool(self._significant)

    @cached_property
    def disguised(self) -> bool:
        """Whether one of its effects has lost its signature: it then says nothing of what is missing.

        So does play before a friction that only corrects the form of the model: the curve of another friction.
        """
        form = [s for s in self.form_corrections if is_play_before_friction(s, self.fitted.model)]
        return bool(form) or any(disguised(self.fitted, spec) for spec in self.added)

    @cached_property
    def serves_references(self) -> bool:
        """Whether some values serve its runs and reference runs; so without any. Takes refits where its own do not."""
        reference = self.fitted.task.reference
        return reference is None or serve_both(self.fitted, reference, self.nuisances)

    def may_have_changed(self, most: FloatArray) -> bool:
        """Whether a single value of the rig that has changed since the reference runs leaves no more; takes refits.

        Parameters
        ----------
        most : ndarray, shape (channels,)
            Mean square.
        """
        reference = self.fitted.task.reference
        return reference is not None and serve_both_but_for_one(
            self.fitted, reference, self.nuisances, np.sqrt(np.maximum(most - self.reference_gain, 0.0))
        )

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
        elsewhere = self.held_out - self.reference_gain if self.held_out is not None and self.holdout else None
        return significant_nuisances(self.fitted, to_test, self.nuisances, self.holdout, elsewhere)

    @property
    def _significant(self) -> dict[str, tuple[float, Fitted]]:
        return {s: found for s, found in self.tested.items() if s not in self.form_corrections}

    @property
    def effects(self) -> tuple[str, ...]:
        """All that this hypothesis says is missing."""
        return (*self.missing, *self.significant)

    @property
    def missing(self) -> list[str]:
        """Of the effects that it adds, those that do more than correct the form of the model."""
        return [s for s in self.added if s not in self.form_corrections]

    @property
    def has_effects(self) -> bool:
        """Whether it says that anything is missing; without a refit where one that it adds is."""
        return bool(self.missing) or bool(self.significant)

    def adds(self, effects: Iterable[str], beside: Hypothesis) -> bool:
        """Whether it adds these effects to the same nuisance effects as another: none in the place of one of them."""
        return set(self.added) == set(effects) and self.nuisances == beside.nuisances

    def changed_by(self, spec: str) -> BoolArray:
        """Channels that an effect changes; shape (channels,)."""
        return np.nan_to_num(self.fitted.share_of(spec), nan=np.inf) > CLEAN_EFFECT_SPREAD_SHARE

    @cached_property
    def acts(self) -> BoolArray:
        """Channels that its effects change; shape (channels,)."""
        return np.any([self.changed, *map(self.changed_by, self.significant)], axis=0)

    @cached_property
    def changed(self) -> BoolArray:
        """Channels that the effects change which it adds; shape (channels,)."""
        return np.any([np.zeros(self.measured.size, bool), *map(self.changed_by, self.missing)], axis=0)

    @property
    def values_of_runs(self) -> int:
        """Values that its effects have of each run: states at the start."""
        starts = [f"{prefix_of(spec)}{name}" for spec in self.added for name in starts_of(effect_of(spec))]
        used = {self.fitted.problem.declared[f].name for f in self.fitted.problem.per_run} if starts else set[str]()
        return len(used.intersection(starts)) * len(self.fitted.problem.runs)

    @cached_property
    def is_driven_within_runs(self) -> bool:
        """Whether a column that drives one of its effects changes half as much within runs as between them, or more."""
        problem = self.fitted.problem
        names = [v.name for v in problem.kernel.inputs]
        columns = [d.column for spec in self.effects for d in attach(kernel(self.fitted.model), spec).drives]

        def changes(column: str) -> bool:
            each = [run.inputs[:, names.index(column)] for run in problem.runs]
            return bool(np.mean([x.var() for x in each]) > MUCH_LESS_RATIO**2 * np.var([x.mean() for x in each]))

        return any(map(changes, columns))

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
        holdout=holdout,
    )


def with_fit(one: Hypothesis, fitted: Fitted, holdout: Sequence[FitRun]) -> Hypothesis:
    """A copy whose fit is another refit of the same effects."""
    found = hypothesis(one.added, fitted, one.nuisances, holdout, one.reference_gain)
    return replace(found, form_corrections=one.form_corrections)


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
        fold, last = replace(one.fitted, task=task), one.fitted
        fitted = best_refit(fold, last.effects, [start], one.nuisances, last.released, FOLD_STEPS, last.scales)
        parts.append(left_out(one.fitted, fitted, out))
    left = pooled(parts)
    return replace(
        one,
        held_out=left.mean_square,
        effective_held_out=left.effective,
        folded=True,
        nuisance_tests=lambda: one.tested,
    )
