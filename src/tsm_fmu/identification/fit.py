"""Identification: from runs and a model to parameters with error bars, judged on runs that were not fitted."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.arrays import FloatArray
from ..kernels.kernel import Kernel
from ..logs.agreement import Agreement, agreement
from ..models.contract import InputError
from ..regression.descent import Descent
from ..regression.held_out import SETTLING, settled
from ..regression.intervals import Intervals, linear_intervals, profile_intervals
from ..regression.multistart import MultiStart, drawn_inside
from ..regression.problem import FitRun, Problem
from ..regression.residuals import ResidualTests, noise_floor, residual_tests
from ..regression.search_space import SearchSpace
from ..regression.solver import Report, SearchLog, Solution
from ..regression.uncertainty import Uncertainty, uncertainty
from .findings import conditions_met, fields_on_bound, findings
from .genetic import Evolution
from .informative import check_informative
from .shortfall import shortfalls

if TYPE_CHECKING:
    from lmfit import Parameters

METHODS = {"fast": MultiStart, "paper": Evolution}
INTERVALS = ("linear", "profile")
REWEIGHTINGS = 2
NOISE_UNDERCUT = 1.1
"""A fit leaves at least the noise but for what its few values take up: a floor above that many RMSE is none."""


@dataclass(frozen=True)
class RunResult:
    """One run of a fit: its own parameters (by public name), and its errors by channel."""

    role: str
    values: Mapping[str, float]
    stderr: Mapping[str, float]
    channels: Mapping[str, Agreement]


@dataclass(frozen=True)
class Fit:
    """Result of `fit`.

    Attributes
    ----------
    kernel : Kernel
    channels : tuple of str
        Fitted outputs.
    parameters : lmfit.Parameters
        By field: value, standard error, bounds, correlations. A per-run parameter has the mean over the measured
        runs, with the standard error of that mean (of one run: its own).
    intervals : mapping of str to (float, float)
        95 % interval of each free parameter that has one, by field.
    per_run : tuple of str
        Fields with one value a run.
    runs : mapping of str to RunResult
        Measured runs first, then held-out ones.
    measured, holdout : mapping of str to Agreement
        Errors pooled over the samples of the runs.
    at_bound : frozenset of str
        Fields that a bound, or a joint condition of the model, stopped.
    undetermined : tuple of str
        Fields that these runs do not determine.
    findings : tuple of str
        What the user should know, in sentences.
    residuals : mapping of str to ResidualTests
        Of each channel over the measured runs.
    noise_floor : mapping of str to float
        RMS by which each channel does not repeat from period to period, of the measured runs whose motion repeats; not
        of channels in which the fit leaves less than that.
    uncertainty : Uncertainty
    evaluations : int
        Simulations of one run.
    wall_s : float
    method : str
    interval_method : str
    seed : int
    complete : bool
        False if the fit was interrupted: the parameters are the best until then.
    """

    kernel: Kernel
    channels: tuple[str, ...]
    parameters: Parameters
    intervals: Intervals
    per_run: tuple[str, ...]
    runs: Mapping[str, RunResult]
    measured: Mapping[str, Agreement]
    holdout: Mapping[str, Agreement]
    at_bound: frozenset[str]
    undetermined: tuple[str, ...]
    findings: tuple[str, ...]
    residuals: Mapping[str, ResidualTests]
    noise_floor: Mapping[str, float]
    uncertainty: Uncertainty
    evaluations: int
    wall_s: float
    method: str
    interval_method: str
    seed: int
    complete: bool


class FitInterrupted(KeyboardInterrupt):
    """Ctrl-C during a fit; `fit` is the best until then, with `Fit.complete` False."""

    def __init__(self, fit: Fit) -> None:
        super().__init__("interrupted")
        self.fit = fit


def fit(
    kernel: Kernel,
    runs: Sequence[FitRun],
    channels: Sequence[str],
    space: SearchSpace,
    *,
    holdout: Sequence[FitRun] = (),
    method: str = "fast",
    single_start: bool = False,
    intervals: str = "linear",
    seed: int = 0,
    weights: Mapping[str, float] | None = None,
    progress: Report | None = None,
) -> Fit:
    """Fit the varying parameters of a kernel to measured runs.

    Parameters
    ----------
    kernel : Kernel
    runs : sequence of FitRun
        From `specification.fit_run`.
    channels : sequence of str
        Names of the target columns.
    space : SearchSpace
        From `specification.search_space`, or `SearchSpace.from_lmfit`.
    holdout : sequence of FitRun
        Judged with the shared values of the fit; the per-run values come from the first 2 s, which are not scored.
    method : {'fast', 'paper'}
    single_start : bool
        Refine the given start values only, where they are known well: no other starts, no genetic search.
    intervals : {'linear', 'profile'}
        From the standard errors, or from the profile of the error, see `intervals`; per-run values have linear ones.
    seed : int
        Same seed, same result.
    weights : mapping of str to float, optional
        Noise of each channel in its unit [SI]; without it, the residual of the fit itself (iterated).
    progress : callable, optional
        See `tsm_fmu.regression.solver.Progress`.

    Raises
    ------
    InputError
        Unknown method or intervals, no runs, or a model that fails at its start values.
    FitInterrupted
        Ctrl-C, once there is anything to keep.
    """
    if method not in METHODS:
        raise InputError(f"method {method!r} -- expected one of {', '.join(METHODS)} -- choose one")
    if intervals not in INTERVALS:
        raise InputError(f"intervals {intervals!r} -- expected one of {', '.join(INTERVALS)} -- choose one")
    if not runs:
        raise InputError("no measured run -- expected at least one -- give it with --measured RUN")
    begin = clock.perf_counter()
    problem = Problem(kernel, list(runs), tuple(channels), space)
    if weights is not None:
        problem = problem.reweighted(np.array([1.0 / weights[channel] for channel in channels]))
    check_informative(problem)
    for run, simulated in zip(runs, problem.outputs_of_all(problem.start()), strict=True):
        if not np.isfinite(simulated).all():
            raise InputError(
                f"{kernel.name} gives no finite output on run {run.name} at the start values -- expected a start "
                "from which it can run -- choose others with --set"
            )
    log, solver = SearchLog(progress), METHODS[method](seed)
    complete = True
    first = Solution(problem.start()) if single_start else None
    reweightings = REWEIGHTINGS if len(problem.channels) > 1 and weights is None else 0
    log.plan(solver.phases(problem, first) + reweightings + (intervals == "profile"))
    try:
        best = solver(problem, log, first)
        for _ in range(reweightings):
            problem = problem.reweighted(_weights(problem, best.table))
            best = solver(problem, log, best)
    except KeyboardInterrupt:
        if log.best is None:
            raise
        complete = False
        best = Solution(_interrupted(problem, log.best))
    table = best.table
    at_bound = fields_on_bound(problem, table)
    known = uncertainty(problem, table, at_bound)
    filled = _filled(problem, table, known)
    found = linear_intervals(filled, at_bound)
    profiled = intervals != "profile" or not complete
    try:
        if not profiled:
            profile_intervals(problem, best, known, found, MultiStart(), log)
            profiled = True
    except KeyboardInterrupt:
        complete = False
    holdout_fits = [(run, settled(problem, table, run, problem.per_run)) for run in holdout]
    results = _results(problem, table, known, holdout_fits)
    conditions = conditions_met(problem, table)
    notes, undetermined = findings(problem, table, at_bound, conditions, known)
    if not profiled:
        notes = ("interrupted: the intervals that were not reached are linear ones", *notes)
    elif not complete:
        notes = ("interrupted: the values are the best until then, not the optimum", *notes)
    pooled = _pooled(problem, [(run, table[k], 0.0) for k, run in enumerate(problem.runs)])
    residuals, floors = _residual_tests(problem, table), _noise_floor(problem, pooled)
    if complete:
        notes += shortfalls(pooled, [r.channels for r in results.values() if r.role == "measured"], floors, residuals)
    result = Fit(
        kernel=kernel,
        channels=problem.channels,
        parameters=filled,
        intervals=found,
        per_run=problem.per_run,
        runs=results,
        measured=pooled,
        holdout=_pooled(problem, [(run, row, SETTLING) for run, row in holdout_fits]) if holdout_fits else {},
        at_bound=at_bound | frozenset(f for fields in conditions.values() for f in fields),
        undetermined=undetermined,
        findings=notes,
        residuals=residuals,
        noise_floor=floors,
        uncertainty=known,
        evaluations=log.simulations,
        wall_s=clock.perf_counter() - begin,
        method=method,
        interval_method=intervals,
        seed=seed,
        complete=complete,
    )
    if not complete:
        raise FitInterrupted(result)
    return result


def _interrupted(problem: Problem, table: FloatArray) -> FloatArray:
    """The best values until an interruption, allowed by the model; what each run has of its own fitted to them."""
    if problem.refused(table):
        table = drawn_inside(problem, table)
    alone = problem.over(problem.space.freeing_only(problem.per_run))
    return Descent().refined(alone, table)


def _weights(problem: Problem, table: FloatArray) -> FloatArray:
    """1/RMS residual of each channel: the likelihood's choice when the noise is not known."""
    gaps = np.concatenate(problem.gaps(table))
    return 1.0 / np.maximum(np.sqrt(np.mean(gaps**2, axis=0)), 1e-9 / problem.weights)


