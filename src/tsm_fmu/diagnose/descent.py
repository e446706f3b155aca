"""Bounded least squares of a model's parameters against runs, from one start."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from scipy.optimize import least_squares

from ..identify.coordinates import Coordinates
from ..identify.problem import FloatArray, Problem
from ..identify.structure import sensitivity_scales

STEPS = 15
"""Steps of one refit at most."""
NONE: Mapping[str, float] = MappingProxyType({})
TOLERANCE = 1e-4
"""A refit ends when a step changes the sum of squares by less than this part; gaps are compared to a hundredth."""


def cost(problem: Problem, table: FloatArray, zeros: Mapping[str, float] = NONE) -> float:
    """Weighted sum of squares; infinite where the model stops."""
    total = sum(float(np.sum(problem.residual(k, table[k]) ** 2)) for k in range(len(problem.runs)))
    total += float(np.sum(apart(problem, table, zeros) ** 2))
    return total if np.isfinite(total) else np.inf


def apart(problem: Problem, table: FloatArray, zeros: Mapping[str, float]) -> FloatArray:
    """How far the runs' own zeros are from their mean, weighted; see `freedom.tied`."""
    columns = [(problem.fields.index(f), zeros.get(problem.declared[f].name, 0.0)) for f in problem.own]
    return np.concatenate([np.empty(0), *(w * (table[:, j] - table[:, j].mean()) for j, w in columns if w > 0.0)])


def descended(
    problem: Problem, start: FloatArray, steps: int = STEPS, sensitivities: Mapping[str, float] | None = None,
    zeros: Mapping[str, float] = NONE,
) -> FloatArray:  # fmt: skip
    """Bounded least squares from a start, all free parameters searched; never worse than the start.

    Parameters
    ----------
    problem : Problem
    start : ndarray, shape (runs, parameters)
    steps : int
    sensitivities : mapping of str to float, optional
        `sensitivity_scales` at the start, where they are known.
    zeros : mapping of str to float
        Weight, by public name, of how far a value that each run has of its own is from their mean.
    """
    if not problem.shared and not problem.own:
        return start
    sensitivities = sensitivities or sensitivity_scales(problem.starting_at(start))
    scales = _scales(problem, start, sensitivities)
    own = [f for f in problem.own if np.isfinite(sensitivities[f])]  # the others would wander
    if not problem.shared and not own:
        return start
    coordinates = Coordinates(problem, problem.shared, own, scales, start)
    last: list[FloatArray] = []  # where it was evaluated last, and what came out

    def residual(q: FloatArray) -> FloatArray:
        table = coordinates.table(q)
        values = np.concatenate([*problem.residuals(list(enumerate(table))), apart(problem, table, zeros)])
        last[:] = [q.copy(), np.nan_to_num(values, nan=1e6, posinf=1e6, neginf=-1e6)]
        return last[1]

    def jacobian(q: FloatArray) -> FloatArray:
        base = last[1] if last and np.array_equal(last[0], q) else residual(q)
        columns = np.zeros((base.size, q.size), order="F")  # filled by columns
        for axes in _together(coordinates):
            moved, steps = q.copy(), np.zeros(q.size)
            for i in axes:
                steps[i] = 1e-5 if q[i] + 1e-5 <= coordinates.hi[i] else -1e-5
                moved[i] += steps[i]
            change = residual(moved) - base
            for i in axes:
                rows = slice(None) if coordinates.axes[i].run is None else _rows(problem, coordinates.axes[i].run)
                columns[rows, i] = change[rows] / steps[i]
                if zeros and coordinates.axes[i].run is not None:  # of these, one run's value acts on all rows
                    alone = q.copy()
                    alone[i] += steps[i]
                    tie = apart(problem, coordinates.table(alone), zeros) - apart(problem, coordinates.table(q), zeros)
                    columns[columns.shape[0] - tie.size :, i] = tie / steps[i]
        return columns

    try:
        found = least_squares(
            residual, coordinates.of(start), jac=jacobian, bounds=(coordinates.lo, coordinates.hi),  # pyright: ignore
            x_scale="jac", ftol=TOLERANCE, xtol=1e-6, gtol=1e-8, max_nfev=steps,
        )  # fmt: skip
    except (ValueError, np.linalg.LinAlgError):
        return start
    table = coordinates.table(found.x)
    return table if cost(problem, table, zeros) <= cost(problem, start, zeros) else start


def _scales(problem: Problem, start: FloatArray, sensitivities: Mapping[str, float]) -> dict[str, float]:
    """Sensitivity scales; not beyond ten times the value of a positive parameter, where a slope means nothing."""
    scales = {name: sensitivities[name] for name in (*problem.shared, *problem.own)}
    for name, scale in scales.items():
        declared = problem.declared[name]
        size = 10.0 * max(abs(float(start[0, problem.fields.index(name)])), abs(declared.start))
        if declared.quantity.lo == 0.0 and size > 0.0:
            scales[name] = min(scale, size)
    return scales


def _together(coordinates: Coordinates) -> list[list[int]]:
    """Axes that can be moved at once: the same field of different runs."""
    groups: dict[tuple[str, bool], list[int]] = {}
    for i, axis in enumerate(coordinates.axes):
        groups.setdefault((axis.field, axis.run is None), []).append(i)
    return list(groups.values())


def _rows(problem: Problem, run: int | None) -> slice:
    sizes = [-(-r.targets.shape[0] // problem.block) * r.targets.shape[1] for r in problem.runs]
    edge = int(np.sum(sizes[: run or 0]))
    return slice(edge, edge + sizes[run or 0])
