"""A model with effects against runs: refitted, with its residuals; what every step of the diagnosis works on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...effects import prefix_of
from ...kernels.arrays import FloatArray
from ...kernels.chain import attach, chain
from ...kernels.drives import Drive
from ...kernels.kernel import Kernel, kernel
from ...models.contract import InputError, flat
from ...regression.descent import Descent
from ...regression.held_out import held_out_errors, settled
from ...regression.prior import Prior
from ...regression.prior_of_fit import prior_of_fit
from ...regression.problem import FitRun, Problem
from ...regression.residuals import rms
from ...regression.sensitivity import sensitivity_scales
from ...regression.specification import per_run_fields, search_space
from ...regression.uncertainty import autocorrelation_time
from ..criteria import BETWEEN_SAMPLES_RATIO, REMEMBERED_SHARE

STEPS = 15
"""Steps of one refit at most,"""
UNDER_WAY_GAIN = 0.01
"""but for one whose last step gained this part of the sum of squares: it is in the valley, not yet at its end."""
LEAST_CHANGE = 1e-4
"""Change of the sum of squares at which a refit ends: gaps are compared to a hundredth."""
REFINED_STEPS = 30
"""Steps of the refit of an answer, but for one under way: so many that gain less than `LEAST_CHANGE` do not make
`REFINED_GAIN`."""
REFINED_GAIN = 0.01
"""Part of the sum of squares that it must be worth."""


@dataclass(frozen=True)
class Fitted:
    """A model with effects after a refit.

    Attributes
    ----------
    model : str
        Base model.
    effects : tuple of str
        Attached effects in order, as ``id`` or ``id@channel``.
    problem : Problem
        Runs, channels, weights, bounds.
    table : ndarray, shape (runs, parameters)
        Values found.
    released : tuple of str
        Nuisance effects whose drift varies too; see `nuisance`.
    scales : mapping of str to float
        Change of each free parameter, by field, that moves the channels by a standard deviation where the refit began;
        a refit from values near by need not look for them again. Empty where nothing was refitted.
    """

    task: Task
    effects: tuple[str, ...]
    problem: Problem
    table: FloatArray
    released: tuple[str, ...] = ()
    scales: Mapping[str, float] = field(default_factory=dict)

    @property
    def model(self) -> str:
        return self.task.model

    @cached_property
    def cost(self) -> float:
        """Weighted sum of squares."""
        return self.problem.cost(self.table)

    @cached_property
    def prior(self) -> Prior:
        """What this fit says of its parameters to one of other runs of the same rig."""
        return prior_of_fit(self.problem, self.table)

    @property
    def shared_values(self) -> dict[str, float]:
        """Free parameters with one value for all runs, by public name."""
        return {
            self.problem.declared[f].name: float(self.table[0, self.problem.fields.index(f)])
            for f in self.problem.shared
        }

    @property
    def per_run(self) -> dict[str, FloatArray]:
        """By public name, the values of each run's own parameters, shape (runs,)."""
        columns = {self.problem.declared[f].name: self.problem.fields.index(f) for f in self.problem.per_run}
        return {name: self.table[:, j].copy() for name, j in columns.items()}

    @cached_property
    def residuals(self) -> list[FloatArray]:
        """Measured minus simulated, one array (n, channels) a run."""
        return self.problem.gaps(self.table)

    @property
    def compared_residuals(self) -> list[FloatArray]:
        """The same, NaN where nothing is compared."""
        runs = self.problem.runs
        return [
            np.where(run.unresolved, np.nan, r) if run.unresolved.size else r
            for run, r in zip(runs, self.residuals, strict=True)
        ]

    @cached_property
    def rmse(self) -> FloatArray:
        """Pooled over samples, by channel."""
        return rms(self.residuals)

    @cached_property
    def spread(self) -> FloatArray:
        """Standard deviation of each measured channel, within runs."""
        return np.sqrt(np.mean([r.targets.var(axis=0) for r in self.problem.runs], axis=0))

    @cached_property
    def effective(self) -> FloatArray:
        """Independent samples that the residual of each channel is worth."""
        return effective_samples(self.residuals)

    @property
    def values(self) -> dict[str, float]:
        """Parameters by public name, the mean over the runs where each has its own."""
        names = [self.problem.declared[f].name for f in self.problem.fields]
        row = self.table[0].copy()  # the mean of equal values may round over their bound
        columns = [self.problem.fields.index(f) for f in self.problem.per_run]
        row[columns] = self.table[:, columns].mean(axis=0)
        return dict(zip(names, row.tolist(), strict=True))

    def held_out_errors(self, runs: Sequence[FitRun]) -> list[FloatArray]:
        """Residuals on runs that were not fitted; a nuisance offset there is the mean of those fitted."""
        return held_out_errors(self.problem, self.table, runs, _per_run(self.problem.kernel, self.task))

    def settled(self, run: FitRun) -> FloatArray:
        """Values for a run that was not fitted, shape (parameters,)."""
        return settled(self.problem, self.table, run, _per_run(self.problem.kernel, self.task))

    def at(self, runs: Sequence[FitRun]) -> Fitted:
        """A copy with the values found, on the same runs at another sampling."""
        return replace(self, problem=self.problem.with_runs(list(runs)))

    def on(self, runs: Sequence[FitRun]) -> Fitted:
        """A copy with the values found, on runs that were not fitted."""
        table = np.array([self.settled(run) for run in runs])
        return replace(self, problem=self.problem.with_runs(list(runs)), table=table)

    def refined(self) -> Fitted:
        """A copy at the minimum near by: a refit among many may stop some way before it.

        The same where that is worth less than gaps are compared to: what the runs leave open would only wander.
        """
        found = replace(self, table=descent(REFINED_STEPS).refined(self.problem, self.table))
        return found if found.cost < (1.0 - REFINED_GAIN) * self.cost else self

    def holding(self, more: Callable[[], Sequence[FitRun]], whole: Sequence[FitRun]) -> Fitted:
        """A copy that leaves about as much on all samples, for which it is fitted to more of them where it does not.

        Parameters
        ----------
        more : callable
            Gives the same runs at more samples; only called where they are needed.
        whole : sequence of FitRun
            The same runs at all.
        """
        here = self.at(whole)
        if (here.rmse <= BETWEEN_SAMPLES_RATIO * self.rmse).all():
            return self
        table = descent(STEPS).refined(self.problem.with_runs(list(more())), self.table)
        found = replace(self, table=table)
        return found if found.at(whole).cost < here.cost else self

    def has(self, effect: str) -> bool:
        """Whether the model's own law holds an effect, by parameters that were free to fit it."""
        fields = kernel(self.model).roles.has.get(effect, ())
        return bool(fields) and all(self.problem.space[f].free for f in fields)

    def share_of(self, spec: str) -> FloatArray:
        """RMS of what an effect does, by channel, as part of the channel's spread; nothing is refitted."""
        return self._change_to(self.switched_off(spec))

    def switched_off(self, spec: str) -> Fitted:
        """A copy in which an effect does nothing; nothing is refitted."""
        one = attach(kernel(self.model), spec)
        fields = [one.prefix + v.field for v in Kernel(one.module).parameters]
        return self.with_values(dict(zip(fields, flat(one.module.NEUTRAL), strict=True)))

    def change_with(self, values: Mapping[str, float]) -> FloatArray:
        """RMS by which other values of some fields change the channels, as part of their spread; nothing is refitted.

        NaN where the model cannot run with them.
        """
        return self._change_to(self.with_values(values))

    def _change_to(self, other: Fitted) -> FloatArray:
        changes = [before - after for before, after in zip(self.residuals, other.residuals, strict=True)]
        return rms(changes) / np.maximum(self.spread, 1e-300)

    def lent_by(self, other: Fitted, effects: Sequence[str]) -> Fitted:
        """A copy with the values that another fit to the same runs has, but for those of some effects.

        Nothing is refitted; later refits move these alone, and what each run has of its own. See `not_kept`.
        """
        own, others = tuple(map(prefix_of, effects)), other.values | other.per_run
        names = {f: self.problem.declared[f].name for f in self.problem.fields}
        lent = {f: others[name] for f, name in names.items() if name in others and not name.startswith(own)}
        kept = [f for f in self.problem.shared if f in lent]
        return replace(
            self.with_values(lent), problem=self.problem.over(self.problem.space.fixing(kept)),
            task=replace(self.task, fixed=(*self.task.fixed, *(names[f] for f in kept))),
        )  # fmt: skip

    def not_kept(self, fixed: Sequence[str]) -> Fitted:
        """A copy in which all parameters may move again but those that are given as fixed, by public name."""
        again = {*self.task.fixed} - {*fixed}
        fields = [f for f in self.problem.fields if self.problem.declared[f].name in again]
        space = self.problem.space.freeing_only({*self.problem.space.free, *fields})
        return replace(self, problem=self.problem.over(space), task=replace(self.task, fixed=tuple(fixed)))

    def with_values(self, values: Mapping[str, float | FloatArray]) -> Fitted:
        """A copy with other values of some fields, by field, each one or of shape (runs,); nothing is refitted."""
        table = self.table.copy()
        for name, value in values.items():
            table[:, self.problem.fields.index(name)] = value
        return replace(self, table=table)