def _pooled(problem: Problem, holdout_fits: Sequence[tuple[FitRun, FloatArray, float]]) -> dict[str, Agreement]:
    """Errors by channel, pooled over runs, each from so many seconds after its start."""
    measured, errors = [], []
    for run, row, after in holdout_fits:
        scored = run.time >= run.time[0] + after
        simulated = problem.with_runs([run]).outputs(0, row)
        measured.append(run.targets[scored])
        errors.append((simulated - run.targets)[scored])
    units = {v.name: v.quantity.unit for v in problem.kernel.outputs}
    return {
        channel: agreement(units[channel], [m[:, j] for m in measured], [e[:, j] for e in errors])
        for j, channel in enumerate(problem.channels)
    }


def _residual_tests(problem: Problem, table: FloatArray) -> dict[str, ResidualTests]:
    gaps = problem.gaps(table)
    times = [run.time for run in problem.runs]
    return {c: residual_tests(times, [gap[:, j] for gap in gaps]) for j, c in enumerate(problem.channels)}


def _noise_floor(problem: Problem, pooled: Mapping[str, Agreement]) -> dict[str, float]:
    """By channel; one that the fit undercuts is no floor: there the motion repeats only nearly."""
    floors = [floor for run in problem.runs if (floor := noise_floor(run)) is not None]
    if not floors:
        return {}
    level = np.sqrt(np.mean(np.square(floors), axis=0)).tolist()
    return {c: one for c, one in zip(problem.channels, level, strict=True) if one < NOISE_UNDERCUT * pooled[c].rmse}


