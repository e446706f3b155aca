"""Held-out runs: judged with the shared values of a fit; what each run has of its own comes from its first seconds."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ..kernels.arrays import BoolArray, FloatArray
from ..models.contract import InputError
from .descent import Descent
from .problem import FitRun, Problem
from .sensitivity import sensitivity_scales
from .uncertainty import autocorrelation_time

TELLING_DEVIANCE = 8.0
"""Twice a difference of log likelihoods beyond which values of a run are no chance, which makes that in one of 200."""
SETTLING = 2.0
"""Seconds of a held-out run that give its per-run parameters (initial state, offset) and are not scored."""


def is_settling(run: FitRun) -> BoolArray:
    """Samples that are not scored."""
    return run.time < run.time[0] + SETTLING


def settled(problem: Problem, table: FloatArray, run: FitRun, fields: Collection[str]) -> FloatArray:
    """Values of a fit for a run that was not fitted.

    The first seconds may not tell two of a run's own parameters apart, such as an offset and the start of a slow state:
    what they leave open stays near the middle one of the runs fitted. A change that moves the channels by a standard
    deviation weighs as much as one independent sample of the fit's own error.

    Parameters
    ----------
    problem : Problem
        Of the fit.
    table : ndarray, shape (runs, parameters)
        Its solution.
    run : FitRun
        Held out.
    fields : collection of str
        Per-run parameters that this run gives; every other one has the mean of its values in the table.

    Returns
    -------
    ndarray, shape (parameters,)

    Raises
    ------
    InputError
        A run too short to leave anything to score.
    """
    early = is_settling(run)
    if early.all() or early.sum() < 2:
        raise InputError(
            f"held-out run {run.name} of {np.ptp(run.time):g} s -- expected more than the {SETTLING:g} s that give its "
            "initial state and are not scored -- give a longer one"
        )
    start = run.only(early)
    free = [f for f in problem.space.free if f in fields]
    means = dict(zip(problem.fields, table.mean(axis=0).tolist(), strict=True))
    means |= {f: float(np.median(table[:, problem.fields.index(f)])) for f in free}  # that of one run may run away
    space = problem.space.starting_at(means).freeing_only(free).with_per_run(free)
    scales, error = sensitivity_scales(replace(problem, runs=[run], space=space)), _error(problem, table)
    pooling = {f: error / scales[f] for f in free}
    single = replace(problem, runs=[start], space=space, pooling=pooling, centres=means, kept=())
    found = Descent().refined(single, single.start())
    return found[0] if _tells(single, single.start(), found) else single.start()[0]


def _tells(problem: Problem, start: FloatArray, found: FloatArray) -> bool:
    """Whether the samples of a run tell its own values from the middle ones by more than chance makes.

    Of an offset beside a state at the start a few samples hold the sum alone: either could run away.
    """
    before, after = (problem.gaps(table)[0] * problem.weights for table in (start, found))
    independent = sum(len(r) / autocorrelation_time(r) for r in after.T)
    gained, left = float(np.sum(before**2) - np.sum(after**2)), float(np.sum(after**2))
    return not gained <= TELLING_DEVIANCE * left / max(independent, 1.0)


def _error(problem: Problem, table: FloatArray) -> float:
    """Weighted error of an independent sample: slow errors are alike in the samples of their autocorrelation time."""
    found = [
        float(np.mean(r**2)) * autocorrelation_time(r)
        for gaps in problem.gaps(table)
        for r in (gaps * problem.weights).T
    ]
    return math.sqrt(np.mean(found))


def held_out_errors(
    problem: Problem, table: FloatArray, runs: Sequence[FitRun], fields: Collection[str]
) -> list[FloatArray]:
    """Measured minus simulated channels of held-out runs, from `SETTLING` on, shape (samples, channels) each."""
    found = []
    for run in runs:
        simulated = problem.with_runs([run]).outputs(0, settled(problem, table, run, fields))
        found.append((run.targets - simulated)[~is_settling(run)])
    return found
