"""Bounded least squares of a model's parameters against runs, from one start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from scipy.linalg import qr
from scipy.optimize import least_squares

from .coordinates import Coordinates
from .problem import FloatArray, Problem
from .structure import sensitivity_scales

STEPS = 15
"""Steps of one refit at most."""
NONE: Mapping[str, float] = MappingProxyType({})
TOLERANCE = 1e-4
"""A refit ends when a step changes the sum of squares by less than this part; gaps are compared to a hundredth."""


def cost(problem: Problem, table: FloatArray, zeros: Mapping[str, float] = NONE) -> float:
    """Weighted sum of squares; infinite where the model stops."""
    total = sum(float(np.sum(r**2)) for r in problem.residuals(list(enumerate(table))))
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
    turned = Turned(problem, coordinates, zeros)
    try:
        found = least_squares(
            turned.residual, coordinates.of(start), jac=turned.jacobian,  # pyright: ignore
            bounds=(coordinates.lo, coordinates.hi), x_scale="jac", ftol=TOLERANCE, xtol=1e-6, gtol=1e-8,
            max_nfev=steps,
        )  # fmt: skip
    except (ValueError, np.linalg.LinAlgError):
        return start
    table = coordinates.table(found.x)
    return table if cost(problem, table, zeros) <= cost(problem, start, zeros) else start


class Turned:
    """Residuals turned so that all of them is their norm, in the first row: the same problem in few rows.

    Norms, slopes and steps are those of all residuals; only the optimiser's matrices shrink from samples to parameters.

    Parameters
    ----------
    problem : Problem
    coordinates : Coordinates
        What is searched.
    zeros : mapping of str to float
        See `descended`.
    """

    def __init__(self, problem: Problem, coordinates: Coordinates, zeros: Mapping[str, float]) -> None:
        self.problem, self.coordinates, self.zeros = problem, coordinates, zeros
        self._last: tuple[FloatArray, FloatArray] | None = None  # where it was evaluated last, and what came out

    def residual(self, q: FloatArray) -> FloatArray:
        turned = np.zeros(q.size + 1)
        turned[0] = np.linalg.norm(self._at(q))
        return turned

    def jacobian(self, q: FloatArray) -> FloatArray:
        return triangle(self._at(q), self._slopes(q))

    def _at(self, q: FloatArray) -> FloatArray:
        if self._last is None or not np.array_equal(self._last[0], q):
            self._last = q.copy(), self._residuals([self.coordinates.table(q)])[0]
        return self._last[1]

    def _residuals(self, tables: Sequence[FloatArray]) -> list[FloatArray]:
        runs = len(self.problem.runs)
        found = self.problem.residuals([item for table in tables for item in enumerate(table)])
        each = [found[i : i + runs] for i in range(0, len(found), runs)]
        ties = [apart(self.problem, table, self.zeros) for table in tables]
        whole = [np.concatenate([*parts, tie]) for parts, tie in zip(each, ties, strict=True)]
        return [np.nan_to_num(values, nan=1e6, posinf=1e6, neginf=-1e6) for values in whole]

    def _slopes(self, q: FloatArray) -> FloatArray:
        base, axes = self._at(q), self.coordinates.axes
        columns = np.zeros((base.size, q.size), order="F")  # filled by columns
        groups, steps = _together(self.coordinates), np.where(q + 1e-5 <= self.coordinates.hi, 1e-5, -1e-5)
        moved = np.tile(q, (len(groups), 1))
        for row, group in zip(moved, groups, strict=True):
            row[group] += steps[group]
        changed = self._residuals([self.coordinates.table(row) for row in moved])
        for group, values in zip(groups, changed, strict=True):
            change = values - base
            for i in group:
                rows = slice(None) if axes[i].run is None else _rows(self.problem, axes[i].run)
                columns[rows, i] = change[rows] / steps[i]
                if self.zeros and axes[i].run is not None:  # of these, one run's value acts on all rows
                    alone = q.copy()
                    alone[i] += steps[i]
                    tie = apart(self.problem, self.coordinates.table(alone), self.zeros)
                    columns[base.size - tie.size :, i] = (tie - base[base.size - tie.size :]) / steps[i]
        return columns


def triangle(residual: FloatArray, columns: FloatArray) -> FloatArray:
    """The columns, shape (n + 1, n), in axes where the residual is its norm in the first of them.

    Parameters
    ----------
    residual : ndarray, shape (rows,)
    columns : ndarray, shape (rows, n)
    """
    # scipy's, which other threads need not wait for; numpy's keeps the interpreter's lock
    turned: FloatArray = qr(np.column_stack([residual, columns]), mode="raw", check_finite=False)[1]  # pyright: ignore
    found = np.zeros((columns.shape[1] + 1, columns.shape[1]))
    rows = min(len(found), len(turned))
    found[:rows] = turned[:rows, 1:]
    if turned[0, 0] < 0.0:
        found[0] *= -1.0
    return found


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
