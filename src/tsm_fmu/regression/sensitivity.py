"""How strongly parameters act: finite differences of simulated outputs and residuals, all in one place."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import FloatArray
from .problem import Problem

Simulate = Callable[[Sequence[tuple[int, FloatArray]]], list[FloatArray]]
"""Samples of several (run, row of values), such as `Problem.residuals`."""

OUTPUT_STEP, OUTPUT_LEAST = 1e-4, 1e-3
"""Step for outputs, as part of the value; of a smaller value, of `OUTPUT_LEAST`."""
OFFSET_STEP = 1e-6
"""Step for outputs of a parameter with a value for each run, in its unit."""
SCALED_ROWS = 200_000
"""Rows simulated at once to see what parameters do: what they have in common is simulated once, few are in memory."""
RESIDUAL_STEP = 1e-5
"""Step for residuals, as part of the change that moves the outputs by a standard deviation."""
RESIDUAL_MOST = 1e-3
"""That step is not more than this part of the value."""


@dataclass(frozen=True)
class Perturbation:
    """One parameter moved in every run.

    Attributes
    ----------
    table : ndarray, shape (runs, parameters)
        Values after the move.
    steps : ndarray, shape (runs,)
        How far the variable that is differentiated by has moved in each run.
    columns : ndarray of int, shape (runs,)
        Column of the Jacobian for each run: one for a shared parameter, another for each run otherwise.
    """

    table: FloatArray
    steps: FloatArray
    columns: Sequence[int]


def finite_differences(
    simulate: Simulate, base: Sequence[FloatArray], perturbations: Sequence[Perturbation], columns: int
) -> FloatArray:
    """Jacobian by one simulation of every run for each perturbation, all of them side by side.

    Parameters
    ----------
    simulate : callable
        Samples of each run, of any shape; flattened in the Jacobian.
    base : sequence of ndarray
        The same samples where nothing is moved, by run.
    perturbations : sequence of Perturbation
    columns : int
        Number of columns; those without a perturbation are zero, as are derivatives where the model fails.

    Returns
    -------
    ndarray, shape (sum of samples, columns)
    """
    moved = simulate([(k, row) for p in perturbations for k, row in enumerate(p.table)])
    edges = row_edges(base)
    found = np.zeros((int(edges[-1]), columns), order="F")  # filled by columns
    for number, p in enumerate(perturbations):
        for k, still in enumerate(base):
            change = (moved[number * len(base) + k] - still) / p.steps[k]
            found[edges[k] : edges[k + 1], p.columns[k]] = change.ravel()
    if not np.isfinite(found).all():
        np.nan_to_num(found, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    return found


def row_edges(samples: Sequence[FloatArray]) -> FloatArray:
    """First row of each run where samples stand one run after the other, and the end of the last."""
    return np.cumsum([0, *(one.size for one in samples)])


def residual_jacobian(
    problem: Problem, table: FloatArray, residuals: Sequence[FloatArray], fields: Sequence[str],
    scales: Mapping[str, float],
) -> FloatArray:  # fmt: skip
    """Derivatives of the weighted residuals of all runs by parameter values.

    Parameters
    ----------
    problem : Problem
    table : ndarray, shape (runs, parameters)
    residuals : sequence of ndarray
        Of each run at `table`.
    fields : sequence of str
        Free fields; shared ones have a column each, then each per-run one has a column for every run.
    scales : mapping of str to float
        From `sensitivity_scales`.
    """

    def steps(field: str) -> FloatArray:
        values = table[:, problem.fields.index(field)]
        h = RESIDUAL_STEP * (scales[field] if math.isfinite(scales[field]) else 1.0)
        size = np.where(values != 0.0, np.minimum(h, RESIDUAL_MOST * np.abs(values)), h)
        return np.where(values + size <= problem.space[field].hi, size, -size)

    moves = _moves(problem, table, fields, steps)
    return finite_differences(problem.residuals, residuals, moves, _width(problem, fields))


def output_jacobian(problem: Problem, table: FloatArray, weights: FloatArray) -> FloatArray:
    """Derivatives of the weighted channels of all samples by the free parameter values.

    Parameters
    ----------
    problem : Problem
    table : ndarray, shape (runs, parameters)
    weights : ndarray, shape (channels,)
        Factor of each channel.

    Returns
    -------
    ndarray, shape (samples of all runs and channels, free values)
        Samples by time, then by channel; columns as in `residual_jacobian`.
    """

    def steps(field: str) -> FloatArray:
        values = table[:, problem.fields.index(field)]
        if field in problem.per_run:
            return np.full(values.size, OFFSET_STEP)
        return np.full(values.size, _output_step(problem, table, field))

    moves = _moves(problem, table, problem.space.free, steps)
    still = problem.outputs_of_all(table)
    found = finite_differences(problem.outputs_at, still, moves, _width(problem, problem.space.free))
    channels = len(problem.channels)
    by_channel = found.reshape(len(found) // channels, channels, found.shape[1])  # also without a free parameter
    with np.errstate(divide="ignore"):  # a channel without weight
        return np.ascontiguousarray((by_channel / (1.0 / weights)[:, None]).reshape(found.shape))


def sensitivity_scales(problem: Problem, known: Mapping[str, float] | None = None) -> dict[str, float]:
    """Change of each free parameter that moves the channels by one standard deviation (RMS), at the start values.

    Infinite for a parameter without any effect on these runs.

    Parameters
    ----------
    problem : Problem
    known : mapping of str to float, optional
        Of some fields, from values near by; where these are finite they are taken as they are.
    """
    known = {name: scale for name, scale in (known or {}).items() if math.isfinite(scale)}
    table, free = problem.start(), [name for name in problem.space.free if name not in known]
    steps = {name: _output_step(problem, table, name) for name in free}
    at_once = max(1, SCALED_ROWS // sum(run.time.size for run in problem.runs))
    still: list[FloatArray] = []
    scales = {name: known[name] for name in problem.space.free if name in known}
    for first in range(0, len(free), at_once):
        names = free[first : first + at_once]
        tables = [_moved(table, problem.fields.index(name), steps[name]) for name in names]
        if not still:
            tables.insert(0, table)
        # in one call: simulations have the pieces of a chain in common that no moved parameter is in
        every = problem.outputs_at([(k, row) for t in tables for k, row in enumerate(t)])
        found = [every[k : k + len(table)] for k in range(0, len(every), len(table))]
        still = still or found.pop(0)
        for name, outputs in zip(names, found, strict=True):
            rms = _rms_of_change(problem, still, outputs)
            scales[name] = abs(steps[name]) / rms if 0.0 < rms < math.inf else math.inf
    return scales


def _rms_of_change(problem: Problem, before: Sequence[FloatArray], after: Sequence[FloatArray]) -> float:
    """Of the weighted channels of all runs; what is no number does not count."""
    with np.errstate(over="ignore"):
        squares = [((y - x) * problem.weights) ** 2 for x, y in zip(before, after, strict=True)]
    return math.sqrt(sum(float(np.nansum(one)) for one in squares) / sum(one.size for one in squares))


def _output_step(problem: Problem, table: FloatArray, field: str) -> float:
    """How far a parameter is moved to see what outputs do, away from its upper bound."""
    value = float(table[0, problem.fields.index(field)])
    h = OUTPUT_STEP * max(abs(value), OUTPUT_LEAST)
    return -h if value + h > problem.space[field].hi else h


def _moved(table: FloatArray, column: int, step: float) -> FloatArray:
    found = table.copy()
    found[:, column] += step
    return found


def _moves(
    problem: Problem, table: FloatArray, fields: Sequence[str], steps: Callable[[str], FloatArray]
) -> list[Perturbation]:
    """Each field moved by its steps in all runs at once: runs do not act on each other."""
    shared = [f for f in fields if f not in problem.per_run]
    each = [f for f in fields if f in problem.per_run]
    runs, moves = range(len(problem.runs)), []
    for field in (*shared, *each):
        size, moved = steps(field), table.copy()
        moved[:, problem.fields.index(field)] += size
        first = len(shared) + each.index(field) * len(runs) if field in each else shared.index(field)
        moves.append(Perturbation(moved, size, [first + k * (field in each) for k in runs]))
    return moves


def _width(problem: Problem, fields: Sequence[str]) -> int:
    return sum(len(problem.runs) if f in problem.per_run else 1 for f in fields)
