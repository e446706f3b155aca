"""Method ``fast``: bounded least squares from several physical starts, linear parameters eliminated."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from .coordinates import Coordinates
from .problem import FloatArray, Problem
from .projection import Projected, Projection
from .seeds import starts
from .structure import linear_parameters, sensitivity_scales

DRAWS = 32
REFINED = 3
SCOUT_RUNS = 3
"""With more runs than this, the starts are compared on a spread of so many."""
STEP = 1e-6
TOLERANCE = 1e-10

Progress = Callable[[int, float], None]
"""Called with the number of simulations and the weighted RMS error of the best point so far."""


@dataclass
class Search:
    """Bookkeeping of one identification: the best table so far survives an interruption.

    Attributes
    ----------
    best : ndarray or None
        Table with the lowest weighted error so far.
    error : float
        Its weighted RMS residual.
    simulations : int
        Simulations of one run.
    linear : frozenset of str
        Fields in which the channels are jointly affine.
    """

    progress: Progress | None = None
    best: FloatArray | None = None
    error: float = math.inf
    simulations: int = 0
    linear: frozenset[str] = frozenset()

    def offer(self, table: FloatArray, error: float) -> None:
        if error < self.error:
            self.best, self.error = table.copy(), error
        if self.progress:
            self.progress(self.simulations, self.error)


def search_fast(problem: Problem, search: Search, seed: int, start: FloatArray | None = None) -> FloatArray:
    """Minimise the weighted residual; returns the table of values.

    The shared linear parameters are eliminated first. Where that solution lies on a bound or violates a joint
    condition of the model, the search goes on from there over all shared parameters, inside what is allowed.

    Parameters
    ----------
    problem : Problem
    search : Search
    seed : int
        Seed of the draws.
    start : ndarray, optional
        Table to refine; without it, several starts.
    """
    scales = sensitivity_scales(problem)
    search.linear = linear_parameters(problem, seed)
    own = tuple(f for f in problem.own if f in search.linear and _unbounded(problem, f))
    shared = tuple(f for f in problem.shared if f in search.linear)
    solver = _Solver(problem, search, shared, own, scales, problem.start())
    if start is not None:
        table = solver.refined(solver.coordinates.of(start))
    elif len(problem.runs) > SCOUT_RUNS:
        table = solver.refined(solver.coordinates.of(_scouted(problem, search, solver, seed)))
    else:
        table = solver.multistart(seed)
    if not shared or not any(_outside(problem, row) for row in table):
        return table
    search.best, search.error = None, math.inf  # what was found so far is not allowed
    inside = drawn_inside(problem, table)
    constrained = _Solver(problem, search, (), own, scales, inside)
    return constrained.refined(constrained.coordinates.of(inside))


def _scouted(problem: Problem, search: Search, solver: _Solver, seed: int) -> FloatArray:
    """Best start of a few runs that are spread over all."""
    some = np.unique(np.linspace(0, len(problem.runs) - 1, SCOUT_RUNS).astype(int))
    scout = solver.on(problem.with_runs([problem.runs[i] for i in some]))
    found = scout.multistart(seed)
    search.simulations += scout.search.simulations
    return np.where([f in problem.per_run for f in problem.fields], problem.start(), found[0])


class _Solver:
    """Reduced least squares over the parameters that are not eliminated."""

    def __init__(
        self,
        problem: Problem,
        search: Search,
        shared: tuple[str, ...],
        own: tuple[str, ...],
        scales: Mapping[str, float],
        table: FloatArray,
    ) -> None:
        self.problem, self.search = problem, search
        self._eliminates = shared, own, scales
        self.projection = Projection(problem, shared, own, scales)
        searched = [f for f in problem.shared if f not in shared]
        searched_own = [f for f in problem.own if f not in own]
        self.coordinates = Coordinates(problem, searched, searched_own, scales, table)
        self._at: tuple[bytes | None, Projected | None] = (None, None)

    def on(self, problem: Problem) -> _Solver:
        """The same search on other runs, with its own bookkeeping."""
        return _Solver(problem, Search(), *self._eliminates, problem.start())

    def multistart(self, seed: int) -> FloatArray:
        """Best of several refined starts."""
        ranked = []
        for number, q in enumerate(starts(self.problem, self.coordinates, DRAWS, seed)):
            point = self.projected(q)
            if point is not None:
                ranked.append((point.cost, number, q))
        ranked.sort(key=lambda entry: entry[:2])
        best: tuple[float, FloatArray] | None = None
        for _, _, q in ranked[:REFINED] if self.coordinates.axes else ranked[:1]:
            table = self.refined(q)
            point = self.projected(self.coordinates.of(table))
            if point is not None and (best is None or point.cost < best[0]):
                best = (point.cost, table)
        return best[1] if best else self.refined(self.coordinates.of(self.coordinates.anchor))

    def refined(self, q: FloatArray) -> FloatArray:
        """Table at the local minimum reached from ``q``."""
        if self.coordinates.axes:
            first = self.projected(q)
            if first is None:
                return self.coordinates.table(q)
            found = least_squares(
                self._residual,
                q,
                jac=self._jacobian,  # pyright: ignore[reportArgumentType]
                bounds=(self.coordinates.lo, self.coordinates.hi),
                x_scale="jac",
                ftol=TOLERANCE,
                xtol=TOLERANCE,
                gtol=TOLERANCE,
                max_nfev=100,
            )
            q = found.x
        point = self.projected(q)
        return self.coordinates.table(q) if point is None else point.table

    def projected(self, q: FloatArray) -> Projected | None:
        """The reduced problem at ``q``; None where the model fails there."""
        key = q.tobytes()
        if self._at[0] != key:
            before = self.projection.simulations
            point = self.projection(self.coordinates.table(q))
            self.search.simulations += self.projection.simulations - before
            self._at = (key, point)
            if point is not None:
                self.search.offer(point.table, math.sqrt(point.cost / point.residual.size))
        return self._at[1]

    def _residual(self, q: FloatArray) -> FloatArray:
        point = self.projected(q)
        if point is None:
            return np.full(sum(self._rows()), np.inf)
        return point.residual

    def _rows(self) -> list[int]:
        block = self.problem.block
        return [-(-r.targets.shape[0] // block) * r.targets.shape[1] for r in self.problem.runs]

    def _jacobian(self, q: FloatArray, _residual: FloatArray | None = None) -> FloatArray:
        point = self.projected(q)
        if point is None:
            raise ValueError("no derivative where the model fails")
        eliminated = [self.problem.fields.index(f) for f in self.problem.fields if self._eliminated(f)]
        columns = np.zeros((point.residual.size, len(self.coordinates.axes)))
        for i, axis in enumerate(self.coordinates.axes):
            h = STEP if q[i] + STEP < self.coordinates.hi[i] else -STEP
            moved = q.copy()
            moved[i] += h
            table = self.coordinates.table(moved)
            table[:, eliminated] = point.table[:, eliminated]
            for k in range(len(self.problem.runs)) if axis.run is None else (axis.run,):
                rows = point.rows[k]
                columns[rows, i] = (self.projection.residual(k, table[k]) - point.residual[rows]) / h
        self.search.simulations += columns.shape[1] * len(self.problem.runs)
        return point.reduced(np.nan_to_num(columns, nan=0.0, posinf=0.0, neginf=0.0))

    def _eliminated(self, field: str) -> bool:
        searched = {axis.field for axis in self.coordinates.axes}
        return self.problem.parameters[field].vary and field not in searched


def _unbounded(problem: Problem, field: str) -> bool:
    parameter = problem.parameters[field]
    return math.isinf(parameter.min) and math.isinf(parameter.max)


def _outside(problem: Problem, row: FloatArray) -> bool:
    """Whether a row violates the model's conditions, or touches a bound of the fit."""
    if problem.violation(row):
        return True
    values = dict(zip(problem.fields, row, strict=True))
    return any(not problem.parameters[f].min < values[f] < problem.parameters[f].max for f in problem.shared)


def drawn_inside(problem: Problem, table: FloatArray) -> FloatArray:
    """Make an unconstrained solution the start of a constrained one.

    The table is moved towards the start, which is valid, until the model
    accepts every row, and a little further.
    """
    start = problem.start()
    moving = [problem.fields.index(f) for f in problem.shared]
    inside, outside = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (inside + outside)
        trial = table.copy()
        trial[:, moving] = start[:, moving] + middle * (table - start)[:, moving]
        refused = any(_outside(problem, row) for row in trial)
        inside, outside = (inside, middle) if refused else (middle, outside)
    result = table.copy()
    result[:, moving] = start[:, moving] + 0.98 * inside * (table - start)[:, moving]
    return result
