"""Bounded nonlinear least squares from one start: the only local optimiser, for identification and diagnosis alike.

The searched variables are those of `scaled_variables`; parameters that are eliminated are solved for at each point
(`projection`). The optimiser is scipy's trust region reflective one. Its matrices are reduced by a QR decomposition
from samples to parameters, which changes neither norms, slopes nor steps.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cholesky, qr
from scipy.optimize import least_squares

from ..kernels.arrays import FloatArray
from .problem import Problem
from .projection import Eliminated, Projected, Projection
from .scaled_variables import ScaledVariables
from .sensitivity import Perturbation, finite_differences, sensitivity_scales
from .solver import SearchLog, Solution

FARTHEST = 10.0
"""The scale of a positive parameter is not beyond this many times its value, where a slope means nothing."""
CACHED_ROWS, MANY_ROWS = 4096, 10_000
"""Of more than `MANY_ROWS` so many are factorised at once, which stay in a processor's cache, then their factors."""
APART = 1e-4
"""Part of each column beyond those before it from which on their products tell them apart, to half the digits."""

LONGER = 4
"""Times as many evaluations a descent may take that has not nearly arrived after the usual number."""
PROMISING_STEPS = 4
"""Evaluations after which it shows whether a descent that is to reach a sum of squares comes near it."""
WELL_PREDICTED = 0.25
"""Part of a predicted gain: a step that gains less ends no descent, for the next one is shorter. As in scipy."""


@dataclass(frozen=True)
class Descent:
    """Settings of a descent, which is a `Solver`: it only ever refines one start.

    Attributes
    ----------
    cost_tolerance : float
        It ends when a step changes the sum of squares by less than this part,
    step_tolerance : float
        when a step changes the scaled variables by less than this part,
    gradient_tolerance : float
        when the scaled gradient is less than this,
    most_steps : int
        and after so many evaluations,
    under_way : float
        unless the last step gained more than this part of the sum of squares: then after `LONGER` times as many.
    difference : float
        Step of the Jacobian's finite differences, in scaled variables.
    at_most : float
        It is given up if more than this sum of squares is left after `PROMISING_STEPS` evaluations.
    """

    cost_tolerance: float = 1e-7
    step_tolerance: float = 1e-7
    gradient_tolerance: float = 1e-7
    most_steps: int = 60
    under_way: float = math.inf
    difference: float = 1e-6
    at_most: float = math.inf

    def __call__(self, problem: Problem, log: SearchLog, start: Solution | None = None) -> Solution:
        """All free parameters searched, none eliminated; never worse than the start."""
        start = start or Solution(problem.start())
        return Solution(self.refined(problem, start.table, log=log))

    def refined(
        self, problem: Problem, table: FloatArray, scales: Mapping[str, float] | None = None,
        log: SearchLog | None = None,
    ) -> FloatArray:  # fmt: skip
        """Values at the local minimum reached from a table; never worse than it.

        Parameters
        ----------
        problem : Problem
        table : ndarray, shape (runs, parameters)
        scales : mapping of str to float, optional
            `sensitivity_scales` at the table, where they are known.
        log : SearchLog, optional
        """
        if not problem.space.free:
            return table
        scales = scales or sensitivity_scales(problem.starting_at(table))
        per_run = [f for f in problem.per_run if np.isfinite(scales[f])]  # the others would wander
        if not problem.shared and not per_run:
            return table
        variables = ScaledVariables(problem, problem.shared, per_run, _within_reach(problem, table, scales), table)
        objective = Objective(problem, variables, Projection(problem, Eliminated(), {}), self.difference, log)
        found = variables.table(self.descend(objective, variables.of(table)))
        return found if problem.cost(found) <= problem.cost(table) else table

    @property
    def longest(self) -> int:
        """Evaluations at most, whatever the last step gained."""
        return self.most_steps if math.isinf(self.under_way) else LONGER * self.most_steps

    def descend(self, objective: Objective, q: FloatArray) -> FloatArray:
        """Scaled values of the local minimum reached from ``q``; ``q`` itself where the model fails there."""
        if not objective.variables.axes or objective.at(q) is None:
            return q
        course = _Course(objective, self)
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # powers of slopes far from any answer: no step is taken
                return least_squares(
                    course.residual,
                    q,
                    jac=course.jacobian,  # pyright: ignore[reportArgumentType]
                    bounds=(objective.variables.lo, objective.variables.hi),
                    x_scale="jac",
                    ftol=self.cost_tolerance,
                    xtol=self.step_tolerance,
                    gtol=self.gradient_tolerance,
                    max_nfev=self.longest,
                ).x
        except _Arrived as arrived:
            return arrived.q
        except (ValueError, np.linalg.LinAlgError):  # a slope that is not finite: the model overflows beside the point
            return q