def effective_samples(residuals: Sequence[FloatArray]) -> FloatArray:
    """Independent samples that the residual of each channel is worth, by its autocorrelation; at least four."""
    times = [[r.shape[0] / autocorrelation_time(r[:, c]) for c in range(r.shape[1])] for r in residuals]
    return np.maximum(np.sum(times, axis=0), 4.0)


@dataclass(frozen=True)
class Task:
    """What stays the same in every refit of a diagnosis.

    Attributes
    ----------
    model : str
    runs : sequence of FitRun
        Thinned.
    channels : tuple of str
    values : mapping of str to float
        Values given, by public name.
    preset : str, optional
        Parameter set for the values not given.
    fixed : tuple of str
        Public names that keep their value.
    weights : ndarray, shape (channels,)
        Factor of each channel's residual; empty for one over its spread.
    limits : mapping of str to tuple
        Narrower bounds of parameters by public name.
    pooling : mapping of str to float
        As `Problem.pooling`, by public name; see `nuisance.with_pooled_offsets`.
    discrepancy : ndarray, shape (channels,)
        Model discrepancy: gap of the refitted model on reference runs [RMS]; zero without any. An effect that removes
        no more than that corrects the form of the model.
    steps : ndarray, shape (channels,)
        What the steps of a channel's converter make [RMS]; zero where it has none that matter.
    gap : ndarray, shape (channels,)
        What the refitted baseline leaves [RMS]; zero until it is known.
    reference_removal : mapping of str to ndarray, shape (channels,)
        What a nuisance effect removes on reference runs [RMS], by spec.
    drives : tuple of Drive
        Columns that the runs hold behind the inputs of the model.
    plausible : bool
        Whether refits keep to `Roles.plausible`.
    reference : Fitted or None
        The model with its nuisance effects on reference runs.
    prior : Prior or None
        What a fit to other runs says of the parameters: refits serve those runs too.
    """

    model: str
    runs: Sequence[FitRun]
    channels: tuple[str, ...]
    values: Mapping[str, float]
    preset: str | None = None
    fixed: tuple[str, ...] = ()
    weights: FloatArray = field(default_factory=lambda: np.empty(0))
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    pooling: Mapping[str, float] = field(default_factory=dict)
    discrepancy: FloatArray = field(default_factory=lambda: np.zeros(1))
    steps: FloatArray = field(default_factory=lambda: np.zeros(1))
    gap: FloatArray = field(default_factory=lambda: np.zeros(1))
    reference_removal: Mapping[str, FloatArray] = field(default_factory=dict)
    drives: tuple[Drive, ...] = ()
    plausible: bool = True
    reference: Fitted | None = None
    prior: Prior | None = None

    def kernel(self, effects: Sequence[str]) -> Kernel:
        """The model with effects, with the inputs of the runs."""
        return chain(self.model, tuple(effects), self.drives)

    def limited(self, limits: Mapping[str, tuple[float, float]]) -> Task:
        """A copy with narrower bounds of some parameters, by public name."""
        return replace(self, limits={**self.limits, **limits})


