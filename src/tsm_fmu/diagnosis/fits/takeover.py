"""Where the rest of a model goes when an effect is taken out of it: its parameters take over what they can."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...kernels.arrays import FloatArray
from ...kernels.chain import attach
from ...kernels.kernel import Kernel, kernel
from ...models.contract import flat
from ...regression.sensitivity import output_jacobian
from .refit import Fitted

Place = tuple[Mapping[str, float], Mapping[str, FloatArray]]
"""Where a refit starts: values by public name, and those that each run has of its own."""
INDEPENDENT = 1e-8
"""Singular values of the slopes, each of unit length, below this part of the largest say nothing."""


def without(fitted: Fitted, spec: str) -> Fitted:
    """A fit with an effect at neutral and the other parameters where they, to first order, do what it does.

    An offset of a channel beside a zero of the model may be any number, and the zero the same with the other sign. A
    descent from such a zero, the offset gone, first mends it by whatever is at hand, and may stay there.

    Parameters
    ----------
    fitted : Fitted
    spec : str
        The effect, as ``id`` or ``id@channel``.
    """
    one = attach(kernel(fitted.model), spec)
    own = [one.prefix + v.field for v in Kernel(one.module).parameters]
    problem = fitted.problem.over(fitted.problem.space.fixing(own))
    table = fitted.table.copy()
    table[:, [problem.fields.index(f) for f in own]] = flat(one.module.NEUTRAL)
    done = np.concatenate(problem.gaps(table)) - np.concatenate(fitted.residuals)
    slopes = output_jacobian(problem, table, problem.weights)
    length = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    if np.isfinite(done).all():
        taken = np.linalg.lstsq(slopes / length, (done * problem.weights).ravel(), rcond=INDEPENDENT)[0]
        with np.errstate(over="ignore"):  # of slopes that are next to none, far from any answer
            moves = taken / length
        if np.isfinite(moves).all():
            table = _moved(fitted, problem.space.free, table, moves)
    return Fitted(fitted.task, fitted.effects, problem, table, fitted.released)


def _moved(fitted: Fitted, free: tuple[str, ...], table: FloatArray, moves: FloatArray) -> FloatArray:
    """Each field moved by its own, within its bounds: shared ones first, then those with a move for each run."""
    problem, table, runs = fitted.problem, table.copy(), len(table)
    shared = [f for f in free if f not in problem.per_run]
    for j, field in enumerate(shared):
        table[:, problem.fields.index(field)] += moves[j]
    for j, field in enumerate(f for f in free if f in problem.per_run):
        table[:, problem.fields.index(field)] += moves[len(shared) + j * runs :][:runs]
    for field in free:
        k, space = problem.fields.index(field), problem.space[field]
        table[:, k] = np.clip(table[:, k], space.lo, space.hi)
    return table
