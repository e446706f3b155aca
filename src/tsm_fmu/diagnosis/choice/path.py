"""The way from a plain model to one that predicts: effect after effect, each judged on runs left out in turn.

A name needs evidence that no other law would do (`supported`); a prediction needs only that runs which were not fitted
come out better. So this way may hold effects that are useful and not named. It takes no part in the verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ...kernels.kernel import Kernel, kernel
from ...models.contract import InputError
from ...regression.threads import together
from ..criteria import BEGUN_CANDIDATES, JUDGED_CANDIDATES, MOST_STEPS, PARAMETER_GAIN, REVISITED_STEPS
from ..fits.nuisance import FIRST_STEPS, begun_with
from ..fits.refit import Fitted, Task, refit
from ..fits.screening import Screened, screen
from ..runs.prepared import PreparedRuns
from .baselines import refitted_model
from .refits import shortlist
from .search import candidate_places
from .stop import Samples, Stop, judged, log_left, must_gain

FURTHER_STEPS = 30
"""Steps of a refit on the way."""
LAST_STEPS = 60
"""Steps of the refits at its ends."""


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
    task = replace(task, plausible=False)  # what predicts need not be what a rig has
    samples = Samples.of(runs.model, task, runs.measured)
    way = [_first(task, runs.effects, samples)]
    if answer is not None and set(answer.effects) - set(runs.effects):
        progress("way to a better model: the model of the answer")
        named = _of_answer(way[0], answer, samples)
        if named.is_worth_more_than(way[0]):
            way.append(named)
    way = _to_its_end(runs.model, way, samples, progress)
    gone = [_names(way)]
    for back in range(1, REVISITED_STEPS + 1):
        begun = _other_turn(way, back)
        if not begun or any(names[: len(begun)] == _names(begun) for names in gone):
            continue
        progress(f"way to a better model: {begun[-1].added} in place of {way[-back].added}")
        other = _to_its_end(runs.model, begun, samples, progress)
        gone.append(_names(other))
        if other[-1].is_worth_more_than(way[-1]):
            way = other
    return _without_idle(way, samples, progress)


def _names(way: Sequence[Stop]) -> list[str]:
    return [stop.added for stop in way]


def _to_its_end(
    model: Kernel, begun: Sequence[Stop], samples: Samples, progress: Callable[[str], None]
) -> list[Stop]:  # fmt: skip
    """The way from where it stands until no step is worth more."""
    way = list(begun)
    while len(way) <= MOST_STEPS:
        progress(f"way to a better model: step {len(way)}")
        best = _next(model, way, samples)
        if best is None or not best.is_worth_more_than(way[-1]):
            progress("way to a better model: what nearly came, in place of what did")
            best = _exchanged(way, samples)
        if best is None:
            break
        way.append(best)
    return way


def _other_turn(way: Sequence[Stop], back: int) -> list[Stop]:
    """The way until so many steps before its end, with what was second best there; empty where that gained nothing.

    What gains most at a step may fit what a later one would have: no further step is worth more then.
    """
    if len(way) <= back:
        return []
    taken, before = way[-back], way[-back - 1]
    rival = taken.next_best
    if rival is None or not rival.is_worth_more_than(before):
        return []
    return [*way[:-back], replace(rival, next_best=replace(taken, next_best=None))]


def _without_idle(way: Sequence[Stop], samples: Samples, progress: Callable[[str], None]) -> list[Stop]:
    """The way, then without one effect after another that later ones made idle, the last of it refitted to the end."""
    stops = list(way)
    earlier = [e for e in way[-1].fitted.effects if e not in way[0].fitted.effects and e != way[-1].added]
    for spec in earlier:
        progress(f"way to a better model: without {spec}")
        last = stops[-1]
        effects = [e for e in last.fitted.effects if e != spec]
        searched = samples.searched(last.fitted)
        less = refit(searched.task, effects, searched.values, per_run_values=searched.per_run)
        stop = judged(f"without {spec}", samples.refined(less), samples)
        if stop.is_simpler_and_as_good_as(last, PARAMETER_GAIN):
            stops.append(stop)
    if len(way) > 1:
        refitted = samples.refined(_reweighted(samples.searched(stops[-1].fitted), LAST_STEPS))
        end = replace(stops[-1], fitted=refitted, whole=refitted.at(samples.whole).rmse)
        if end.log_whole < stops[-1].log_whole:
            stops[-1] = end
    return stops


def _first(task: Task, effects: Sequence[str], samples: Samples) -> Stop:
    """The model refitted, whatever values it was given: a poor start would be mended by effects."""
    plain = _reweighted(refitted_model(task, effects), LAST_STEPS)
    return judged("", samples.refined(plain), samples)


def _of_answer(first: Stop, answer: Fitted, samples: Samples) -> Stop:
    """The model of the answer; what each run has of its own is what the model gives it: another's zero is not known."""
    task = samples.searched(first.fitted).task.limited(answer.task.limits)
    own = {name: values for name, values in answer.per_run.items() if name in first.fitted.per_run}
    begun = refit(task, answer.effects, answer.values, per_run_values=own)
    added = [e for e in answer.effects if e not in first.fitted.effects]
    return judged(" and ".join(added), samples.refined(_reweighted(begun, FURTHER_STEPS)), samples)


