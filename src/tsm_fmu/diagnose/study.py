"""A model with effects against runs: refitted, with its residuals; what every step of the diagnosis works on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..chain import chain
from ..identify.problem import FitRun, FloatArray, Problem
from ..identify.search import Search, search_fast
from ..identify.specification import fit_parameters, per_run_fields
from ..identify.uncertainty import autocorrelation_time
from ..kernel import Kernel

ROWS = 24_000
"""Samples of all measured runs together that the search works on; more are thinned evenly."""
SHORTEST = 1_200
"""Samples that a run keeps at least."""


def thinned(runs: Sequence[FitRun], rows: int = ROWS) -> list[FitRun]:
    """Runs with every m-th sample: kernels step exactly, so a longer step loses no accuracy of the model."""
    total = sum(run.time.size for run in runs)
    return [_every(run, max(1, min(total // rows, run.time.size // SHORTEST))) for run in runs]


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
        return np.sqrt(np.mean(np.concatenate(self.residuals) ** 2, axis=0))

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

    def judged_on(self, runs: Sequence[FitRun]) -> list[FloatArray]:
        """Residuals on other runs: the shared values stay, offsets and initial states are fitted."""
        parameters = self.problem.parameters.copy()
        for j, field in enumerate(self.problem.fields):
            parameters[field].vary = field in self.problem.own
            parameters[field].value = float(self.table[:, j].mean())
        found = []
        for run in runs:
            single = replace(self.problem, runs=[run], parameters=parameters)
            row = (search_fast(single, Search(), 0, single.start()) if single.own else single.start())[0]
            found.append(run.targets - single.outputs(0, row))
        return found


def refit(
    model: str,
    effects: Sequence[str],
    runs: Sequence[FitRun],
    channels: Sequence[str],
    *,
    values: Mapping[str, float],
    preset: str | None = None,
    free: Sequence[str] | None = None,
    weights: FloatArray | None = None,
    several_starts: bool = False,
    seed: int = 0,
) -> Fitted:
    """Fit a model with effects from given values.

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
    free : sequence of str, optional
        Public names that may change; default all.
    weights : ndarray, optional
        Factor of each channel's residual; default one over its spread.
    several_starts : bool
        Search from several starts instead of refining the given one.
    seed : int
    """
    kernel = chain(model, tuple(effects))
    known = {v.name for v in kernel.parameters}
    fixed = [] if free is None else [name for name in known if name not in free]
    parameters = fit_parameters(kernel, preset, {n: v for n, v in values.items() if n in known}, fixed)
    problem = Problem(kernel, list(runs), tuple(channels), parameters, per_run_fields(kernel))
    if weights is not None:
        problem = problem.reweighted(weights)
    _hold_what_does_nothing(problem)
    table = search_fast(problem, Search(), seed, None if several_starts else problem.start())
    return Fitted(model, tuple(effects), problem, table)


def as_given(
    model: str, effects: Sequence[str], runs: Sequence[FitRun], channels: Sequence[str], values: Mapping[str, float],
    preset: str | None = None,
) -> Fitted:  # fmt: skip
    """The model with the values given, nothing fitted but what each run has of its own (offset, initial state)."""
    own = [v.name for v in chain(model, tuple(effects)).parameters if v.field in per_run_fields(chain(model, ()))]
    if not own:
        kernel = chain(model, tuple(effects))
        parameters = fit_parameters(kernel, preset, values)
        problem = Problem(kernel, list(runs), tuple(channels), parameters)
        return Fitted(model, tuple(effects), problem, problem.start())
    return refit(model, effects, runs, channels, values=values, preset=preset, free=own)


def _hold_what_does_nothing(problem: Problem) -> None:
    from ..identify.structure import sensitivity_scales

    for field, scale in sensitivity_scales(problem).items():
        if not math.isfinite(scale) and field not in problem.per_run:
            start = problem.parameters[field].value
            quantity = problem.declared[field].quantity
            neutral = start == 0.0 and quantity.lo == 0.0
            problem.parameters[field].vary = neutral  # an effect's size starts from nothing


def motion_channel(kernel: Kernel) -> str:
    """Name of the position or speed input."""
    module = kernel.module
    return getattr(module, "MOTION", "") or ("v" if "v" in module.Inputs._fields else "")
