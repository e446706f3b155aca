"""Sparse regression on sums of products: few terms, chosen and judged by parts of the log that were left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...kernels.arrays import FloatArray
from ..criteria import FORMULA_TERM_SHARE, FORMULA_TERMS

RIDGE = 1e-8


@dataclass(frozen=True)
class Sums:
    """Products of the columns with each other and with the residual, for each fold.

    Attributes
    ----------
    gram : ndarray, shape (folds, p, p)
    cross : ndarray, shape (folds, p)
    power : ndarray, shape (folds,)
        Sum of squares of the residual.
    """

    gram: FloatArray
    cross: FloatArray
    power: FloatArray

    @cached_property
    def whole(self) -> tuple[FloatArray, FloatArray]:
        return self.gram.sum(axis=0), self.cross.sum(axis=0)

    def without(self, fold: int) -> tuple[FloatArray, FloatArray]:
        gram, cross = self.whole
        return gram - self.gram[fold], cross - self.cross[fold]


def sums(columns: FloatArray, residual: FloatArray, fold: NDArray[np.int_]) -> Sums:
    """`Sums` of columns (n, p) of about unit size and a residual (n,) over the folds 0, 1, ..."""
    parts = [(columns[fold == f], residual[fold == f]) for f in range(int(fold.max()) + 1)]
    return Sums(
        np.array([x.T @ x for x, _ in parts]), np.array([x.T @ y for x, y in parts]),
        np.array([float(y @ y) for _, y in parts]),
    )  # fmt: skip


def best_subsets(gram: FloatArray, cross: FloatArray, most: int = FORMULA_TERMS) -> list[list[int]]:
    """Best sets of 1, 2, ... columns: each adds the column that helps most, then swaps single ones while that helps.

    Orthogonal least squares (Chen, Billings, Luo, Int. J. Control 50, 1989) with exchanges.
    """
    found: list[list[int]] = []
    now: list[int] = []
    for _ in range(min(most, cross.size)):
        now = [*now, _best_addition(gram, cross, now)]
        for _ in range(len(now)):  # a term is exchanged at most so often
            before = list(now)
            for term in before[:-1]:
                rest = [j for j in now if j != term]
                now = [*rest, _best_addition(gram, cross, rest)]
            if set(now) == set(before):
                break
        found.append(sorted(now))
    return found


def coefficients_of(gram: FloatArray, cross: FloatArray, terms: Sequence[int]) -> FloatArray:
    """Least-squares coefficients of some columns."""
    inner = gram[np.ix_(terms, terms)]
    solved = np.linalg.solve(inner + RIDGE * np.diag(np.diag(inner)), cross[list(terms)])
    return np.asarray(solved, float)


def cross_validated_shares(data: Sums, most: int = FORMULA_TERMS) -> FloatArray:
    """Share of the residual's mean square predicted on left-out folds with 1, 2, ... terms, chosen without them."""
    lost = np.zeros(min(most, data.cross.shape[1]))
    for f in range(data.power.size):
        gram, cross = data.without(f)
        for k, terms in enumerate(best_subsets(gram, cross, most)):
            lost[k] += _loss(data, f, terms, coefficients_of(gram, cross, terms))
    return 1.0 - lost / max(float(data.power.sum()), 1e-300)


def cross_validated_share(data: Sums, terms: Sequence[int]) -> float:
    """Share of the mean square that given terms predict on left-out folds, with coefficients found without the fold."""
    lost = sum(_loss(data, f, terms, coefficients_of(*data.without(f), terms)) for f in range(data.power.size))
    return 1.0 - lost / max(float(data.power.sum()), 1e-300)


def fewest_terms(shares: FloatArray) -> int:
    """Number of terms: the fewest that predict nearly as much as any number."""
    return int(np.argmax(shares >= shares.max() - FORMULA_TERM_SHARE)) + 1


def _loss(data: Sums, fold: int, terms: Sequence[int], coefficients: FloatArray) -> float:
    cross, gram = data.cross[fold][list(terms)], data.gram[fold][np.ix_(terms, terms)]
    return float(data.power[fold] - 2.0 * coefficients @ cross + coefficients @ gram @ coefficients)


def _best_addition(gram: FloatArray, cross: FloatArray, now: list[int]) -> int:
    correlation, size = cross, np.diag(gram)
    if now:
        inner = gram[np.ix_(now, now)]
        solved = np.linalg.solve(inner + RIDGE * np.diag(np.diag(inner)), np.column_stack([cross[now], gram[now]]))
        correlation = cross - gram[:, now] @ solved[:, 0]
        size = size - np.einsum("ij,ji->i", gram[:, now], solved[:, 1:])
    gain = np.where(size > 1e-6 * np.diag(gram), correlation**2 / np.maximum(size, 1e-300), -1.0)
    gain[now] = -1.0
    return int(np.argmax(gain))
