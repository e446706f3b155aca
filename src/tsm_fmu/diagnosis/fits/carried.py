"""What a fit leaves on runs that were not fitted, once its values have moved there within what its own runs leave open.

Held-out runs have another motion, and show other parameters well than the measured ones: values that these hardly
determine say nothing there. The values of one rig must serve all its runs, so they may move to the held-out ones, and
what that costs on the measured runs counts as left over. Where a measured run is left out, the values that have moved
are those of the fit to all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...kernels.arrays import FloatArray
from ...regression.held_out import is_settling
from ...regression.problem import FitRun
from ...regression.residuals import rms
from .refit import Fitted, descent, effective_samples

STEPS = 30
"""Steps of the move at most, but for one under way: before its end a law may seem not to carry over."""
LEAST_CHANGE = 1e-3
"""Change of the sum of squares at which it ends."""


@dataclass(frozen=True)
class CarriedOver:
    """What is left of held-out runs.

    Attributes
    ----------
    mean_square : ndarray, shape (channels,)
        With what the move costs on the runs that were fitted.
    effective : ndarray, shape (channels,)
        Independent samples that it is worth.
    samples : int
    """

    mean_square: FloatArray
    effective: FloatArray
    samples: int


def carried_over(fitted: Fitted, runs: Sequence[FitRun], steps: int = STEPS) -> CarriedOver:
    """Judge a fit on runs that were not fitted, from their settling on; what a run has of its own is fitted to it.

    Parameters
    ----------
    fitted : Fitted
    runs : sequence of FitRun
    steps : int
        Of the move; without any the values stay, and a run has of its own what its settling gives.

    Raises
    ------
    InputError
        A run too short to leave anything to score.
    """
    problem, count = fitted.problem, len(fitted.problem.runs)
    rows = [fitted.settled(run) for run in runs]
    late = [run.compared_from(int(is_settling(run).sum())) for run in runs]
    # a few steps along a joint condition do not come to their end; the fit has kept it
    joint, start = replace(problem, runs=[*problem.runs, *late], kept=()), np.vstack([fitted.table, *rows])
    move = replace(descent(steps), cost_tolerance=LEAST_CHANGE)
    gaps = joint.gaps(move.refined(joint, start, fitted.scales) if steps else start)
    return _carried(fitted, gaps[:count], gaps[count:])


def left_out(fitted: Fitted, fold: Fitted, out: Sequence[int]) -> CarriedOver:
    """Judge a fit on some of its runs, from their settling on.

    Parameters
    ----------
    fitted : Fitted
        To all runs.
    fold : Fitted
        The same, fitted without these.
    out : sequence of int
        Their numbers.
    """
    gaps = fitted.residuals
    left = [gaps[k][is_settling(fitted.problem.runs[k]).sum() :] for k in out]
    return _carried(fold, [r for k, r in enumerate(gaps) if k not in out], left)


def _carried(fitted: Fitted, moved: Sequence[FloatArray], left: Sequence[FloatArray]) -> CarriedOver:
    """What is left, with what it costs the runs of a fit that the values have moved."""
    cost = np.maximum(rms(moved) ** 2 - fitted.rmse**2, 0.0)
    return CarriedOver(rms(left) ** 2 + cost, effective_samples(left), sum(len(r) for r in left))


def pooled(parts: Sequence[CarriedOver]) -> CarriedOver:
    """That of several fits, each with runs of its own left out."""
    samples = sum(p.samples for p in parts)
    mean_square = sum((p.samples * p.mean_square for p in parts), np.zeros(1)) / samples
    return CarriedOver(mean_square, sum((p.effective for p in parts), np.zeros(1)), samples)