def _reweighted(fitted: Fitted, steps: int) -> Fitted:
    """Refitted with each channel weighted by the inverse of what is left of it; idle parameters from both sides."""
    task = replace(fitted.task, weights=1.0 / np.maximum(fitted.rmse, 1e-6 * fitted.spread))
    found = refit(task, fitted.effects, fitted.values, per_run_values=fitted.per_run, steps=steps)
    return min((found, *_begun_anew(found, steps)), key=log_left)


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


def _next(model: Kernel, way: Sequence[Stop], samples: Samples) -> Stop | None:
    """The best step on: the effect, or choice of the model, that gains most on runs left out, for its parameters."""
    at = way[-1]
    fitted = samples.searched(at.fitted)
    places = [c for c in candidate_places(model, fitted) if c.spec not in fitted.effects]
    screened = shortlist(screen(fitted, places), BEGUN_CANDIDATES)

    def begun(s: Screened) -> tuple[str, Fitted] | None:
        try:
            return s.attached.spec, begun_with(fitted, s, ())
        except InputError:
            return None

    tried = [one for one in together(begun, screened) if one is not None]
    tried.sort(key=lambda one: log_left(one[1]))
    tried = tried[:JUDGED_CANDIDATES]
    for name, value in _choices(way):  # each is judged: a few steps do not lead from one way of a model to another
        other = refit(fitted.task, fitted.effects, {**fitted.values, name: value}, steps=FIRST_STEPS)
        tried.append((f"{name} = {value:g}", other))

    def refitted(one: tuple[str, Fitted]) -> Stop | None:
        found = samples.refined(_reweighted(one[1], FURTHER_STEPS))
        gain = 2.0 * (log_left(at.fitted) - log_left(found))
        least = must_gain(len(found.problem.shared) - at.parameters)
        # of runs left out it gains no more than of the very runs that it is fitted to
        return judged(one[0], found, samples) if gain > least else None

    # what leaves less of the search's samples alone fits what lies between them
    stops = [s for s in together(refitted, tried) if s is not None and s.runs and s.log_whole < at.log_whole]
    stops.sort(key=lambda s: -s.worth_over(at))
    return replace(stops[0], next_best=stops[1] if len(stops) > 1 else None) if stops else None


def _exchanged(way: Sequence[Stop], samples: Samples) -> Stop | None:
    """The best model with what was second best at a step in place of the effect that was taken there.

    What was best alone, as a law that bends to anything, may not be beside what came after it. None where none is worth
    more than the last one of the way, or as much with fewer parameters.
    """
    last = way[-1]
    there = last.fitted.effects

    def exchanged(stop: Stop) -> Stop | None:
        rival, searched = stop.next_best, samples.searched(last.fitted)
        if rival is None or rival.added in there or stop.added not in there:
            return None
        added = [e for e in rival.fitted.effects if e == rival.added]
        chosen = {name: value for name, value in rival.fitted.values.items() if f"{name} = {value:g}" == rival.added}
        if chosen.items() <= searched.values.items() and not added:
            return None  # the way has chosen so since
        effects = [*(e for e in there if e != stop.added), *added]
        task = searched.task.limited({**rival.fitted.task.limits, **searched.task.limits})
        values = {**rival.fitted.values, **searched.values, **chosen}
        own = {**rival.fitted.per_run, **searched.per_run}
        try:
            begun = refit(task, effects, values, per_run_values=own, steps=FIRST_STEPS)
        except InputError:
            return None  # values of the two that a model may not have together
        fitted = samples.refined(_reweighted(begun, FURTHER_STEPS))
        return judged(f"{rival.added} and without {stop.added}", fitted, samples)

    def is_taken(one: Stop) -> bool:
        return one.is_worth_more_than(last) or one.is_simpler_and_as_good_as(last)

    found = [one for one in together(exchanged, way[1:-1]) if one is not None and is_taken(one)]
    return max(found, key=lambda s: s.worth_over(last), default=None)


def _choices(way: Sequence[Stop]) -> list[tuple[str, int]]:
    """Values of the model's own choices that the way has not had."""
    found, fitted = [], way[-1].fitted
    for v in kernel(fitted.model).parameters:
        if v.kind is int and v.quantity.choices and v.name not in fitted.task.fixed:
            had = {int(stop.fitted.values[v.name]) for stop in way}
            found += [(v.name, k) for k in range(int(v.quantity.lo), int(v.quantity.hi) + 1) if k not in had]
    return found
