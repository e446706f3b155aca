"""Variable projection: the parameters in which a model is linear are solved for, not searched.

For a point of the searched parameters the eliminated ones follow from a linear least-squares problem; the
residual that is left, and its Jacobian in Kaufman's approximation (Kaufman 1975; Golub and Pereyra 2003),
are those of a problem in the searched parameters alone. Per-run parameters are eliminated run by run, so that
fifty runs with an offset each cost no more than fifty small problems.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import lsq_linear

from ..kernels.arrays import BoolArray, FloatArray
from .problem import Problem

RANK = 1e-8
"""Singular values below this part of the largest count as zero."""


@dataclass(frozen=True)
class Eliminated:
    """Fields that are solved for; the channels must be jointly affine in them.

    Attributes
    ----------
    shared, per_run : tuple of str
        Fields with one value for all runs, and with one for each.
    """

    shared: tuple[str, ...] = ()
    per_run: tuple[str, ...] = ()

    @classmethod
    def of(cls, problem: Problem, linear: frozenset[str], constrained: bool = False) -> Eliminated:
        """Of the linear fields those that can be eliminated: all shared ones, and per-run ones without bounds.

        Parameters
        ----------
        problem : Problem
        linear : frozenset of str
            From `linearity.linear_parameters`.
        constrained : bool
            A bound or a joint condition holds the shared ones: none of them is eliminated, nor with a prior.
        """
        unbounded = (f for f in problem.per_run if math.isinf(problem.space[f].lo) and math.isinf(problem.space[f].hi))
        return cls(
            () if constrained or problem.prior else tuple(f for f in problem.shared if f in linear),
            tuple(f for f in unbounded if f in linear and f not in problem.pooling),
        )


@dataclass(frozen=True)
class Projected:
    """The problem at one point of the searched parameters.

    Attributes
    ----------
    table : ndarray, shape (runs, parameters)
        All values, the eliminated ones solved for.
    residuals : tuple of ndarray
        Weighted residual of each run at `table`.
    per_run : tuple of ndarray
        For each run an orthonormal basis of what its own eliminated parameters can do; empty if there are none.
    shared : ndarray, shape (rows, r), or None
        Orthonormal basis of what the shared eliminated parameters can do beyond that.
    """

    table: FloatArray
    residuals: tuple[FloatArray, ...]
    per_run: tuple[FloatArray, ...] = ()
    shared: FloatArray | None = None

    @cached_property
    def residual(self) -> FloatArray:
        """Residuals of all runs, one after the other."""
        return np.concatenate(self.residuals)

    @cached_property
    def cost(self) -> float:
        with np.errstate(over="ignore"):
            return float(np.sum(self.residual**2))

    def reduced(self, columns: FloatArray) -> FloatArray:
        """Derivatives of the residual with the eliminated parameters held, made derivatives of the reduced one."""
        edges = np.cumsum([0, *(one.size for one in self.residuals)]).tolist()
        for (first, end), basis in zip(pairwise(edges), self.per_run, strict=False):
            columns[first:end] -= basis @ (basis.T @ columns[first:end])
        if self.shared is not None:
            columns -= self.shared @ (self.shared.T @ columns)
        return columns


class Projection:
    """Solves for the eliminated parameters of a problem.

    Parameters
    ----------
    problem : Problem
    eliminated : Eliminated
    scales : mapping of str to float
        Size of a change of each that matters.
    """

    def __init__(self, problem: Problem, eliminated: Eliminated, scales: Mapping[str, float]) -> None:
        self.problem, self.eliminated = problem, eliminated
        self._shared = [problem.fields.index(f) for f in eliminated.shared]
        self._per_run = [problem.fields.index(f) for f in eliminated.per_run]
        self.columns = [*self._shared, *self._per_run]
        self._size = {j: scales[problem.fields[j]] for j in self.columns}
        self._size = {j: s if np.isfinite(s) else 1.0 for j, s in self._size.items()}
        self._lo = np.array([problem.space[f].lo for f in eliminated.shared])
        self._hi = np.array([problem.space[f].hi for f in eliminated.shared])

    @property
    def simulations(self) -> int:
        """Simulations of one run that one call takes."""
        return len(self.problem.runs) * (1 + len(self.columns))

    def __call__(self, table: FloatArray) -> Projected | None:
        """Solve at ``table`` (its eliminated values only serve as reference); None where the model fails."""
        count = 1 + len(self.columns)
        points = [(k, row) for k in range(len(self.problem.runs)) for row in self._probes(table[k])]
        found = self.problem.residuals(points)
        if not all(np.isfinite(residual).all() for residual in found[::count]):
            return None
        if not self.columns:
            return Projected(table, tuple(found))
        remaining, effects, bases, maps = [], [], [], []
        for k in range(len(self.problem.runs)):
            r, *moved = found[k * count : (k + 1) * count]
            effect = np.nan_to_num(np.column_stack([m - r for m in moved]))
            of_shared, of_run = effect[:, : len(self._shared)], effect[:, len(self._shared) :]
            basis, back = _factor(of_run)
            bases.append(basis)
            maps.append((back, r, of_shared))
            remaining.append(r - basis @ (basis.T @ r))
            effects.append(of_shared - basis @ (basis.T @ of_shared))
        residual, effect = np.concatenate(remaining), np.concatenate(effects)
        change, free = self._solve(effect, residual, table[0])
        solved = table.copy()
        size = np.array([self._size[j] for j in self._shared])
        solved[:, self._shared] += change * size
        for k, (back, r, of_shared) in enumerate(maps):
            step = -back @ (r + of_shared @ change)
            solved[k, self._per_run] += step * np.array([self._size[j] for j in self._per_run])
        basis, _ = _factor(effect[:, free])
        residual += effect @ change
        edges = np.cumsum([one.size for one in remaining])[:-1]
        return Projected(solved, tuple(np.split(residual, edges)), tuple(bases), basis)

    def _probes(self, row: FloatArray) -> list[FloatArray]:
        """The row itself, then with each eliminated parameter moved."""
        probes = [row]
        for j in self.columns:
            moved = row.copy()
            moved[j] += self._size[j]
            probes.append(moved)
        return probes

    def _solve(self, effect: FloatArray, residual: FloatArray, row: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Change of the shared eliminated parameters [in their sizes] within bounds, and which ones are free."""
        count = len(self._shared)
        if count == 0:
            return np.zeros(0), np.zeros(0, dtype=bool)
        _, back = _factor(effect)
        change = -back @ residual
        size = np.array([self._size[j] for j in self._shared])
        lo, hi = (self._lo - row[self._shared]) / size, (self._hi - row[self._shared]) / size
        inside = np.asarray((change >= lo) & (change <= hi))
        if not inside.all():
            _, triangle = np.linalg.qr(np.column_stack([effect, -residual]))
            bounded = lsq_linear(triangle[:, :count], triangle[:, count], (lo, hi), method="bvls")
            change = np.clip(bounded.x, lo, hi)
            inside = np.asarray(bounded.active_mask == 0)
        return change, inside


def _factor(effect: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Orthonormal basis of the columns, and the pseudo-inverse; columns that do nothing take no part."""
    u, s, vt = np.linalg.svd(effect, full_matrices=False)
    keep = s > RANK * max(1e-300, s[0]) if s.size else np.zeros(0, dtype=bool)
    return u[:, keep], (vt[keep].T / s[keep]) @ u[:, keep].T