def above_floor(mean_square: FloatArray, steps: FloatArray, discrepancy: FloatArray) -> FloatArray:
    """What is left of a mean square beside the steps of a converter and what a model leaves of its form, both RMS.

    What leaves as much on reference runs as the steps make has these there.
    """
    return mean_square - np.where(discrepancy >= steps, 0.0, steps**2) - discrepancy**2


def refit(
    task: Task, effects: Sequence[str], values: Mapping[str, float], *,
    per_run_values: Mapping[str, FloatArray] | None = None, fixed: Sequence[str] = (), per_run: Sequence[str] = (),
    steps: int = STEPS, released: Sequence[str] = (), scales: Mapping[str, float] | None = None,
    at_most: float = math.inf,
) -> Fitted:  # fmt: skip
    """Fit a model with effects from given values; the result is never worse than the start.

    Parameters
    ----------
    task : Task
    effects : sequence of str
    values : mapping of str to float
        Start values by public name, over those of the task; those that the chain does not have are left out.
    per_run_values : mapping of str to ndarray, shape (runs,), optional
        Start values, by public name, of each run's own parameters.
    fixed : sequence of str
        Public names that keep their start value, besides those of the task.
    per_run : sequence of str
        Public names with a value for each run, besides those that the model declares.
    steps : int
        Of the descent, at most.
    released : sequence of str
        Kept with the result.
    scales : mapping of str to float, optional
        `Fitted.scales` of a fit with values near by: they are not looked for again.
    at_most : float
        Cost that is of use: given up where a few steps do not lead near it.
    """
    kernel = task.kernel(effects)
    known = {v.name for v in kernel.parameters}
    constant = [name for name in (*task.fixed, *fixed) if name in known]
    start_values = {n: v for n, v in {**task.values, **values}.items() if n in known}
    offsets = [name for name in per_run if name in known]
    space = search_space(kernel, task.preset, start_values, constant, per_run=per_run_fields(kernel, offsets=offsets))
    for v in kernel.parameters:
        if v.name in task.limits:
            space = space.with_parameter(v.field, space[v.field].within(*task.limits[v.name]))
    pooling = {v.field: task.pooling[v.name] for v in kernel.parameters if v.name in task.pooling}
    problem = Problem(kernel, list(task.runs), task.channels, space, task.weights, pooling, prior=task.prior)
    start = problem.start()
    for name, values_ in (per_run_values or {}).items():
        if name in known:
            start[:, [problem.declared[f].name for f in problem.fields].index(name)] = values_
    plausible = kernel.roles.plausible if task.plausible else ()
    kept = tuple(c for c in plausible if all(c.met(problem.params(row)) for row in start))
    problem = replace(problem, kept=kept)  # but for what the values given do not meet
    sensitivities = sensitivity_scales(problem.starting_at(start), scales)
    problem = problem.over(problem.space.fixing(_idle(problem, sensitivities)))
    if not problem.space.free:
        raise InputError(
            f"no free parameter of {kernel.name} acts on {', '.join(problem.channels)} in these runs -- "
            "expected at least one -- give runs that move"
        )
    forgotten = _forgotten(problem, start)
    problem = problem.over(problem.space.fixing(forgotten))
    columns = [problem.fields.index(f) for f in forgotten]
    start[:, columns] = np.median(start[:, columns], axis=0)  # no run's own any more: a card has one value
    table = descent(steps, at_most=at_most).refined(problem, start, sensitivities)
    return Fitted(task, tuple(effects), problem, table, tuple(released), sensitivities)


