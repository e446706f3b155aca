"""The way from a plain model to one that predicts: effect after effect, each judged on runs left out in turn.

A name needs evidence that no other law would do (`supported`); a prediction needs only that runs which were not fitted
come out better. So this way may hold effects that are useful and not named. It takes no part in the verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel, kernel
from ...models.contract import InputError
from ...regression.problem import FitRun
from ...regression.threads import together
from ..criteria import (
    BEGUN_CANDIDATES,
    JUDGED_CANDIDATES,
    LEFT_OUT_PARTS,
    MOST_STEPS,
    PARAMETER_GAIN,
    SURE_GAIN_RATIO,
)
from ..fits.nuisance import FIRST_STEPS, begun_with
from ..fits.refit import Fitted, Task, refit
from ..fits.screening import Screened, screen
from ..runs.prepared import PreparedRuns
from .baselines import refitted_model
from .refits import shortlist
from .search import candidate_places

FOLD_STEPS = 8
FURTHER_STEPS = 30
"""Steps of a refit on the way."""
LAST_STEPS = 60
"""Steps of the refits at its ends."""


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
    """

    added: str
    fitted: Fitted
    left_out: tuple[FloatArray, ...] = field(repr=False)
    whole: FloatArray

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
        """Whether it leaves less on runs left out, by enough for its parameters and beyond chance.

        A model that stops on a run is worth less than any that runs.
        """
        if not (self.runs and before.runs):
            return self.runs
        gain, error = self.gain_over(before)
        added = max(self.parameters - before.parameters, 1)
        return gain > PARAMETER_GAIN * added and gain > SURE_GAIN_RATIO * error

    def gain_over(self, before: Stop) -> tuple[float, float]:
        """How much the log of the mean squares on runs left out is lower, and its standard error over the runs."""
        a, b = np.array(before.left_out), np.array(self.left_out)
        gain = float(np.sum(np.log(a.mean(axis=0) / b.mean(axis=0))))
        count = len(a)
        without = [
            np.sum(np.log(np.delete(a, k, 0).mean(axis=0) / np.delete(b, k, 0).mean(axis=0))) for k in range(count)
        ]
        return gain, float(np.sqrt((count - 1) * np.var(without)))  # jackknife


def way_to_a_better_model(
    runs: PreparedRuns, task: Task, progress: Callable[[str], None] = lambda _: None, answer: Fitted | None = None,
) -> list[Stop]:  # fmt: skip
    """The stops of the way, first the model refitted; then that of the answer, where it leaves less.

    Parameters
    ----------
    runs : PreparedRuns
        At least two measured ones.
    task : Task
        With samples of these.
    progress : callable
        Given what is being done.
    answer : Fitted, optional
        The model of a diagnosis' answer.
    """
    progress("way to a better model: the model refitted")
    whole = runs.measured
    task = replace(task, plausible=False)  # what predicts need not be what a rig has
    way = [_first(task, runs.effects, whole)]
    if answer is not None and set(answer.effects) - set(runs.effects):
        progress("way to a better model: the model of the answer")
        named = _of_answer(way[0], answer, whole)
        if named.is_worth_more_than(way[0]):
            way.append(named)
    while len(way) <= MOST_STEPS:
        progress(f"way to a better model: step {len(way)}")
        best = _next(runs.model, way[-1], whole)
        if best is None or not best.is_worth_more_than(way[-1]):
            break
        way.append(best)
    return _without_idle(way, whole, progress)


def _without_idle(way: Sequence[Stop], whole: Sequence[FitRun], progress: Callable[[str], None]) -> list[Stop]:
    """The way, then without one effect after another that later ones made idle, the last of it refitted to the end."""
    stops = list(way)
    earlier = [e for e in way[-1].fitted.effects if e not in way[0].fitted.effects and e != way[-1].added]
    for spec in earlier:
        progress(f"way to a better model: without {spec}")
        last = stops[-1]
        effects = [e for e in last.fitted.effects if e != spec]
        less = refit(last.fitted.task, effects, last.fitted.values, per_run_values=last.fitted.per_run)
        stop = _judged(f"without {spec}", less, whole)
        if not last.is_worth_more_than(stop):
            stops.append(stop)
    if len(way) > 1:
        refitted = _reweighted(stops[-1].fitted, LAST_STEPS)
        end = replace(stops[-1], fitted=refitted, whole=refitted.at(whole).rmse)
        if end.log_whole < stops[-1].log_whole:
            stops[-1] = end
    return stops