def _results(
    problem: Problem, table: FloatArray, known: Uncertainty, holdout_fits: Sequence[tuple[FitRun, FloatArray]]
) -> dict[str, RunResult]:
    def per_run(row: FloatArray) -> dict[str, float]:
        return {problem.declared[f].name: float(row[problem.fields.index(f)]) for f in problem.per_run}

    results = {}
    for k, run in enumerate(problem.runs):
        errors = {problem.declared[f].name: value for f, value in known.per_run[k].items()}
        results[run.name] = RunResult("measured", per_run(table[k]), errors, _pooled(problem, [(run, table[k], 0.0)]))
    for run, row in holdout_fits:
        results[run.name] = RunResult("holdout", per_run(row), {}, _pooled(problem, [(run, row, SETTLING)]))
    return results


def _filled(problem: Problem, table: FloatArray, known: Uncertainty) -> Parameters:
    """The lmfit parameters with values, standard errors and correlations."""
    result = problem.space.to_lmfit()
    for j, name in enumerate(problem.fields):
        result[name].value = float(table[:, j].mean())
        stderr = known.stderr.get(name, math.nan)
        if name in problem.per_run:
            one = len(problem.runs) == 1
            spread = known.per_run[0].get(name, math.nan) if one else float(np.std(table[:, j], ddof=1))
            stderr = spread / math.sqrt(len(problem.runs))
        result[name].stderr = stderr if math.isfinite(stderr) else None
        if name in known.names:
            i = known.names.index(name)
            result[name].correl = {
                other: float(known.correlation[i, m]) for m, other in enumerate(known.names) if other != name
            }
    return result