def as_given(task: Task, effects: Sequence[str]) -> Fitted:
    """The model with the values given, nothing fitted but what each run has of its own (offset, initial state)."""
    kernel, runs = task.kernel(effects), task.runs
    per_run = _per_run(kernel, task)
    known = {v.name for v in kernel.parameters}
    values = {n: v for n, v in task.values.items() if n in known}
    space = search_space(kernel, task.preset, values, per_run=per_run).freeing_only(per_run)
    problem = Problem(kernel, list(runs), task.channels, space)
    start = problem.start()
    for run, simulated in zip(runs, problem.outputs_of_all(start), strict=True):
        if not np.isfinite(simulated).all():
            raise InputError(
                f"{task.model} gives no finite output on run {run.name} at the given values -- expected values "
                "from which it can run -- choose others with --set"
            )
    problem = problem.over(problem.space.fixing(_forgotten(problem, start)))
    return Fitted(task, tuple(effects), problem, descent(STEPS).refined(problem, start))


def descent(steps: int, at_most: float = math.inf) -> Descent:
    """How refits descend; one that is to reach the minimum goes on as long as it is under way."""
    under_way = UNDER_WAY_GAIN if steps >= STEPS else math.inf
    return Descent(LEAST_CHANGE, 1e-6, 1e-8, steps, under_way, 1e-5, at_most)


def _per_run(kernel: Kernel, task: Task) -> tuple[str, ...]:
    """Fields of offsets and initial states that each run has of its own, but for those that are to stay."""
    fixed = {v.field for v in kernel.parameters if v.name in task.fixed}
    return tuple(f for f in per_run_fields(kernel) if f not in fixed)


def _forgotten(problem: Problem, start: FloatArray) -> list[str]:
    """States at the start that what is compared hardly remembers: fitted, they would wander."""
    if not any(run.lead_time.size for run in problem.runs):
        return []  # all of each run is compared
    initial, found = problem.kernel.roles.initial, []
    for name in [f for f in problem.per_run if problem.declared[f].name in initial]:
        in_compared, all_ = 0.0, 0.0
        for k, run in enumerate(problem.runs):
            row = start[k].copy()
            row[problem.fields.index(name)] += 1e-6
            moved = problem.outputs_with_lead(k, row) - problem.outputs_with_lead(k, start[k])
            with np.errstate(over="ignore"):  # of a model that runs away: remembered
                change = np.nan_to_num(moved)[:, problem.columns] ** 2
            in_compared, all_ = in_compared + float(change[run.lead_time.size :].sum()), all_ + float(change.sum())
        if in_compared < REMEMBERED_SHARE**2 * all_:
            found.append(name)
    return found


def _idle(problem: Problem, sensitivities: Mapping[str, float]) -> list[str]:
    """Shared parameters that do nothing in these runs."""
    return [name for name in problem.shared if not np.isfinite(sensitivities[name])]
