"""Solver ``paper``: differential evolution, then Nelder-Mead, as the papers identified their models.

ICINCO 2013 and MMT 2015 search with a genetic algorithm and refine with the simplex. Here the searched values
are all shared parameters; the offset and initial state of each run are solved for, as in `multistart`.

What a joint condition of the model refuses dies in the evolution: drawn back, all that lies behind a boundary would
share its few points, and the population would gather there. The simplex slides along the boundary, where the best set
may be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution, minimize

from ..kernels.arrays import FloatArray
from ..regression.linearity import linear_parameters
from ..regression.problem import Problem
from ..regression.projection import Eliminated, Projection
from ..regression.scaled_variables import ScaledVariables
from ..regression.seeds import SPREAD, dimensional_scales, load_direction_numbers
from ..regression.sensitivity import sensitivity_scales
from ..regression.solver import SearchLog, Solution

REACH = 3.0
"""Half width of the searched box, in changes that move the outputs by one standard deviation."""
GENERATIONS = 200
REFUSED = 1e12


@dataclass(frozen=True)
class Evolution:
    """The solver.

    Attributes
    ----------
    seed : int
        Seed of the evolution.
    """

    seed: int = 0

    def phases(self, problem: Problem, start: Solution | None = None) -> int:
        """Phases of the log that a search begins."""
        return 1 if start is not None or not problem.space.free else 2

    def __call__(self, problem: Problem, log: SearchLog, start: Solution | None = None) -> Solution:
        """Minimise the weighted residual; from a solution by the simplex alone."""
        scales = sensitivity_scales(problem)
        linear = linear_parameters(problem, self.seed)
        eliminated = Eliminated.of(problem, linear, constrained=True)  # of the papers' parameters none
        projection = Projection(problem, eliminated, scales)
        per_run = [f for f in problem.per_run if f not in eliminated.per_run]
        variables = ScaledVariables(problem, problem.shared, per_run, scales, problem.start())

        def cost(q: FloatArray) -> float:
            point = projection(variables.table(q))
            log.simulated(projection.simulations)
            if point is None:
                return REFUSED
            log.offer(point.table, math.sqrt(point.cost / point.residual.size))
            return point.cost / point.residual.size

        if not variables.axes:
            log.begin("linear parameters")
            cost(np.empty(0))
        else:
            best = variables.of(problem.start() if start is None else start.table)
            if start is None:
                log.begin("differential evolution")
                load_direction_numbers()
                rng = np.random.default_rng(self.seed)
                best = differential_evolution(
                    lambda q: cost(q) if variables.accepts(q) else REFUSED,
                    _box(problem, variables),
                    rng=rng,
                    init="sobol",
                    maxiter=GENERATIONS,
                    tol=1e-4,
                    polish=False,
                ).x
            log.begin("simplex")
            limits = list(zip(variables.lo, variables.hi, strict=True))
            options = {"xatol": 1e-6, "fatol": 1e-10, "maxfev": 1000 * len(variables.axes), "adaptive": True}
            minimize(cost, best, method="Nelder-Mead", bounds=limits, options=options)
        return Solution(problem.start() if log.best is None else log.best, linear)


def _box(problem: Problem, variables: ScaledVariables) -> list[tuple[float, float]]:
    """Searched range of each variable: about its start and about what its unit suggests."""
    sizes = dimensional_scales(problem)
    box = []
    for axis, start in zip(variables.axes, variables.of(variables.anchor), strict=True):
        physical = axis.q(math.copysign(sizes[axis.field], axis.sign)) if axis.sign else start
        reach = SPREAD if axis.sign else REACH
        box.append((max(axis.lo, min(start, physical) - reach), min(axis.hi, max(start, physical) + reach)))
    return box