class Objective:
    """The weighted residuals of a problem as the optimiser sees them: few rows, the same problem.

    Parameters
    ----------
    problem : Problem
    variables : ScaledVariables
        What is searched.
    projection : Projection
        What is solved for.
    difference : float
        Step of the finite differences.
    log : SearchLog, optional
        Offered every point.
    """

    def __init__(
        self, problem: Problem, variables: ScaledVariables, projection: Projection, difference: float,
        log: SearchLog | None = None,
    ) -> None:  # fmt: skip
        self.problem, self.variables, self.projection = problem, variables, projection
        self.difference, self.log = difference, log or SearchLog()
        self._last: tuple[bytes, Projected | None] = (b"none", None)  # where it was evaluated last, and what came out

    def at(self, q: FloatArray) -> Projected | None:
        """The problem at ``q``, the eliminated parameters solved for; None where the model fails."""
        key = q.tobytes()
        if self._last[0] != key:
            point = self.projection(self.variables.table(q))
            self.log.simulated(self.projection.simulations)
            self._last = key, point
            if point is not None:
                self.log.offer(point.table, math.sqrt(point.cost / point.residual.size))
        return self._last[1]

    def values(self, q: FloatArray) -> FloatArray:
        """Values of all parameters at ``q``."""
        point = self.at(q)
        return self.variables.table(q) if point is None else point.table

    def residual(self, q: FloatArray) -> FloatArray:
        """The norm of all residuals in the first of as many rows as there are variables, and one more."""
        few = np.zeros(q.size + 1)
        point = self.at(q)
        if point is None:
            few[0] = np.inf
        else:
            pooled = self.problem.penalties(point.table)
            few[0] = np.linalg.norm(np.concatenate([point.residual, pooled]))
        return few

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Derivatives of `residual`, by one simulation of every run for each group of variables."""
        point = self.at(q)
        if point is None:
            raise ValueError("no derivative where the model fails")
        moves = [self._moved(q, point, group) for group in self.variables.groups]
        self.log.simulated(len(moves) * len(self.problem.runs))
        columns = finite_differences(self.problem.residuals, point.residuals, moves, q.size)
        still = self.problem.penalties(point.table)
        columns = np.vstack([point.reduced(columns), self._penalty_slopes(q, still)])
        return triangle(np.concatenate([point.residual, still]), columns)

    def _step(self, q: FloatArray) -> FloatArray:
        """Step of each variable, away from its upper bound."""
        return np.where(q + self.difference <= self.variables.hi, self.difference, -self.difference)

    def _moved(self, q: FloatArray, point: Projected, group: list[int]) -> Perturbation:
        """The variables of a group moved, what is eliminated held."""
        steps, moved = self._step(q), q.copy()
        moved[group] += steps[group]
        table = self.variables.table(moved)
        table[:, self.projection.columns] = point.table[:, self.projection.columns]
        columns = group * len(table) if self.variables.axes[group[0]].run is None else group
        return Perturbation(table, steps[columns], columns)

    def _penalty_slopes(self, q: FloatArray, still: FloatArray) -> FloatArray:
        """Derivatives of `Problem.penalties`, in which one value acts on the rows of others."""
        found = np.zeros((still.size, q.size))
        own = self.problem.known is None  # without a prior only what each run has of its own costs anything
        for i in [i for i, axis in enumerate(self.variables.axes) if still.size and not (own and axis.run is None)]:
            moved, step = q.copy(), self._step(q)[i]
            moved[i] += step
            found[:, i] = (self.problem.penalties(self.variables.table(moved)) - still) / step
        return found


class _Arrived(Exception):
    """A descent has ended."""

    def __init__(self, q: FloatArray) -> None:
        super().__init__()
        self.q = q


class _Course:
    """A descent that ends where scipy's ends, which would only then ask for the derivatives of its last point.

    Parameters
    ----------
    objective : Objective
    settings : Descent
    """

    def __init__(self, objective: Objective, settings: Descent) -> None:
        self.objective, self.settings = objective, settings
        self.evaluations = 0
        self.last: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def residual(self, q: FloatArray) -> FloatArray:
        """That of the objective, counted."""
        self.evaluations += 1
        return self.objective.residual(q)

    def jacobian(self, q: FloatArray) -> FloatArray:
        """That of the objective; raises `_Arrived` where a descent has ended and would not use it."""
        residual = self.objective.residual(q)
        if self.last and (self._given_up(residual) or self._hardly_less(q, residual)):
            raise _Arrived(q)
        found = self.objective.jacobian(q)
        self.last = q.copy(), residual, found
        return found

    def _given_up(self, residual: FloatArray) -> bool:
        """Whether no more evaluations are to be made."""
        assert self.last
        settings, still, cost = self.settings, self.last[1], residual @ residual
        hopeless = self.evaluations >= PROMISING_STEPS and cost > settings.at_most
        arriving = (still @ still - cost) <= settings.under_way * (still @ still)
        return bool(hopeless or (self.evaluations >= settings.most_steps and arriving))

    def _hardly_less(self, q: FloatArray, residual: FloatArray) -> bool:
        """Whether the last step gained next to nothing, and not for want of a model that predicts its gain.

        What scipy predicts beside a bound is less, and so a larger part of it is gained: where this ends, that does.
        """
        assert self.last
        before, still, slopes = self.last
        gained = still @ still - residual @ residual
        change = slopes @ (q - before)
        predicted = -change @ (2.0 * still + change)
        return bool(gained < self.settings.cost_tolerance * (still @ still) and gained > WELL_PREDICTED * predicted)


def triangle(residual: FloatArray, columns: FloatArray) -> FloatArray:
    """The columns, shape (n + 1, n), in axes where the residual is its norm in the first of them.

    Parameters
    ----------
    residual : ndarray, shape (rows,)
    columns : ndarray, shape (rows, n)
    """
    stacked = np.column_stack([residual, columns])
    turned = _of_products(stacked) if len(stacked) > MANY_ROWS else _factor(stacked)
    found = np.zeros((columns.shape[1] + 1, columns.shape[1]))
    rows = min(len(found), len(turned))
    found[:rows] = turned[:rows, 1:]
    if turned[0, 0] < 0.0:
        found[0] *= -1.0
    return found


def _of_products(rows: FloatArray) -> FloatArray:
    """`_factor` of many rows: from the products of the columns, a fifth of the work, or where these are too alike not.

    Products lose half the digits of what a column has beyond the others.
    """
    products = rows.T @ rows
    sizes = np.sqrt(np.diag(products))
    if (sizes > 0.0).all() and np.isfinite(products).all():
        with suppress(LinAlgError):
            found = cholesky(products / np.outer(sizes, sizes), check_finite=False)
            if (np.diag(found) > APART).all():
                return found * sizes
    parts = range(0, len(rows), CACHED_ROWS)
    return _factor(np.vstack([_factor(rows[k : k + CACHED_ROWS]) for k in parts]))


def _factor(rows: FloatArray) -> FloatArray:
    """The triangular factor; scipy's, which other threads need not wait for (numpy's keeps the interpreter's lock)."""
    return qr(rows, mode="raw", check_finite=False)[1]  # pyright: ignore


def _within_reach(problem: Problem, table: FloatArray, sensitivities: Mapping[str, float]) -> dict[str, float]:
    """Sensitivity scales of the free parameters, none farther than `FARTHEST`."""
    scales = {name: sensitivities[name] for name in problem.space.free}
    for name, scale in scales.items():
        declared = problem.declared[name]
        size = FARTHEST * max(abs(float(table[0, problem.fields.index(name)])), abs(declared.start))
        if declared.quantity.lo == 0.0 and size > 0.0:
            scales[name] = min(scale, size)
    return scales
