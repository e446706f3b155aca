"""Method ``paper``: differential evolution, then Nelder-Mead, as the papers identified their models.

ICINCO 2013 and MMT 2015 search with a genetic algorithm and refine with the simplex. Here the searched values
are all shared parameters; the offset and initial state of each run are solved for, as in `search`.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import differential_evolution, minimize

from ..regression.coordinates import Coordinates
from ..regression.problem import FloatArray, Problem
from ..regression.projection import Projection
from ..regression.search import Search, eliminated_per_run
from ..regression.seeds import SPREAD, dimensional_scales
from ..regression.structure import linear_parameters, sensitivity_scales

REACH = 3.0
"""Half width of the searched box, in changes that move the outputs by one standard deviation."""
GENERATIONS = 200
REFUSED = 1e12


def search_paper(problem: Problem, search: Search, seed: int, start: FloatArray | None = None) -> FloatArray:
    """Minimise the weighted residual; returns the table of values. Deterministic for a seed.

    Parameters
    ----------
    problem : Problem
    search : Search
    seed : int
        Seed of the evolution.
    start : ndarray, optional
        Table to refine by the simplex alone.
    """
    scales = sensitivity_scales(problem)
    search.linear = linear_parameters(problem, seed)
    own = eliminated_per_run(problem, search.linear)
    projection = Projection(problem, (), own, scales)
    searched_own = [f for f in problem.own if f not in own]
    coordinates = Coordinates(problem, problem.shared, searched_own, scales, problem.start())

    def cost(q: FloatArray) -> float:
        point = projection(coordinates.table(q))
        search.simulations = projection.simulations
        if point is None:
            return REFUSED
        search.offer(point.table, math.sqrt(point.cost / point.residual.size))
        return point.cost / point.residual.size

    if not coordinates.axes:
        cost(np.empty(0))
    else:
        if start is None:
            box = _box(problem, coordinates)
            rng = np.random.default_rng(seed)
            best = differential_evolution(
                cost, box, rng=rng, init="sobol", maxiter=GENERATIONS, tol=1e-4, polish=False
            ).x
        else:
            best = coordinates.of(start)
        limits = list(zip(coordinates.lo, coordinates.hi, strict=True))
        options = {"xatol": 1e-6, "fatol": 1e-10, "maxfev": 1000 * len(coordinates.axes), "adaptive": True}
        minimize(cost, best, method="Nelder-Mead", bounds=limits, options=options)
    return problem.start() if search.best is None else search.best


def _box(problem: Problem, coordinates: Coordinates) -> list[tuple[float, float]]:
    """Searched range of each coordinate: about its start and about what its unit suggests."""
    sizes = dimensional_scales(problem)
    box = []
    for axis, start in zip(coordinates.axes, coordinates.of(coordinates.anchor), strict=True):
        physical = axis.q(math.copysign(sizes[axis.field], axis.sign)) if axis.sign else start
        reach = SPREAD if axis.sign else REACH
        box.append((max(axis.lo, min(start, physical) - reach), min(axis.hi, max(start, physical) + reach)))
    return box
