"""Identification: from runs and a model to parameters with error bars, judged on runs that were not fitted."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from lmfit import Parameters

from ..kernels.kernel import Kernel
from ..logs.agreement import Agreement, agreement
from ..models.contract import InputError
from ..regression.intervals import Intervals, linear_intervals, profile_intervals
from ..regression.problem import FitRun, FloatArray, Problem
from ..regression.residuals import ResidualTests, noise_floor, residual_tests
from ..regression.search import Progress, Search, drawn_inside, search_fast
from ..regression.uncertainty import Uncertainty, uncertainty
from .findings import conditions_met, fields_on_bound, findings
from .genetic import search_paper
from .informative import check_informative

METHODS = {"fast": search_fast, "paper": search_paper}
INTERVALS = ("linear", "profile")
SETTLING = 2.0
"""Seconds of a held-out run that give its initial state and offset, and are not scored."""
REWEIGHTINGS = 2


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
        RMS by which each channel does not repeat from period to period, of the measured runs whose motion repeats.
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


def fit(
    kernel: Kernel,
    runs: Sequence[FitRun],
    channels: Sequence[str],
    parameters: Parameters,
    *,
    per_run: Sequence[str] = (),
    holdout: Sequence[FitRun] = (),
    method: str = "fast",
    single_start: bool = False,
    intervals: str = "linear",
    seed: int = 0,
    weights: Mapping[str, float] | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Fit the varying parameters of a kernel to measured runs.

    Parameters
    ----------
    kernel : Kernel
    runs : sequence of FitRun
        From `specification.fit_run`.
    channels : sequence of str
        Names of the target columns.
    parameters : lmfit.Parameters
        From `specification.fit_parameters`.
    per_run : sequence of str
        Fields with one value a run, from `specification.per_run_fields`.
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
        See `search.Progress`.

    Raises
    ------
    InputError
        Unknown method or intervals, no runs, or a model that fails at its start values.
    """
    if method not in METHODS:
        raise InputError(f"method {method!r} -- expected one of {', '.join(METHODS)} -- choose one")
    if intervals not in INTERVALS:
        raise InputError(f"intervals {intervals!r} -- expected one of {', '.join(INTERVALS)} -- choose one")
    if not runs:
        raise InputError("no measured run -- expected at least one -- give it with --measured RUN")
    begin = clock.perf_counter()
    problem = Problem(kernel, list(runs), tuple(channels), parameters, tuple(per_run))
    if weights is not None:
        problem = problem.reweighted(np.array([1.0 / weights[channel] for channel in channels]))
    check_informative(problem)
    for run, simulated in zip(runs, problem.outputs_of_all(problem.start()), strict=True):
        if not np.isfinite(simulated).all():
            raise InputError(
                f"{kernel.name} gives no finite output on run {run.name} at the start values -- expected a start "
                "from which it can run -- choose others with --set"
            )
    search = Search(progress)
    complete = True
    try:
        table = METHODS[method](problem, search, seed, problem.start() if single_start else None)
        for _ in range(REWEIGHTINGS if len(problem.channels) > 1 and weights is None else 0):
            problem = problem.reweighted(_weights(problem, table))
            search.best, search.error = None, math.inf
            table = METHODS[method](problem, search, seed, table)
    except KeyboardInterrupt:
        if search.best is None:
            raise
        complete = False
        table = search.best
        if problem.refused(table):
            table = drawn_inside(problem, table)
    at_bound = fields_on_bound(problem, table)
    known = uncertainty(problem, table, at_bound)
    filled = _filled(problem, table, known)
    found = linear_intervals(filled, at_bound)
    profiled = intervals != "profile" or not complete
    try:
        if not profiled:
            profile_intervals(problem, table, known, search, found)
            profiled = True
    except KeyboardInterrupt:
        complete = False
    judged = [(run, _settled(problem, table, run, seed)) for run in holdout]
    results = _results(problem, table, known, judged)
    conditions = conditions_met(problem, table)
    said, undetermined = findings(problem, table, at_bound, conditions, known)
    if not profiled:
        said = ("interrupted: the intervals that were not reached are linear ones", *said)
    elif not complete:
        said = ("interrupted: the values are the best until then, not the optimum", *said)
    return Fit(
        kernel=kernel,
        channels=problem.channels,
        parameters=filled,
        intervals=found,
        per_run=problem.own,
        runs=results,
        measured=_pooled(problem, [(run, table[k], 0.0) for k, run in enumerate(problem.runs)]),
        holdout=_pooled(problem, [(run, row, SETTLING) for run, row in judged]) if judged else {},
        at_bound=at_bound | frozenset(f for fields in conditions.values() for f in fields),
        undetermined=undetermined,
        findings=said,
        residuals=_residual_tests(problem, table),
        noise_floor=_noise_floor(problem),
        uncertainty=known,
        evaluations=search.simulations,
        wall_s=clock.perf_counter() - begin,
        method=method,
        interval_method=intervals,
        seed=seed,
        complete=complete,
    )