def _first(task: Task, effects: Sequence[str], whole: Sequence[FitRun]) -> Stop:
    """The model refitted, whatever values it was given: a poor start would be mended by effects."""
    plain = _reweighted(refitted_model(task, effects), LAST_STEPS)
    return _judged("", plain, whole)


def _of_answer(first: Stop, answer: Fitted, whole: Sequence[FitRun]) -> Stop:
    """The model of the answer; what each run has of its own is what the model gives it: another's zero is not known."""
    task = first.fitted.task.limited(answer.task.limits)
    own = {name: values for name, values in answer.per_run.items() if name in first.fitted.per_run}
    begun = refit(task, answer.effects, answer.values, per_run_values=own)
    added = [e for e in answer.effects if e not in first.fitted.effects]
    return _judged(" and ".join(added), _reweighted(begun, FURTHER_STEPS), whole)


def _reweighted(fitted: Fitted, steps: int) -> Fitted:
    """Refitted with each channel weighted by the inverse of what is left of it; idle parameters from both sides."""
    task = replace(fitted.task, weights=1.0 / np.maximum(fitted.rmse, 1e-6 * fitted.spread))
    found = refit(task, fitted.effects, fitted.values, per_run_values=fitted.per_run, steps=steps)
    return min((found, *_begun_anew(found, steps)), key=_log_left)


def _begun_anew(fitted: Fitted, steps: int) -> Iterator[Fitted]:
    """Where some of the model's own parameters do nothing: refitted with these begun anew, and with all of its own.

    From those given or the usual ones. A model that lacks an effect drives them there, and no descent leads them back
    when it has that effect.
    """
    problem, own = fitted.problem, [v for v in kernel(fitted.model).parameters if v.kind is not int]
    acting = {*problem.shared, *problem.per_run}
    idle = {v.name for v in own if v.field not in acting and v.name not in fitted.task.fixed}
    for anew in (idle, {v.name for v in own}) if idle else ():
        values = {name: value for name, value in fitted.values.items() if name not in anew}
        per_run = {name: one for name, one in fitted.per_run.items() if name not in anew}
        with suppress(InputError):  # with the others where they are
            yield refit(fitted.task, fitted.effects, values, per_run_values=per_run, steps=steps)


def _judged(added: str, fitted: Fitted, whole: Sequence[FitRun]) -> Stop:
    """With what is left on runs left out in turn, and on all samples of the runs."""
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
    return Stop(added, fitted, tuple(found), fitted.at(whole).rmse)


def _next(model: Kernel, at: Stop, whole: Sequence[FitRun]) -> Stop | None:
    """The best step on: the effect, or choice of the model, that gains most on runs left out, for its parameters."""
    fitted = at.fitted
    places = [c for c in candidate_places(model, fitted) if c.spec not in fitted.effects]
    screened = shortlist(screen(fitted, places), BEGUN_CANDIDATES)

    def begun(s: Screened) -> tuple[str, Fitted] | None:
        try:
            return s.attached.spec, begun_with(fitted, s, ())
        except InputError:
            return None

    tried = [one for one in together(begun, screened) if one is not None]
    for name, value in _choices(fitted):
        other = refit(fitted.task, fitted.effects, {**fitted.values, name: value}, steps=FIRST_STEPS)
        tried.append((f"{name} = {value:g}", other))
    tried.sort(key=lambda one: _log_left(one[1]))

    def refitted(one: tuple[str, Fitted]) -> Stop:
        return _judged(one[0], _reweighted(one[1], FURTHER_STEPS), whole)

    stops = together(refitted, tried[:JUDGED_CANDIDATES])
    # one that leaves more of the very runs that it was fitted to was not fitted, as it holds the model before it; and
    # what leaves less of the search's samples alone fits what lies between them
    stops = [s for s in stops if s.runs and _log_left(s.fitted) < _log_left(fitted) and s.log_whole < at.log_whole]
    return max(stops, key=lambda s: s.gain_over(at)[0] - PARAMETER_GAIN * s.parameters, default=None)


def _choices(fitted: Fitted) -> list[tuple[str, int]]:
    """Other values of the model's own choices."""
    found = []
    for v in kernel(fitted.model).parameters:
        if v.kind is int and v.quantity.choices and v.name not in fitted.task.fixed:
            now = int(fitted.values[v.name])
            found += [(v.name, k) for k in range(int(v.quantity.lo), int(v.quantity.hi) + 1) if k != now]
    return found


def _log_left(fitted: Fitted) -> float:
    """Sum over the channels of the log of what is left; infinite where the model stops."""
    left = float(np.sum(np.log(fitted.rmse / fitted.spread)))
    return np.inf if np.isnan(left) else left
