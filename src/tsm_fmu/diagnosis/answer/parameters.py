"""Parameters of the answer: their values at each stage, what moved, what stands at a bound, and the card."""

from __future__ import annotations

import numpy as np

from ...card import CardParameter, ModelCard, Provenance, RecordUsed, utc_now
from ...effects import sizes_of
from ...kernels.chain import attach
from ...kernels.kernel import kernel
from ...regression.card_errors import correlation
from ...regression.uncertainty import uncertainty
from ..criteria import CHANGED_SHARE, WEIGHTY_SHARE
from ..evidence import ModelFit, ParameterChange, ParameterValue
from ..fits.refit import Fitted
from ..fits.response import public


def model_fit(fitted: Fitted) -> ModelFit:
    """A fit as plain data."""
    declared = {v.name: v.quantity for v in fitted.problem.kernel.parameters}
    values = (ParameterValue(n, x, declared[n].unit, declared[n].meaning) for n, x in fitted.values.items())
    return ModelFit(fitted.model, tuple(fitted.effects), tuple(values))


def changes_of(given: Fitted, final: Fitted) -> tuple[ParameterChange, ...]:
    """Parameters that a fit moved away from their given values: first whose move does most to the channels."""
    before, after = given.values, final.values
    names = [v for v in final.problem.kernel.parameters if v.field in final.problem.shared and v.name in before]
    moved = [
        v for v in names
        if abs(after[v.name] - before[v.name]) > CHANGED_SHARE * max(abs(before[v.name]), abs(after[v.name]))
    ]  # fmt: skip
    found = [
        ParameterChange(v.name, v.quantity.unit, before[v.name], after[v.name], _undone(final, v.field, before[v.name]))
        for v in moved
    ]
    least = WEIGHTY_SHARE * max((c.effect for c in found if np.isfinite(c.effect)), default=0.0)
    return tuple(sorted((c for c in found if c.effect >= least), key=lambda c: -c.effect))


def _undone(final: Fitted, field: str, value: float) -> float:
    """Largest change of a channel if one parameter alone had its old value; infinite where the others forbid it."""
    change = final.change_with({field: value})
    return float(np.where(np.isnan(change), np.inf, change).max())


def bound_notes(refitted: Fitted, final: Fitted) -> tuple[str, ...]:
    """Free parameters that the refit, or only the answer's fit, has at a bound, one sentence each.

    An effect's size at zero is not at a bound: the effect is not there.
    """
    before, after = _at_bounds(refitted), _at_bounds(final)
    notes = [f"the refit stopped at a bound of {name} ({value:g})" for name, value in before.items()]
    notes += [f"the answer's fit stopped at a bound of {n} ({x:g})" for n, x in after.items() if n not in before]
    return tuple(notes)


def _at_bounds(fitted: Fitted) -> dict[str, float]:
    found, problem = {}, fitted.problem
    attached = [attach(kernel(fitted.model), spec) for spec in fitted.effects]
    sizes = {public(one, size) for one in attached for size in sizes_of(one.module)}
    for name in problem.shared:
        p, value = problem.space[name], float(fitted.table[0, problem.fields.index(name)])
        width = p.hi - p.lo
        near = 1e-4 * width if np.isfinite(width) else 1e-6 * max(1.0, abs(value))
        absent = problem.declared[name].name in sizes and abs(value) < near
        if not absent and (value - p.lo < near or p.hi - value < near):
            found[problem.declared[name].name] = value
    return found


def per_run_values(fitted: Fitted) -> list[dict[str, float]]:
    """By public name, the parameters of which each run has a value of its own."""
    columns = {fitted.problem.declared[f].name: fitted.problem.fields.index(f) for f in fitted.problem.per_run}
    return [{name: float(row[j]) for name, j in columns.items()} for row in fitted.table]


def card_of(final: Fitted, records: tuple[RecordUsed, ...], preset: str, seed: int, errors: bool = True) -> ModelCard:
    """The model of the answer as a card, with the errors of its fit unless they are not wanted (``errors``).

    They are those of the parameters of this model: that it is the right one they take for granted.
    """
    problem, values, parameters = final.problem, final.values, {}
    on_bound = frozenset(f for f in problem.shared if problem.declared[f].name in _at_bounds(final))
    known = uncertainty(problem, final.table, on_bound) if errors and problem.shared else None
    stated = {} if known is None else {f: e for f, e in known.stderr.items() if np.isfinite(e)}
    for variable in problem.kernel.parameters:
        p, error = problem.space[variable.field], stated.get(variable.field)
        value = min(max(values[variable.name], p.lo), p.hi)
        parameters[variable.name] = CardParameter(value, variable.quantity.unit, error, p.lo, p.hi, not p.free)
    per_run = (
        dict(zip((run.name for run in problem.runs), per_run_values(final), strict=True)) if problem.per_run else {}
    )
    provenance = Provenance(records, seed=seed, date=utc_now(), method="diagnose")
    at = {v.field: parameters[v.name].value for v in problem.kernel.parameters}
    together = None if known is None else correlation(problem.kernel, known, stated, at)
    return ModelCard(final.model, preset, tuple(final.effects), parameters, per_run, provenance, correlation=together)
