"""The model before any candidate: as given, refitted, and refitted with its nuisance parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...kernels.kernel import kernel
from ...regression.multistart import MultiStart
from ...regression.problem import FitRun
from ...regression.solver import SearchLog
from ..criteria import LOST_SHARE
from ..fits.nuisance import nuisance_specs, with_nuisances
from ..fits.quantised import Levels, coarse, step_noise
from ..fits.references import jointly, serve
from ..fits.refit import Fitted, Task, as_given, refit
from ..fits.significance import RemovedOnReference
from .hypotheses import Hypothesis, hypothesis


@dataclass(frozen=True)
class Baselines:
    """Fits without any candidate.

    Attributes
    ----------
    given : Fitted
        Nothing fitted but what each run has of its own.
    refitted : Hypothesis
        Other parameter values.
    with_nuisances : Hypothesis
        These, and the nuisance parameters that every candidate is refitted with.
    reference : Fitted or None
        The same on reference runs.
    levels : tuple of Levels
        Channels of so few levels that these are a gap.
    joint : Baselines or None
        The same with values that serve reference runs too, where those of the measured runs do not.
    """

    given: Fitted
    refitted: Hypothesis
    with_nuisances: Hypothesis
    reference: Fitted | None
    levels: tuple[Levels, ...]
    joint: Baselines | None = None


def baselines(
    task: Task, effects: Sequence[str], runs: Sequence[FitRun], references: Sequence[FitRun],
    holdout: Sequence[FitRun], progress: Callable[[str], None],
) -> Baselines:  # fmt: skip
    """Fit them.

    Parameters
    ----------
    task : Task
    effects : sequence of str
        That the model has already.
    runs : sequence of FitRun
        All samples of the measured runs, for the levels of their sensors.
    references, holdout : sequence of FitRun
    progress : callable
        Given what is being done.
    """
    progress("model as given")
    given = as_given(task, effects)
    progress("refit of the baseline")
    base = refitted_model(task, effects, given)
    nuisances = nuisance_specs(task.model, task.channels, effects)
    plain = reference = None
    if references:
        progress("reference runs")
        plain, base = _of_one_rig(replace(task, runs=references), effects, base)
        reference = with_nuisances(plain, nuisances)
        base = replace(
            base,
            task=replace(
                base.task,
                discrepancy=reference.rmse,
                reference_removal=RemovedOnReference(reference, nuisances),
                reference=reference,
            ),
        )
    levels = coarse(runs, task.channels, base.spread)
    base = replace(base, task=replace(base.task, gap=base.rmse, steps=step_noise(levels, task.channels)))

    def found(fitted: Fitted, joint: Baselines | None = None) -> Baselines:
        alone, with_all = hypothesis((), fitted, (), holdout), with_nuisances(fitted, nuisances)
        return Baselines(
            given, alone, hypothesis((), with_all, nuisances, holdout), reference, tuple(levels), joint
        )  # fmt: skip

    if plain is None or serve(plain, base):
        return found(base)
    progress("values for measured and reference runs")
    return found(base, found(jointly(base, plain, ())))


def _of_one_rig(task: Task, effects: Sequence[str], measured: Fitted) -> tuple[Fitted, Fitted]:
    """The refits of the reference runs and of the measured ones, each also begun with the values of the other.

    Both are runs of one rig: where a refit alone ends in a poor valley, what it leaves is no form of the model.
    """
    alone = refitted_model(task, effects)
    reference = min(alone, refitted_model(task, effects, values=measured.values), key=_log_rmse)
    unweighted = replace(measured.task, weights=task.weights)
    again = refitted_model(unweighted, effects, measured, reference.values)
    return reference, min(measured, again, key=_log_rmse)


def _log_rmse(fitted: Fitted) -> float:
    return float(np.sum(np.log(np.maximum(fitted.rmse, 1e-12 * fitted.spread))))


def refitted_model(
    task: Task, effects: Sequence[str], given: Fitted | None = None, values: Mapping[str, float] | None = None
) -> Fitted:
    """The model refitted, channels weighted by the inverse of what a first refit leaves of them.

    Parameters
    ----------
    task : Task
    effects : sequence of str
    given : Fitted, optional
        With the start values that each run has of its own.
    values : mapping of str to float, optional
        Start values of the others, instead of those given.
    """
    first = refit(task, effects, values or {}, per_run_values=given.per_run if given else None)
    by_default = values is None and not any(v.name in task.values for v in kernel(task.model).parameters)
    if by_default and (first.rmse > LOST_SHARE * first.spread).any():
        first = min(first, _from_several_starts(first), key=lambda f: f.cost)
    if len(task.channels) < 2:
        return first
    weighted = replace(task, weights=1.0 / np.maximum(first.rmse, 1e-6 * first.spread))
    return refit(weighted, effects, first.values, per_run_values=first.per_run)


def _from_several_starts(fitted: Fitted) -> Fitted:
    """The same model fitted as an identification does it: linear parameters solved for, several physical starts."""
    return replace(fitted, table=MultiStart()(fitted.problem, SearchLog()).table)
