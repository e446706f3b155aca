"""Variable projection: the parameters in which a model is linear are solved for, not searched.

For a point of the searched parameters the eliminated ones follow from a linear least-squares problem; the
residual that is left, and its Jacobian in Kaufman's approximation (Kaufman 1975; Golub and Pereyra 2003),
are those of a problem in the searched parameters alone. Per-run parameters are eliminated run by run, so that
fifty runs with an offset each cost no more than fifty small problems.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import lsq_linear

from .problem import BoolArray, FloatArray, Problem

RANK = 1e-8
"""Singular values below this part of the largest count as zero."""


@dataclass(frozen=True)
class Projected:
    """The problem at one point of the searched parameters.

    Attributes
    ----------
    table : ndarray, shape (runs, parameters)
        All values, the eliminated ones solved for.
    residual : ndarray, shape (rows,)
        Weighted residual at `table`.
    own : tuple of ndarray
        For each run an orthonormal basis of what its own eliminated parameters can do.
    shared : ndarray, shape (rows, r)
        Orthonormal basis of what the shared eliminated parameters can do beyond that.
    """

    table: FloatArray
    residual: FloatArray
    own: tuple[FloatArray, ...]
    shared: FloatArray

    @cached_property
    def cost(self) -> float:
        return float(np.sum(self.residual**2))

    @cached_property
    def rows(self) -> tuple[slice, ...]:
        """Rows of each run in `residual`."""
        edges = np.cumsum([0, *(basis.shape[0] for basis in self.own)])
        return tuple(slice(a, b) for a, b in pairwise(edges.tolist()))

    def reduced(self, columns: FloatArray) -> FloatArray:
        """Derivatives of the residual with the eliminated parameters held, made derivatives of the reduced one."""
        columns = columns.copy()
        for rows, basis in zip(self.rows, self.own, strict=True):
            columns[rows] -= basis @ (basis.T @ columns[rows])
        return columns - self.shared @ (self.shared.T @ columns)


class Projection:
    """Solves for the eliminated parameters of a problem.

    Parameters
    ----------
    problem : Problem
    shared, own : tuple of str
        Eliminated fields; the channels must be jointly affine in them.
    scales : mapping of str to float
        Size of a change of each that matters.
    """

    def __init__(
        self, problem: Problem, shared: tuple[str, ...], own: tuple[str, ...], scales: Mapping[str, float]
    ) -> None:
        self.problem = problem
        self._shared = [problem.fields.index(f) for f in shared]
        self._own = [problem.fields.index(f) for f in own]
        self._size = {j: scales[problem.fields[j]] for j in (*self._shared, *self._own)}
        self._size = {j: s if np.isfinite(s) else 1.0 for j, s in self._size.items()}
        self._lo = np.array([problem.parameters[f].min for f in shared])
        self._hi = np.array([problem.parameters[f].max for f in shared])
        self.simulations = 0

    def __call__(self, table: FloatArray) -> Projected | None:
        """Solve at ``table`` (its eliminated values only serve as reference); None where the model fails."""
        columns = [*self._shared, *self._own]
        wanted = [(k, row) for k in range(len(self.problem.runs)) for row in self._probes(table[k], columns)]
        found = self.problem.residuals(wanted)
        self.simulations += len(wanted)
        left, effects, own_bases, own_maps = [], [], [], []
        for k in range(len(self.problem.runs)):
            r, *moved = found[k * (1 + len(columns)) : (k + 1) * (1 + len(columns))]
            if not np.isfinite(r).all():
                return None
            effect = np.nan_to_num(np.column_stack([m - r for m in moved]) if moved else np.empty((r.size, 0)))
            of_shared, of_own = effect[:, : len(self._shared)], effect[:, len(self._shared) :]
            basis, back = _factor(of_own)
            own_bases.append(basis)
            own_maps.append((back, r, of_shared))
            left.append(r - basis @ (basis.T @ r))
            effects.append(of_shared - basis @ (basis.T @ of_shared))
        residual, effect = np.concatenate(left), np.concatenate(effects)
        change, free = self._solve(effect, residual, table[0])
        solved = table.copy()
        size = np.array([self._size[j] for j in self._shared])
        solved[:, self._shared] += change * size
        for k, (back, r, of_shared) in enumerate(own_maps):
            step = -back @ (r + of_shared @ change)
            solved[k, self._own] += step * np.array([self._size[j] for j in self._own])
        basis, _ = _factor(effect[:, free])
        return Projected(solved, residual + effect @ change, tuple(own_bases), basis)

    def _probes(self, row: FloatArray, columns: list[int]) -> list[FloatArray]:
        """The row itself, then with each eliminated parameter moved."""
        probes = [row]
        for j in columns:
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
