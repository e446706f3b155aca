"""Nuisance effects: what every refit of a diagnosis may use a little of without anything missing.

A friction model has one shape after a reversal and the rig another; a channel comes a little late, its zero is a
little off. An effect is only missing if it explains what these cannot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...effects import EFFECTS, effect_of, sizes_as, sizes_of, starts_of
from ...kernels.chain import attach
from ...kernels.kernel import kernel
from ...models.contract import InputError
from ...regression.thinning import thinned
from ...regression.threads import together
from ..criteria import (
    NUISANCE_SPREAD_SHARE,
)
from .placing import places_of_effect
from .refit import STEPS, Fitted, Task, refit
from .response import public
from .screening import Screened, screen
from .takeover import Place

SHRUNK = 0.1
NUISANCE_STARTS = 3
"""Shapes from which the nuisance effects of the baseline are refitted."""
FIRST_STEPS = 5
"""Steps of a refit from each of several starts; the best is then refitted on."""
FIRST_ROWS = 4000
"""Samples of all runs together on which these are done."""


@dataclass(frozen=True)
class Start:
    """A fit, and values of one more effect, to start from."""

    fitted: Fitted
    place: Place


def nuisance_specs(model: str, channels: Sequence[str], effects: Sequence[str]) -> tuple[str, ...]:
    """Specs of the nuisance effects of a model that it has not already, in the order of a chain.

    Parameters
    ----------
    model : str
    channels : sequence of str
        Measured ones.
    effects : sequence of str
        Attached already.
    """
    base = kernel(model)
    units = {v.name: v.quantity.unit for v in (*base.outputs, *base.parameters)}
    has_offset = {units[name] for name in base.roles.offsets}
    found = []
    for module in EFFECTS:
        zero = bool(sizes_as(module, "per run"))
        for one in places_of_effect(base, module, channels) if module.ABOUT.role == "nuisance" else []:
            if one.spec not in effects and not (zero and one.channel and units[one.channel] in has_offset):
                found.append((["", *channels].index(one.channel), zero, one.spec))
    found.sort(key=lambda one: one[:2])  # the zero of a channel after what else is done to it
    return tuple(spec for *_, spec in found)


def with_nuisances(base: Fitted, nuisances: Sequence[str]) -> Fitted:
    """A baseline refitted with its nuisance effects."""
    if not nuisances:
        return base
    attached = [attach(kernel(base.model), spec) for spec in nuisances]
    screened = {s.attached.spec: s for s in screen(base, attached)}
    for one in screened.values():
        base = replace(base, task=base.task.limited(one.limits))
    shapes: list[dict[str, float]] = []
    for number in range(NUISANCE_STARTS):
        values: dict[str, float] = {}
        for spec in nuisances:
            choices = screened[spec].starts
            if choices and not sizes_as(effect_of(spec), "per run"):
                values |= choices[min(number, len(choices) - 1)][0]
        if values not in shapes:  # an effect may have a single one
            shapes.append(values)
    starts = [({**base.values, **values}, base.per_run) for values in shapes]
    effects = [*base.effects, *nuisances]  # a few steps do not say which start leads to the deepest valley
    found = min(together(lambda one: best_refit(base, effects, [one], nuisances), starts), key=lambda f: f.cost)
    return with_pooled_offsets(found, nuisances)


def with_pooled_offsets(fitted: Fitted, nuisances: Sequence[str]) -> Fitted:
    """A refit with the offsets of the runs partially pooled: one moves by `NUISANCE_SPREAD_SHARE` of the spread.

    A load that is constant in each run and differs between them is a constant to each run: free offsets would
    take what the law of the load is. The weight of an offset is that of independent samples with what the fit leaves;
    where little noise is left, offsets as far apart as they like cost nothing against what they explain.
    """
    names = offsets(fitted.task, fitted.effects, nuisances, ())[0]
    if len(fitted.problem.runs) < 2 or not names:
        return fitted
    weights = fitted.rmse * fitted.problem.weights
    length = sum(r.targets.shape[0] for r in fitted.problem.runs) / fitted.effective
    zero = NUISANCE_SPREAD_SHARE * fitted.spread
    each = dict(zip(fitted.problem.channels, weights * np.sqrt(length) / zero, strict=True))
    task = replace(fitted.task, pooling={name: float(each[name.partition(".")[0]]) for name in names})
    return again_from(replace(fitted, task=task), nuisances)


def with_free_offsets(fitted: Fitted, nuisances: Sequence[str]) -> Fitted:
    """A refit in which each run has the offset that fits it, nothing pooled."""
    loose = replace(fitted, task=replace(fitted.task, pooling={}))
    return again_from(loose, nuisances)


def begun_with(
    base: Fitted, screened: Screened, nuisances: Sequence[str], second_start: Start | None = None, starts: int = 2,
    steps: int = FIRST_STEPS, scales: Mapping[str, float] | None = None,
) -> Fitted:  # fmt: skip
    """`refit_with` after the first steps from the best of several starts.

    Parameters
    ----------
    base : Fitted
    screened : Screened
    nuisances : sequence of str
    second_start : Start, optional
        A second place to start from: the baseline before its nuisance effects took part of the effect.
    starts : int
        Shapes of the linear step to start from; one less with a second place.
    steps : int
        Of a refit from each, at most.
    scales : mapping of str to float, optional
        As for `refit`.
    """
    base, effects, places, nuisances, released = _with_added_effect(base, screened, nuisances, second_start, starts)
    way = partial(first_steps, steps=steps, scales=scales)
    return _no_worse(base, effects, places, screened, nuisances, released, way)


def refit_with(
    base: Fitted, screened: Screened, nuisances: Sequence[str], second_start: Start | None = None, starts: int = 2,
    steps: int = STEPS, begun: Fitted | None = None,
) -> Fitted:  # fmt: skip
    """A fit with one more effect; a nuisance effect that is there already is released: its drift varies too.

    Parameters
    ----------
    base, screened, nuisances, second_start, starts
        As for `begun_with`.
    steps : int
        Of a refit, at most.
    begun : Fitted, optional
        What `begun_with` gave: of several starts it is the best. Of a single one it is not gone on from: a restart on
        the way may end in another valley.
    """
    base, effects, places, nuisances, released = _with_added_effect(base, screened, nuisances, second_start, starts)
    if begun is not None and len(places) > 1:
        places = [(begun.values, begun.per_run)]
    return _no_worse(base, effects, places, screened, nuisances, released, partial(best_refit, steps=steps))


def _no_worse(
    base: Fitted, effects: Sequence[str], places: Sequence[Place], screened: Screened,
    nuisances: Sequence[str], released: Sequence[str], way: Callable[..., Fitted],
) -> Fitted:  # fmt: skip
    """A refit with one more effect, from where that does a little beside the values of the model if it ends worse.

    A whole linear step can lead into a valley with worse values of the model than those without the effect.
    """
    found: Fitted | None = None
    with suppress(InputError):  # values of the linear step that the chain does not allow
        found = way(base, effects, places, nuisances, released)
    if found is not None and found.cost <= base.cost:
        return found
    sizes = {public(screened.attached, name) for name in sizes_of(screened.attached.module)}
    first, states = screened.starts[0] if screened.starts else ({}, {})
    little = {name: SHRUNK * value if name in sizes else value for name, value in first.items()}
    again = way(base, effects, [_with_values(base, (little, states))], nuisances, released)
    return again if found is None or again.cost < found.cost else found


def _with_added_effect(
    base: Fitted, screened: Screened, nuisances: Sequence[str], second_start: Start | None, starts: int
) -> tuple[Fitted, list[str], list[Place], Sequence[str], list[str]]:
    """What `best_refit` takes for one more effect."""
    spec = screened.attached.spec
    base = replace(base, task=base.task.limited(screened.limits))
    effects = [*base.effects, *([] if spec in base.effects else [spec])]
    number = (starts - 1 if second_start else starts) * (2 if starts_of(screened.attached.module) else 1)
    shapes = screened.starts[:number] or [({}, {})]
    places = [_with_values(base, place) for place in (*shapes, *screened.alone)]
    before = {**base.values, **shrunk_nuisances(base, nuisances)}
    if second_start is not None and second_start.place[0]:
        values, per_run = _with_values(second_start.fitted, second_start.place)
        places.append(({**before, **values}, per_run))
    places += [({**before, **shapes[0][0], **sizes}, base.per_run) for sizes in screened.tries]
    return base, effects, places, nuisances, [*base.released, *([spec] if spec in base.effects else [])]


def _with_values(fitted: Fitted, place: Place) -> Place:
    """Where a refit of a fit with more values starts; where these are of other runs, each run has the middle one."""
    values, states = place
    runs = len(fitted.problem.runs)
    each = {n: v if v.size == runs else np.full(runs, np.median(v)) for n, v in states.items()}
    return {**fitted.values, **values}, {**fitted.per_run, **each}


def shrunk_nuisances(fitted: Fitted, nuisances: Sequence[str]) -> dict[str, float]:
    """Values of the nuisance effects drawn most of the way back to where they change nothing."""
    found = {}
    for spec in nuisances:
        one = attach(kernel(fitted.model), spec)
        for name in sizes_of(one.module):
            found[public(one, name)] = SHRUNK * fitted.values[public(one, name)]
    return found


def refit_without(
    fitted: Fitted, spec: str, nuisances: Sequence[str], start: Place | None = None, kept: Sequence[str] = ()
) -> Fitted:
    """A refit with one effect less.

    Parameters
    ----------
    fitted : Fitted
    spec : str
    nuisances : sequence of str
    start : (mapping, mapping), optional
        Where it starts, instead of the values of the fit.
    kept : sequence of str
        Nuisance effects of which only what was released goes.
    """
    effects = [e for e in fitted.effects if e != spec or e in kept]
    scales = fitted.scales if start is None else None
    start = start or (fitted.values, fitted.per_run)
    released = [e for e in fitted.released if e != spec]
    return best_refit(fitted, effects, [start], nuisances, released, scales=scales)


def other_starts(fitted: Fitted, replaced: Place) -> list[Place]:
    """Where a refit without an effect starts too: from the values of the fit it may not find its way.

    The values of the model as they were given; and those at which its parameters take over what the effect does.
    """
    given = {n: fitted.task.values[n] for n in fitted.values if n in fitted.task.values}
    return [({**fitted.values, **given}, {}), replaced]


def again_from(fitted: Fitted, nuisances: Sequence[str]) -> Fitted:
    """A refit of the same effects from the values of a fit, for a task that may be another."""
    start = (fitted.values, fitted.per_run)
    return best_refit(fitted, fitted.effects, [start], nuisances, fitted.released, scales=fitted.scales)


def best_refit(
    base: Fitted, effects: Sequence[str], starts: Sequence[Place], nuisances: Sequence[str],
    released: Sequence[str] = (), steps: int = STEPS, scales: Mapping[str, float] | None = None,
    at_most: float = math.inf,
) -> Fitted:  # fmt: skip
    """A refit from the best of several starts.

    Parameters
    ----------
    base : Fitted
        Gives the task.
    effects : sequence of str
    starts : sequence of (mapping, mapping)
        Values by public name, and those that each run has of its own.
    nuisances : sequence of str
        Effects that are nuisance effects: their offset has a value a run, their drift none.
    released : sequence of str
        Freedoms whose drift varies.
    steps : int
        Of a refit, at most.
    scales : mapping of str to float, optional
        As for `refit`.
    at_most : float
        As for `refit`.
    """
    if len(starts) > 1:
        begun = first_steps(base, effects, starts, nuisances, released)
        starts, scales = [(begun.values, begun.per_run)], None  # where the first steps end may be far
    return _best_refit_from(base.task, effects, starts, nuisances, released, steps, scales, at_most)


def first_steps(
    base: Fitted, effects: Sequence[str], starts: Sequence[Place], nuisances: Sequence[str],
    released: Sequence[str] = (), steps: int = FIRST_STEPS, scales: Mapping[str, float] | None = None,
) -> Fitted:  # fmt: skip
    """The best of several starts after a few steps on few samples; the fit holds all of them.

    Parameters
    ----------
    base, effects, starts, nuisances, released, steps
        As for `best_refit`.
    scales : mapping of str to float, optional
        As for `refit`.
    """
    task = base.task
    few = replace(task, runs=thinned(kernel(task.model), task.runs, FIRST_ROWS, FIRST_ROWS // 10))
    best = _best_refit_from(few, effects, starts, nuisances, released, steps, scales)
    return replace(best, task=task).at(task.runs)


def _best_refit_from(
    task: Task, effects: Sequence[str], starts: Sequence[Place], nuisances: Sequence[str], released: Sequence[str],
    steps: int, scales: Mapping[str, float] | None = None, at_most: float = math.inf,
) -> Fitted:  # fmt: skip
    """The best refit of those from each start."""
    per_run, fixed = offsets(task, effects, nuisances, released)
    options: dict[str, Any] = {
        "fixed": fixed,
        "per_run": per_run,
        "released": released,
        "steps": steps,
        "scales": scales,
        "at_most": at_most,
    }
    found: list[Fitted] = []
    for values, per_run_start in starts:
        values = {**values, **dict.fromkeys(fixed, 0.0)}  # those of a fit in which they were free are not taken over
        try:
            found.append(refit(task, effects, values, per_run_values=per_run_start, **options))
        except InputError:
            continue  # the values of the linear step are not allowed in the chain
    if not found:
        what = f"{task.model} with {', '.join(effects)}"
        raise InputError(f"{what} cannot run from any value tried -- expected one -- change those given with --set")
    return min(found, key=lambda f: f.cost)


def offsets(
    task: Task, effects: Sequence[str], nuisances: Sequence[str], released: Sequence[str]
) -> tuple[list[str], list[str]]:
    """Public names with a value a run, and those that keep zero."""
    per_run, at_zero = [], []
    for spec in effects:
        if spec in nuisances:
            one = attach(kernel(task.model), spec)
            per_run += [public(one, name) for name in sizes_as(one.module, "per run")]
            at_zero += [public(one, name) for name in sizes_as(one.module, "zero") if spec not in released]
    return per_run, at_zero
