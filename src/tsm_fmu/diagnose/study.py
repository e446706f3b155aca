"""A model with effects against runs: refitted, with its residuals; what every step of the diagnosis works on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from ..chain import chain
from ..identify.coordinates import Coordinates
from ..identify.fit import SETTLING
from ..identify.problem import FitRun, FloatArray, Problem
from ..identify.search import Search, search_fast
from ..identify.specification import fit_parameters, per_run_fields
from ..identify.structure import sensitivity_scales
from ..identify.uncertainty import autocorrelation_time
from ..kernel import Kernel
from ..models.contract import InputError

ROWS = 6_000
"""Samples of all measured runs together that the search works on; more are thinned evenly."""
SHORTEST = 800
"""Samples that a run keeps at least."""
STEPS = 25
"""Steps of one refit at most."""


def thinned(runs: Sequence[FitRun], rows: int = ROWS, shortest: int = SHORTEST) -> list[FitRun]:
    """Runs with every m-th sample: kernels step exactly, so a longer step loses no accuracy of the model."""
    total = sum(run.time.size for run in runs)
    return [_every(run, max(1, min(total // rows, run.time.size // shortest))) for run in runs]


def _every(run: FitRun, m: int) -> FitRun:
    return FitRun(run.name, *(np.ascontiguousarray(a[::m]) for a in (run.time, run.inputs, run.targets)))


@dataclass(frozen=True)
class Fitted:
    """A model with effects after a refit.

    Attributes
    ----------
    model : str
        Base model.
    effects : tuple of str
        Attached effects in order, as ``id`` or ``id@channel``.
    problem : Problem
        Runs, channels, weights, bounds.
    table : ndarray, shape (runs, parameters)
        Values found.
    """

    model: str
    effects: tuple[str, ...]
    problem: Problem
    table: FloatArray

    @cached_property
    def residuals(self) -> list[FloatArray]:
        """Measured minus simulated, one array (n, channels) a run."""
        return [run.targets - self.problem.outputs(k, self.table[k]) for k, run in enumerate(self.problem.runs)]

    @cached_property
    def rmse(self) -> FloatArray:
        """Pooled over samples, by channel."""
        return rms(self.residuals)

    @cached_property
    def spread(self) -> FloatArray:
        """Standard deviation of each measured channel, within runs."""
        return np.sqrt(np.mean([r.targets.var(axis=0) for r in self.problem.runs], axis=0))

    @cached_property
    def effective(self) -> FloatArray:
        """Independent samples that the residual of each channel is worth."""
        times = [[r.shape[0] / autocorrelation_time(r[:, c]) for c in range(r.shape[1])] for r in self.residuals]
        return np.maximum(np.sum(times, axis=0), 4.0)

    @property
    def values(self) -> dict[str, float]:
        """Parameters by public name, the mean over the runs where each has its own."""
        names = [self.problem.declared[f].name for f in self.problem.fields]
        return dict(zip(names, self.table.mean(axis=0).tolist(), strict=True))

    @property
    def free(self) -> list[str]:
        """Public names of the parameters that the refit could change."""
        return [self.problem.declared[f].name for f in (*self.problem.shared, *self.problem.own)]

    def settled(self, run: FitRun) -> FloatArray:
        """Values for a run that was not fitted: the shared ones, and its own from its first seconds.

        Raises
        ------
        InputError
            A run too short to leave anything to score.
        """
        early = run.time < run.time[0] + SETTLING
        if early.all() or early.sum() < 2:
            raise InputError(
                f"held-out run {run.name} of {np.ptp(run.time):g} s -- expected more than the {SETTLING:g} s that give "
                "its initial state and are not scored -- give a longer one"
            )
        parameters = self.problem.parameters.copy()
        for j, field in enumerate(self.problem.fields):
            parameters[field].vary = field in self.problem.own
            parameters[field].value = float(self.table[:, j].mean())
        start = FitRun(run.name, run.time[early], run.inputs[early], run.targets[early])
        single = replace(self.problem, runs=[start], parameters=parameters)
        return descended(single, single.start())[0]

    def judged_on(self, runs: Sequence[FitRun]) -> list[FloatArray]:
        """Residuals on runs that were not fitted, from `SETTLING` on."""
        found = []
        for run in runs:
            simulated = replace(self.problem, runs=[run]).outputs(0, self.settled(run))
            found.append((run.targets - simulated)[run.time >= run.time[0] + SETTLING])
        return found

    def at(self, runs: Sequence[FitRun]) -> Fitted:
        """The same values on the same runs at another sampling."""
        return Fitted(self.model, self.effects, replace(self.problem, runs=list(runs)), self.table)


def rms(residuals: Sequence[FloatArray]) -> FloatArray:
    """Root mean square over the samples of all runs, by channel."""
    return np.sqrt(np.mean(np.concatenate(list(residuals)) ** 2, axis=0))


def refit(
    model: str,
    effects: Sequence[str],
    runs: Sequence[FitRun],
    channels: Sequence[str],
    *,
    values: Mapping[str, float],
    preset: str | None = None,
    fixed: Sequence[str] = (),
    weights: FloatArray | None = None,
    starts: FloatArray | None = None,
    several_starts: bool = False,
    seed: int = 0,
) -> Fitted:
    """Fit a model with effects from given values; the result is never worse than the start.

    Parameters
    ----------
    model : str
    effects : sequence of str
    runs : sequence of FitRun
    channels : sequence of str
    values : mapping of str to float
        Start values by public name; those that the chain does not have are left out.
    preset : str, optional
        Parameter set for the values not given.
    fixed : sequence of str
        Public names that keep their value.
    weights : ndarray, optional
        Factor of each channel's residual; default one over its spread.
    starts : ndarray, shape (runs, per-run parameters), optional
        Start values of what each run has of its own.
    several_starts : bool
        Search from several starts as well, and take the better.
    seed : int
    """
    kernel = chain(model, tuple(effects))
    known = {v.name for v in kernel.parameters}
    held = [name for name in fixed if name in known]
    parameters = fit_parameters(kernel, preset, {n: v for n, v in values.items() if n in known}, held)
    problem = Problem(kernel, list(runs), tuple(channels), parameters, per_run_fields(kernel))
    if weights is not None:
        problem = problem.reweighted(weights)
    _hold_what_does_nothing(problem)
    problem = replace(problem)  # without the lists of free parameters from before
    start = problem.start()
    if starts is not None:
        start[:, [problem.fields.index(f) for f in problem.own]] = starts
    table = descended(problem, start)
    if several_starts:
        other = descended(problem, search_fast(problem, Search(), seed))
        table = min(table, other, key=lambda t: cost(problem, t))
    return Fitted(model, tuple(effects), problem, table)


def as_given(
    model: str, effects: Sequence[str], runs: Sequence[FitRun], channels: Sequence[str], values: Mapping[str, float],
    preset: str | None = None,
) -> Fitted:  # fmt: skip
    """The model with the values given, nothing fitted but what each run has of its own (offset, initial state)."""
    kernel = chain(model, tuple(effects))
    own = per_run_fields(kernel)
    parameters = fit_parameters(kernel, preset, values)
    for field in kernel.module.Params._fields:
        parameters[field].vary = field in own
    problem = Problem(kernel, list(runs), tuple(channels), parameters, own)
    start = problem.start()
    for k, row in enumerate(start):
        if not np.isfinite(problem.outputs(k, row)).all():
            raise InputError(
                f"{model} gives no finite output on run {runs[k].name} at the given values -- expected values from "
                "which it can run -- choose others with --set"
            )
    return Fitted(model, tuple(effects), problem, descended(problem, start) if own else start)


def cost(problem: Problem, table: FloatArray) -> float:
    """Weighted sum of squares; infinite where the model stops."""
    total = sum(float(np.sum(problem.residual(k, table[k]) ** 2)) for k in range(len(problem.runs)))
    return total if np.isfinite(total) else np.inf


def descended(problem: Problem, start: FloatArray, steps: int = STEPS) -> FloatArray:
    """Bounded least squares from a start, all free parameters searched; never worse than the start."""
    if not problem.shared and not problem.own:
        return start
    scales = _scales(problem, start)
    coordinates = Coordinates(problem, problem.shared, problem.own, scales, start)

    def residual(q: FloatArray) -> FloatArray:
        table = coordinates.table(q)
        values = np.concatenate(problem.residuals(list(enumerate(table))))
        return np.nan_to_num(values, nan=1e6, posinf=1e6, neginf=-1e6)

    def jacobian(q: FloatArray) -> FloatArray:
        base = residual(q)
        columns = np.zeros((base.size, q.size))
        for axes in _together(coordinates):
            moved, steps = q.copy(), np.zeros(q.size)
            for i in axes:
                steps[i] = 1e-5 if q[i] + 1e-5 <= coordinates.hi[i] else -1e-5
                moved[i] += steps[i]
            change = residual(moved) - base
            for i in axes:
                rows = slice(None) if coordinates.axes[i].run is None else _rows(problem, coordinates.axes[i].run)
                columns[rows, i] = change[rows] / steps[i]
        return columns

    try:
        found = least_squares(
            residual, coordinates.of(start), jac=jacobian, bounds=(coordinates.lo, coordinates.hi),  # pyright: ignore
            x_scale="jac", ftol=1e-6, xtol=1e-7, gtol=1e-8, max_nfev=steps,
        )  # fmt: skip
    except (ValueError, np.linalg.LinAlgError):
        return start
    table = coordinates.table(found.x)
    return table if cost(problem, table) <= cost(problem, start) else start


def _scales(problem: Problem, start: FloatArray) -> dict[str, float]:
    """Sensitivity scales; not beyond ten times the value of a positive parameter, where a slope means nothing."""
    scales = sensitivity_scales(problem.starting_at(start))
    for field, scale in scales.items():
        declared = problem.declared[field]
        size = 10.0 * max(abs(float(start[0, problem.fields.index(field)])), abs(declared.start))
        if declared.quantity.lo == 0.0 and size > 0.0:
            scales[field] = min(scale, size)
    return scales


def _together(coordinates: Coordinates) -> list[list[int]]:
    """Axes that can be moved at once: the same field of different runs."""
    groups: dict[tuple[str, bool], list[int]] = {}
    for i, axis in enumerate(coordinates.axes):
        groups.setdefault((axis.field, axis.run is None), []).append(i)
    return list(groups.values())


def _rows(problem: Problem, run: int | None) -> slice:
    sizes = [-(-r.targets.shape[0] // problem.block) * r.targets.shape[1] for r in problem.runs]
    edge = int(np.sum(sizes[: run or 0]))
    return slice(edge, edge + sizes[run or 0])


def _hold_what_does_nothing(problem: Problem) -> None:
    for field, scale in sensitivity_scales(problem).items():
        if not np.isfinite(scale) and field not in problem.per_run:
            problem.parameters[field].vary = False
    if not any(p.vary for p in problem.parameters.values()):
        raise InputError(
            f"no free parameter of {problem.kernel.name} acts on {', '.join(problem.channels)} in these runs -- "
            "expected at least one -- give runs that move"
        )


def motion_channel(kernel: Kernel) -> str:
    """Name of the position or speed input."""
    module = kernel.module
    return getattr(module, "MOTION", "") or ("v" if "v" in module.Inputs._fields else "")
