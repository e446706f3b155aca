"""Is a residual a law or noise: how much of it a regression on the coordinates predicts on parts that it has not seen.

Coloured noise cannot be predicted from the motion, so this share needs neither repeats nor a noise model. The
regression is linear in smooth and switching functions of the coordinates; it is judged by blocks that were left
out, whole runs where there are several.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...kernels.arrays import FloatArray
from ..runs.motion_signals import Coordinates
from .library import folds, library

DAMPING = (1e-4, 1e-2, 1.0)
"""Ridge factors tried, relative to the samples."""
ROWS = 3000
"""Rows of one run that the regression sees."""


def predictable_share(
    residuals: Sequence[FloatArray], places: Sequence[Coordinates], motion_unit: str, load_unit: str
) -> FloatArray:
    """Share of each channel's residual mean square that the coordinates predict where it was not fitted, 0 to 1.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n, channels)
        One array a run.
    places : sequence of Coordinates
    motion_unit, load_unit : str
        SI units of x and of the load.
    """
    steps = [max(1, r.shape[0] // ROWS) for r in residuals]
    thin = [c.part(slice(None, None, step)) for c, step in zip(places, steps, strict=True)]
    y = np.concatenate([r[::step] for r, step in zip(residuals, steps, strict=True)])
    columns = [np.concatenate(term.values) for term in library(thin, motion_unit, load_unit) if not term.local]
    x = np.column_stack(columns)
    x /= np.sqrt(np.mean(x**2, axis=0))
    return share_left_out(x, y, folds([c.x.size for c in thin]), DAMPING)


def share_left_out(x: FloatArray, y: FloatArray, fold: NDArray[np.int_], dampings: Sequence[float]) -> FloatArray:
    """Share of the mean square of each column of y that a ridge regression on x predicts on folds left out, 0 to 1.

    Parameters
    ----------
    x : ndarray, shape (n, functions)
        Columns of about the same size.
    y : ndarray, shape (n, channels)
    fold : ndarray, shape (n,)
        Which fold a sample belongs to.
    dampings : sequence of float
        Ridge factors, relative to the samples; of each channel the one that predicts most counts.
    """
    parts = [(x[fold == f], y[fold == f]) for f in np.unique(fold)]
    grams, crosses = [a.T @ a for a, _ in parts], [a.T @ b for a, b in parts]
    gram, cross, best = sum(grams), sum(crosses), np.zeros(y.shape[1])
    for damping in dampings:
        missed = np.zeros(y.shape[1])
        for (a, b), g, c in zip(parts, grams, crosses, strict=True):
            regular = damping * (len(y) - len(b)) * np.eye(x.shape[1])
            missed += np.sum((b - a @ np.linalg.solve(gram - g + regular, cross - c)) ** 2, axis=0)
        best = np.maximum(best, 1.0 - missed / np.maximum(np.sum(y**2, axis=0), 1e-300))
    return best
