"""One place of the way to a better model: a fit, judged on runs left out in turn and on all samples of the runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel, kernel
from ...regression.problem import FitRun
from ..criteria import LEFT_OUT_PARTS, PARAMETER_GAIN, SURE_GAIN_RATIO, WAY_SAMPLES_RATIO
from ..fits.refit import Fitted, Task, refit
from ..runs.thinning import thinned_for_search

FOLD_STEPS = 8
"""Steps of a refit with runs left out."""
UNSEEN_CHANGE = 1e-4
"""Change of the sum of squares at which refits end."""
MORE_STEPS = 8
"""Steps of a refit on more samples, from where that on few ended."""


@dataclass(frozen=True)
class Samples:
    """The measured runs at three samplings.

    A model that holds its load takes what lies between samples: what fits few of them best may not fit the others.

    Attributes
    ----------
    few : sequence of FitRun
        Those of the search: candidates are begun on these.
    more : sequence of FitRun
        Those that are judged are refitted on these, and left out.
    whole : sequence of FitRun
        All of them.
    """

    few: Sequence[FitRun]
    more: Sequence[FitRun]
    whole: Sequence[FitRun]

    @classmethod
    def of(cls, model: Kernel, task: Task, whole: Sequence[FitRun]) -> Samples:
        """Those of a task, which the search works on, and of the runs that these are of."""
        more = thinned_for_search(model, whole, task.channels, WAY_SAMPLES_RATIO)
        return cls(task.runs, more, whole)

    def searched(self, fitted: Fitted) -> Fitted:
        """A copy with the values found, on few samples."""
        return replace(fitted, task=replace(fitted.task, runs=self.few)).at(self.few)

    def refined(self, fitted: Fitted) -> Fitted:
        """The same refitted on more samples."""
        task = replace(fitted.task, runs=self.more)
        found = refit(task, fitted.effects, fitted.values, per_run_values=fitted.per_run, steps=MORE_STEPS)
        return with_usual_values(found)


def with_usual_values(fitted: Fitted) -> Fitted:
    """A copy in which the model's own parameters that change next to nothing have the values given, or the usual ones.

    They wander while a model lacks an effect. On samples where they act, as the damping of bristles within a reversal
    that few samples jump over, a value out of all bounds would be all that is seen.
    """
    problem, table, model = fitted.problem, fitted.table, kernel(fitted.model)
    usual = model.named(model.params(fitted.task.preset)) | dict(fitted.task.values)
    for v in model.parameters:
        bounds = problem.space[v.field]
        if v.kind is int or v.field in problem.per_run or not bounds.lo <= usual[v.name] <= bounds.hi:
            continue
        tried = table.copy()
        tried[:, problem.fields.index(v.field)] = usual[v.name]
        allowed = all(c.met(problem.params(row)) for row in tried for c in problem.kernel.conditions)
        if allowed and problem.cost(tried) < (1.0 + UNSEEN_CHANGE) * fitted.cost:
            table = tried
    return replace(fitted, table=table)


@dataclass(frozen=True)
class Stop:
    """The model at one place of the way.

    Attributes
    ----------
    added : str
        What was added last: an effect as ``id`` or ``id@channel``, those of the answer joined by "and", or ``parameter
        = value`` of a model's choice; empty at the start.
    fitted : Fitted
    left_out : tuple of ndarray, shape (channels,)
        Mean square on each run when it was left out.
    whole : ndarray, shape (channels,)
        RMS on all samples of the measured runs; the search works on a part of them.
    next_best : Stop or None
        The second best at this step.
    """

    added: str
    fitted: Fitted
    left_out: tuple[FloatArray, ...] = field(repr=False)
    whole: FloatArray
    next_best: Stop | None = field(default=None, repr=False)

    @cached_property
    def left_out_rms(self) -> FloatArray:
        """RMS over the runs left out, by channel."""
        return np.sqrt(np.mean(self.left_out, axis=0))

    @property
    def log_whole(self) -> float:
        """Sum over the channels of the log of what is left on all samples."""
        return float(np.sum(np.log(self.whole)))

    @property
    def runs(self) -> bool:
        """Whether the model gives numbers on all runs, left out or not."""
        return bool(np.isfinite(self.whole).all() and np.isfinite(np.array(self.left_out)).all())

    @property
    def parameters(self) -> int:
        """Fitted parameters that all runs share."""
        return len(self.fitted.problem.shared)

    def is_worth_more_than(self, before: Stop) -> bool:
        """Whether it leaves less on runs left out, by enough for its parameters and beyond chance."""
        return self.worth_over(before) > 0.0

    def worth_over(self, before: Stop) -> float:
        """What it gains for sure over another on runs left out, less what its parameters must.

        A model that stops on a run is worth less than any that runs.
        """
        if not (self.runs and before.runs):
            return np.inf if self.runs else -np.inf
        gain, error = self.gain_over(before)
        return gain - SURE_GAIN_RATIO * error - must_gain(self.parameters - before.parameters)

    def is_simpler_and_as_good_as(self, other: Stop, worth_of_each: float = 0.0) -> bool:
        """Whether it has fewer parameters and leaves no more on runs left out, but for so much for each of these."""
        spared = other.parameters - self.parameters
        return self.runs and spared > 0 and self.gain_over(other)[0] > -worth_of_each * spared

    def gain_over(self, before: Stop) -> tuple[float, float]:
        """How much the log of the mean squares on runs left out is lower, and its standard error over the runs."""
        a, b = np.array(before.left_out), np.array(self.left_out)
        gain = float(np.sum(np.log(a.mean(axis=0) / b.mean(axis=0))))
        count = len(a)
        without = [
            np.sum(np.log(np.delete(a, k, 0).mean(axis=0) / np.delete(b, k, 0).mean(axis=0))) for k in range(count)
        ]
        return gain, float(np.sqrt((count - 1) * np.var(without)))  # jackknife


def judged(added: str, fitted: Fitted, samples: Samples) -> Stop:
    """A fit on more samples, with what is left on runs left out in turn, and on all samples of the runs."""
    runs = fitted.problem.runs
    found: list[FloatArray] = [np.empty(0)] * len(runs)
    for part in range(min(LEFT_OUT_PARTS, len(runs))):
        kept = [k for k in range(len(runs)) if k % LEFT_OUT_PARTS != part]
        task = replace(fitted.task, runs=[runs[k] for k in kept])
        own = {name: values[kept] for name, values in fitted.per_run.items()}
        less = refit(task, fitted.effects, fitted.values, per_run_values=own, steps=FOLD_STEPS)
        out = range(part, len(runs), LEFT_OUT_PARTS)
        for k, residual in zip(out, less.held_out_errors([runs[k] for k in out]), strict=True):
            found[k] = np.mean(residual**2, axis=0)
    return Stop(added, fitted, tuple(found), fitted.at(samples.whole).rmse)


def must_gain(parameters: int) -> float:
    """Log of the mean squares that a step of so many further parameters must gain; of none as much as of one."""
    return PARAMETER_GAIN * max(parameters, 1)


def log_left(fitted: Fitted) -> float:
    """Sum over the channels of the log of what is left; infinite where the model stops."""
    left = float(np.sum(np.log(fitted.rmse / fitted.spread)))
    return np.inf if np.isnan(left) else left
