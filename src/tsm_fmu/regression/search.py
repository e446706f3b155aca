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
from .structure import linear_parameters, sensitivity_scales, thinned

DRAWS_PER_AXIS = 16
REFINED_PER_AXIS = 2
"""Starts tried, and refined, for each searched parameter: more parameters, more local minima."""
SCOUT_RUNS = 3
SCOUT_ROWS = 3000
"""Starts are compared on so many runs and rows; the best is refined on everything."""
COARSE_ROWS = 100_000
"""Above so many rows in all, a fit to thinned runs comes before the one to every sample."""
STEP = 1e-6
TOLERANCE = 1e-7
MOST_STEPS = 60

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
    constrained : bool
        A bound or a joint condition holds the fit: nothing shared is eliminated any more.
    """

    progress: Progress | None = None
    best: FloatArray | None = None
    error: float = math.inf
    simulations: int = 0
    linear: frozenset[str] = frozenset()
    constrained: bool = False

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
    search.linear = search.linear or linear_parameters(problem, seed)
    own = eliminated_per_run(problem, search.linear)
    shared = tuple(f for f in problem.shared if f in search.linear and not search.constrained)
    solver = _Solver(problem, search, shared, own, scales, problem.start() if start is None else start)
    if start is None:
        start = _scouted(problem, search, (shared, own, scales), seed)
        if sum(run.time.size for run in problem.runs) > COARSE_ROWS:
            coarse = problem.with_runs([thinned(run, SCOUT_ROWS) for run in problem.runs])
            first = _Solver(coarse, Search(), shared, own, scales, start)
            start = first.refined(first.coordinates.of(start))
            search.simulations += first.search.simulations
    table = solver.refined(solver.coordinates.of(start))
    if not shared or not any(_outside(problem, row) for row in table):
        return table
    search.best, search.error, search.constrained = None, math.inf, True  # what was found so far is not allowed
    inside = drawn_inside(problem, table)
    constrained = _Solver(problem, search, (), own, scales, inside)
    return constrained.refined(constrained.coordinates.of(inside))


def _scouted(problem: Problem, search: Search, eliminates: _Eliminates, seed: int) -> FloatArray:
    """Best start, found on a few runs that are spread over all, thinned: the models step exactly."""
    some = np.unique(np.linspace(0, len(problem.runs) - 1, SCOUT_RUNS).astype(int))
    few = problem.with_runs([thinned(problem.runs[i], SCOUT_ROWS) for i in some])
    scout = _Solver(few, Search(), *eliminates, few.start(), tolerance=1e-5)
    found = scout.multistart(seed)
    search.simulations += scout.search.simulations
    return np.where([f in problem.per_run for f in problem.fields], problem.start(), found[0])


_Eliminates = tuple[tuple[str, ...], tuple[str, ...], Mapping[str, float]]


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
        tolerance: float = TOLERANCE,
    ) -> None:
        self.problem, self.search, self.tolerance = problem, search, tolerance
        self.projection = Projection(problem, shared, own, scales)
        searched = [f for f in problem.shared if f not in shared]
        searched_own = [f for f in problem.own if f not in own]
        self.coordinates = Coordinates(problem, searched, searched_own, scales, table)
        self._at: tuple[bytes | None, Projected | None] = (None, None)

    def multistart(self, seed: int) -> FloatArray:
        """Best of several refined starts."""
        ranked = []
        axes = len(self.coordinates.axes)
        for number, q in enumerate(starts(self.problem, self.coordinates, DRAWS_PER_AXIS * axes, seed)):
            point = self.projected(q) if number == 0 or self.coordinates.accepts(q) else None
            if point is not None:
                ranked.append((point.cost, number, q))
        ranked.sort(key=lambda entry: entry[:2])
        best: tuple[float, FloatArray] | None = None
        for _, _, q in ranked[: max(1, REFINED_PER_AXIS * axes)]:
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
                ftol=self.tolerance,
                xtol=self.tolerance,
                gtol=self.tolerance,
                max_nfev=MOST_STEPS,
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
        wanted: list[tuple[int, int, float, FloatArray]] = []
        for i, axis in enumerate(self.coordinates.axes):
            h = STEP if q[i] + STEP < self.coordinates.hi[i] else -STEP
            moved = q.copy()
            moved[i] += h
            table = self.coordinates.table(moved)
            table[:, eliminated] = point.table[:, eliminated]
            for k in range(len(self.problem.runs)) if axis.run is None else (axis.run,):
                wanted.append((i, k, h, table[k]))
        moved_to = self.problem.residuals([(k, row) for _, k, _, row in wanted])
        for (i, k, h, _), residual in zip(wanted, moved_to, strict=True):
            columns[point.rows[k], i] = (residual - point.residual[point.rows[k]]) / h
        self.search.simulations += len(wanted)
        return point.reduced(np.nan_to_num(columns, nan=0.0, posinf=0.0, neginf=0.0))

    def _eliminated(self, field: str) -> bool:
        searched = {axis.field for axis in self.coordinates.axes}
        return self.problem.parameters[field].vary and field not in searched


def eliminated_per_run(problem: Problem, linear: frozenset[str]) -> tuple[str, ...]:
    """Per-run fields that are solved for: linear, and without bounds to keep."""
    bounds = {f: (problem.parameters[f].min, problem.parameters[f].max) for f in problem.own}
    return tuple(f for f, (lo, hi) in bounds.items() if f in linear and math.isinf(lo) and math.isinf(hi))


def _outside(problem: Problem, row: FloatArray) -> bool:
    """Whether a row violates the model's conditions, or touches a bound of the fit."""
    if problem.refused(row[None]):
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
