"""Solver ``fast``: descents from several physical starts, linear parameters eliminated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ..kernels.arrays import FloatArray
from .descent import Descent, Objective
from .linearity import linear_parameters
from .problem import FitRun, Problem
from .projection import Eliminated, Projection
from .scaled_variables import ScaledVariables
from .seeds import starts
from .sensitivity import sensitivity_scales
from .solver import SearchLog, Solution
from .thinning import thinned

DRAWS_PER_AXIS = 16
REFINED_PER_AXIS = 2
"""Starts tried, and refined, for each searched parameter: more parameters, more local minima."""
SCOUT_RUNS = 3
SCOUT_ROWS = 3000
"""Starts are compared on so many runs and rows; the best is refined on everything."""
COARSE_ROWS = 100_000
"""Above so many rows in all, a fit to thinned runs comes before the one to every sample."""
DESCENT = Descent()
SCOUTING = Descent(cost_tolerance=1e-5, step_tolerance=1e-5, gradient_tolerance=1e-5)


@dataclass(frozen=True)
class MultiStart:
    """The solver.

    The shared linear parameters are eliminated first. Where that solution lies on a bound or violates a joint
    condition of the model, the search goes on from there over all shared parameters, inside what is allowed.

    Attributes
    ----------
    seed : int
        Seed of the draws.
    """

    seed: int = 0

    def phases(self, problem: Problem, start: Solution | None = None) -> int:
        """Phases of the log that a search begins, but for the one that only a bound or a condition asks for."""
        return 1 if start is not None else 2 + _is_long(problem)

    def __call__(self, problem: Problem, log: SearchLog, start: Solution | None = None) -> Solution:
        """Minimise the weighted residual, from a solution if one is given."""
        scales = sensitivity_scales(problem)
        linear = (start.linear if start else frozenset()) or linear_parameters(problem, self.seed)
        constrained = start is not None and start.constrained
        eliminated = Eliminated.of(problem, linear, constrained)
        if start is None:
            log.begin("several starts on few samples")
            table = _scouted(problem, log, eliminated, scales, self.seed)
            if _is_long(problem):
                log.begin("fit to thinned runs")
                coarse = problem.with_runs(_each_thinned(problem, range(len(problem.runs))))
                table = _refined(coarse, log, eliminated, scales, table, table)
            reference = problem.start()
        else:
            table = reference = start.table
        log.begin("fit to every sample")
        table = _refined(problem, log, eliminated, scales, table, reference)
        if not eliminated.shared or not any(_outside(problem, row) for row in table):
            return Solution(table, linear, constrained)
        log.begin("fit inside bounds and conditions")
        inside = drawn_inside(problem, table)
        table = _refined(problem, log, Eliminated.of(problem, linear, constrained=True), scales, inside, inside)
        return Solution(table, linear, constrained=True)


def _is_long(problem: Problem) -> bool:
    return sum(run.time.size for run in problem.runs) > COARSE_ROWS


def _each_thinned(problem: Problem, runs: Iterable[int]) -> list[FitRun]:
    return [run for k in runs for run in thinned(problem.kernel, [problem.runs[k]], SCOUT_ROWS)]


def _refined(
    problem: Problem, log: SearchLog, eliminated: Eliminated, scales: Mapping[str, float], table: FloatArray,
    reference: FloatArray,
) -> FloatArray:  # fmt: skip
    """Values at the local minimum reached from a table; `reference` is valid, and the centre of the variables."""
    objective = _objective(problem, log, eliminated, scales, reference)
    return objective.values(DESCENT.descend(objective, objective.variables.of(table)))


def _objective(
    problem: Problem, log: SearchLog, eliminated: Eliminated, scales: Mapping[str, float], reference: FloatArray
) -> Objective:
    shared = [f for f in problem.shared if f not in eliminated.shared]
    per_run = [f for f in problem.per_run if f not in eliminated.per_run]
    variables = ScaledVariables(problem, shared, per_run, scales, reference)
    return Objective(problem, variables, Projection(problem, eliminated, scales), DESCENT.difference, log)


def _scouted(
    problem: Problem, log: SearchLog, eliminated: Eliminated, scales: Mapping[str, float], seed: int
) -> FloatArray:
    """Best start, found on a few runs that are spread over all, thinned: the models step exactly."""
    some = np.unique(np.linspace(0, len(problem.runs) - 1, SCOUT_RUNS).astype(int))
    few = problem.with_runs(_each_thinned(problem, some.tolist()))
    scout = _Scout(problem, log)
    objective = _objective(few, scout, eliminated, scales, few.start())
    variables, ranked = objective.variables, []
    axes = len(variables.axes)
    for number, q in enumerate(starts(few, variables, DRAWS_PER_AXIS * axes, seed)):
        point = objective.at(q) if number == 0 or variables.accepts(q) else None
        if point is not None:
            ranked.append((point.cost, number, q))
    ranked.sort(key=lambda entry: entry[:2])
    best: tuple[float, FloatArray] | None = None
    tried = ranked[: max(1, REFINED_PER_AXIS * axes)]
    for number, (_, _, q) in enumerate(tried, start=1):
        log.rename(f"several starts on few samples, {number} of {len(tried)}")
        table = objective.values(SCOUTING.descend(objective, q))
        point = objective.at(variables.of(table))
        if point is not None and (best is None or point.cost < best[0]):
            best = (point.cost, table)
    if best is None:
        best = (0.0, objective.values(SCOUTING.descend(objective, variables.of(variables.anchor))))
    return scout.of_all_runs(best[1])


class _Scout(SearchLog):
    """The log of a search on a few of the runs, whose points are kept as points of all of them."""

    def __init__(self, problem: Problem, whole: SearchLog) -> None:
        super().__init__()
        self._whole, self._start = whole, problem.start()
        self._per_run = np.array([f in problem.per_run for f in problem.fields])

    def of_all_runs(self, table: FloatArray) -> FloatArray:
        """The shared values for every run, with the start's per-run values."""
        return np.where(self._per_run, self._start, table[0])

    def simulated(self, count: int) -> None:
        """Count simulations of one run."""
        self._whole.simulated(count)

    def offer(self, table: FloatArray, error: float) -> None:
        """Keep a point."""
        self._whole.offer(self.of_all_runs(table), error)


def _outside(problem: Problem, row: FloatArray) -> bool:
    """Whether a row violates the model's conditions, or touches a bound of the fit."""
    if problem.refused(row[None]):
        return True
    values = dict(zip(problem.fields, row, strict=True))
    return any(not problem.space[f].lo < values[f] < problem.space[f].hi for f in problem.shared)


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
