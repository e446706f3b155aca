"""What a fit found out about its own limits: bounds that held it, conditions, parameters the log says nothing about."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..kernels.arrays import FloatArray
from ..regression.intervals import QUANTILE
from ..regression.problem import Problem
from ..regression.scaled_variables import DECADES
from ..regression.sensitivity import sensitivity_scales
from ..regression.uncertainty import Uncertainty

NEAR = 1e-4
"""A value this close to a bound, in changes that move the outputs by a standard deviation, is on it."""
COLLINEAR = 1e3
"""Condition number of the normalised sensitivities above which the parameters trade against each other."""


def fields_on_bound(problem: Problem, table: FloatArray) -> frozenset[str]:
    """Free fields on a bound of their own, or run away to the end of the searched decades."""
    scales = sensitivity_scales(problem.starting_at(table))
    found = set()
    for name in problem.space.free:
        parameter, values = problem.space[name], table[:, problem.fields.index(name)]
        near = NEAR * scales[name] if math.isfinite(scales[name]) else 0.0
        near = min(near, NEAR * max(abs(parameter.start), float(np.max(abs(values)))))
        found |= {name} if np.any((values - parameter.lo <= near) | (parameter.hi - values <= near)) else set()
        quantity = problem.declared[name].quantity
        if (quantity.lo == 0.0 and quantity.open_lo) or (quantity.hi == 0.0 and quantity.open_hi):
            decades = np.abs(np.log10(np.maximum(abs(values), 1e-300) / abs(parameter.start)))
            found |= {name} if np.any(decades >= 0.99 * DECADES) else set()
    return frozenset(found)


def conditions_met(problem: Problem, table: FloatArray) -> Mapping[str, tuple[str, ...]]:
    """Joint conditions that a small change of a shared parameter would break: what is expected, and the fields."""
    row = table[0]
    scales = sensitivity_scales(problem.starting_at(table))
    touched: dict[str, list[str]] = {}
    for name in problem.shared:
        j, parameter = problem.fields.index(name), problem.space[name]
        change = NEAR * min(scales[name], max(abs(row[j]), abs(parameter.start)))
        for moved in (row[j] - change, row[j] + change):
            trial = row.copy()
            trial[j] = moved
            if parameter.lo < moved < parameter.hi and (condition := problem.unmet(trial)):
                touched.setdefault(condition.expectation(problem.params(trial)), []).append(name)
    return {expected: tuple(dict.fromkeys(fields)) for expected, fields in touched.items()}


def findings(
    problem: Problem,
    table: FloatArray,
    at_bound: frozenset[str],
    conditions: Mapping[str, tuple[str, ...]],
    known: Uncertainty,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Sentences for the user, and the fields that these runs do not determine."""
    sentences = []

    def name(field: str) -> str:
        return problem.declared[field].name

    for field in sorted(at_bound, key=problem.fields.index):
        value = float(table[:, problem.fields.index(field)].mean())
        parameter, unit = problem.space[field], problem.declared[field].quantity.unit
        sentences.append(
            f"{name(field)} = {value:.6g} {unit} is on a bound [{parameter.lo:g}, {parameter.hi:g}]: the model asks "
            "for more, or these runs do not hold it"
        )
    for condition, fields in conditions.items():
        sentences.append(f"the condition {condition} holds the fit: {', '.join(map(name, fields))}")
    undetermined = tuple(f for f in problem.shared if f not in at_bound and _undetermined(problem, table, known, f))
    undetermined += tuple(f for f in problem.per_run if any(math.isnan(run.get(f, 0.0)) for run in known.per_run))
    for field in undetermined:
        error = known.stderr.get(field, math.nan)
        size = "" if math.isnan(error) else f" (standard error {error:.3g})"
        value = float(table[:, problem.fields.index(field)].mean())
        sentences.append(f"{name(field)} = {value:.6g}{size} is not determined by these runs")
    if known.condition_number > COLLINEAR and known.names:
        pairs = np.abs(np.triu(known.correlation, 1))
        i, j = np.unravel_index(int(np.argmax(pairs)), pairs.shape)
        sentences.append(
            f"condition number {known.condition_number:.3g}: the parameters trade against each other, most of all "
            f"{name(known.names[i])} and {name(known.names[j])} (correlation {known.correlation[i, j]:.4f})"
        )
    return tuple(sentences), undetermined


def _undetermined(problem: Problem, table: FloatArray, known: Uncertainty, field: str) -> bool:
    """No finite error, or a 95 % interval that holds zero for a parameter of one sign."""
    error, value = known.stderr[field], float(table[0, problem.fields.index(field)])
    if math.isnan(error):
        return True
    quantity = problem.declared[field].quantity
    return (quantity.lo == 0.0 or quantity.hi == 0.0) and QUANTILE * error >= abs(value)
