"""95 % intervals of the parameters: from the standard errors, or from the profile of the error itself.

The profile of a parameter is the least sum of squares S that the others can reach while it is held, here by a fit of
its own at each value. Its interval ends where ::

    S(theta) - S_min = 1.96^2 kappa,    kappa = V / (J'J)^-1                            (1)

with V the variance of the parameter and (J'J)^-1 its diagonal element. For white residuals kappa is their variance, and
(1) the likelihood ratio; for coloured ones V is that of `uncertainty`, and (1) the ratio scaled to its curvature
(Chandler and Bate 2007). Of a linear parameter S is a parabola, and (1) gives value +- 1.96 standard errors. lmfit's
``conf_interval`` finds the same ends for one run and white residuals (a test says so), but knows one level of noise for
all parameters, no values per run and no eliminated parameters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from scipy.optimize import root_scalar

from ..kernels.arrays import FloatArray
from .problem import Problem
from .solver import SearchLog, Solution, Solver
from .uncertainty import Uncertainty

if TYPE_CHECKING:
    from lmfit import Parameters

_Profiled = Callable[[FloatArray, int, float], FloatArray | None]
Intervals = Mapping[str, tuple[float, float]]
"""Lower and upper end [SI] by field."""

QUANTILE = 1.96
"""Half width of a 95 % interval, in standard errors."""
WIDEST = 64.0
"""An interval that has not ended after so many half widths of the linear one is open on that side."""
END = 1e-3
"""To this part of a linear half width the ends are found."""
REFUSED = 1e3
"""Where the model refuses a value, it is far outside: the interval ends at the model's condition."""


def linear_intervals(parameters: Parameters, at_bound: frozenset[str]) -> dict[str, tuple[float, float]]:
    """Value +- 1.96 standard errors of each parameter that has one and is not on a bound."""
    return {
        name: (p.value - QUANTILE * p.stderr, p.value + QUANTILE * p.stderr)
        for name, p in parameters.items()
        if p.vary and p.stderr is not None and name not in at_bound
    }


def profile_intervals(
    problem: Problem, best: Solution, known: Uncertainty, found: dict[str, tuple[float, float]], solver: Solver,
    log: SearchLog,
) -> None:  # fmt: skip
    """Replace the intervals of the shared parameters in ``found`` by those of the profile, one after the other.

    An end is infinite where the error does not rise enough, and at the bound or the joint condition of the model
    where that comes first. What is in ``found`` when the user interrupts stays.

    Parameters
    ----------
    problem : Problem
        With the weights of the fit.
    best : Solution
        Of the fit.
    known : Uncertainty
    found : dict
        The linear intervals; changed.
    solver : Solver
        Fits the other parameters, from a solution.
    log : SearchLog
        Counts the simulations.
    """
    least = problem.cost(best.table)
    log.begin("profile intervals")

    def profiled(start: FloatArray, column: int, value: float) -> FloatArray | None:
        """Best values with one shared parameter fixed; None where the model refuses that value beside the others."""
        start = start.copy()
        start[:, column] = value
        if problem.refused(start):
            return None
        name, counted = problem.fields[column], SearchLog()
        one = problem.starting_at(start)
        one = one.over(one.space.fixing([name]))
        reached = solver(one, counted, Solution(start, best.linear - {name}, best.constrained))
        log.simulated(counted.simulations)
        return reached.table

    for name in known.names:
        if name in found:
            log.rename(f"profile intervals, {problem.declared[name].name}")
            low, high = (_end(problem, best.table, known, profiled, name, least, side) for side in (-1.0, 1.0))
            found[name] = (low, high)


def _end(
    problem: Problem, table: FloatArray, known: Uncertainty, profiled: _Profiled, name: str, least: float, side: float
) -> float:
    j, kappa = problem.fields.index(name), known.calibration[name]
    value, parameter = float(table[0, j]), problem.space[name]
    half = QUANTILE * known.stderr[name]
    furthest = (parameter.hi if side > 0.0 else parameter.lo) - value
    best, known_at = table, {0.0: -QUANTILE}

    def missing(distance: float) -> float:
        """What (1) lacks, as its root in quantiles: nearly linear in the distance. Each fit starts at the last one."""
        nonlocal best
        if distance not in known_at:
            reached = profiled(best, j, value + side * distance)
            known_at[distance] = REFUSED
            if reached is not None:
                best, rise = reached, problem.cost(reached) - least
                known_at[distance] = math.copysign(math.sqrt(abs(rise) / kappa), rise) - QUANTILE
        return known_at[distance]

    inside, outside = 0.0, min(half, abs(furthest))
    while missing(outside) < 0.0:
        if outside >= abs(furthest):
            return value + furthest
        if outside > WIDEST * half:
            return side * math.inf
        inside, outside = outside, min(2.0 * outside, abs(furthest))
    return value + side * root_scalar(missing, bracket=(inside, outside), xtol=END * half).root