def _weights(problem: Problem, table: FloatArray) -> FloatArray:
    """1/RMS residual of each channel: the likelihood's choice when the noise is not known."""
    gaps = np.concatenate(problem.gaps(table))
    return 1.0 / np.maximum(np.sqrt(np.mean(gaps**2, axis=0)), 1e-9 / problem.weights)


def _settled(problem: Problem, table: FloatArray, run: FitRun, seed: int) -> FloatArray:
    """Values for a held-out run: the shared ones, and its own from the first `SETTLING` seconds."""
    parameters = problem.parameters.copy()
    for j, name in enumerate(problem.fields):
        parameters[name].vary = name in problem.own
        parameters[name].value = float(table[:, j].mean())
    early = run.time < run.time[0] + SETTLING
    if early.all() or early.sum() < 2:
        raise InputError(
            f"held-out run {run.name} of {np.ptp(run.time):g} s -- expected more than the {SETTLING:g} s that give its "
            "initial state and are not scored -- give a longer one"
        )
    start = FitRun(run.name, run.time[early], run.inputs[early], run.targets[early])
    single = Problem(problem.kernel, [start], problem.channels, parameters, problem.per_run, problem.weights)
    if not single.own:
        return single.start()[0]
    return search_fast(single, Search(), seed, single.start())[0]


def _pooled(problem: Problem, judged: Sequence[tuple[FitRun, FloatArray, float]]) -> dict[str, Agreement]:
    """Errors by channel, pooled over runs, each from so many seconds after its start."""
    measured, errors = [], []
    for run, row, after in judged:
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


def _noise_floor(problem: Problem) -> dict[str, float]:
    floors = [floor for run in problem.runs if (floor := noise_floor(run)) is not None]
    if not floors:
        return {}
    return dict(zip(problem.channels, np.sqrt(np.mean(np.square(floors), axis=0)).tolist(), strict=True))


def _results(
    problem: Problem, table: FloatArray, known: Uncertainty, judged: Sequence[tuple[FitRun, FloatArray]]
) -> dict[str, RunResult]:
    def own(row: FloatArray) -> dict[str, float]:
        return {problem.declared[f].name: float(row[problem.fields.index(f)]) for f in problem.own}

    results = {}
    for k, run in enumerate(problem.runs):
        errors = {problem.declared[f].name: value for f, value in known.per_run[k].items()}
        results[run.name] = RunResult("measured", own(table[k]), errors, _pooled(problem, [(run, table[k], 0.0)]))
    for run, row in judged:
        results[run.name] = RunResult("holdout", own(row), {}, _pooled(problem, [(run, row, SETTLING)]))
    return results


def _filled(problem: Problem, table: FloatArray, known: Uncertainty) -> Parameters:
    """The lmfit parameters with values, standard errors and correlations."""
    result = problem.parameters.copy()
    for j, name in enumerate(problem.fields):
        result[name].value = float(table[:, j].mean())
        stderr = known.stderr.get(name, math.nan)
        if name in problem.own:
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
