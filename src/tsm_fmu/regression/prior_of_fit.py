"""The `Prior` of a fit: what its runs say of its parameters."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..kernels.arrays import FloatArray
from .prior import Prior, triangle_of
from .problem import Problem
from .scaled_variables import logarithm_sign
from .sensitivity import residual_jacobian, row_edges, sensitivity_scales


def prior_of_fit(problem: Problem, table: FloatArray) -> Prior:
    """How the sum of squares of a fit rises around its minimum.

    Parameters
    ----------
    problem : Problem
    table : ndarray, shape (runs, parameters)
        At the minimum.
    """
    unit = problem.reweighted(np.ones(len(problem.channels)))
    residuals = unit.residuals(list(enumerate(table)))
    scales = sensitivity_scales(problem.starting_at(table))
    slopes = residual_jacobian(unit, table, residuals, problem.space.free, scales)
    count = len(problem.shared)
    values = np.array([table[0, problem.fields.index(f)] for f in problem.shared])
    logarithmic = np.array([bool(logarithm_sign(problem.declared[f].quantity)) for f in problem.shared], bool)
    known = Prior(problem.shared, np.empty(0), logarithmic, ())
    slopes[:, :count] *= known.unit(values)
    slopes = np.hstack([slopes[:, count:], slopes[:, :count]])
    each = [np.split(slopes[a:b], len(problem.channels)) for a, b in pairwise(row_edges(residuals).tolist())]
    triangles = tuple(triangle_of(np.vstack(rows)) for rows in zip(*each, strict=True))
    return Prior(problem.shared, known.searched(values), logarithmic, triangles)
