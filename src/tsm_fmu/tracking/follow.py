"""The same model fitted to one run after the other: a few parameters are free, all others stay at the card's value."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..identification.fit import Fit, fit
from ..kernels.kernel import Kernel
from ..models.contract import InputError
from ..regression.descent import Descent
from ..regression.intervals import QUANTILE
from ..regression.problem import FitRun, Problem
from ..regression.search_space import SearchSpace

KNOWN = 0.1
"""Standard error over value that a parameter has in a single run at most, to be followed without being asked for."""
PROBED = 3
"""Runs on which that is found out: the first, the last and one in the middle."""


@dataclass(frozen=True)
class TrackedValue:
    """One parameter in one run.

    Attributes
    ----------
    value, stderr : float
        SI; the standard error takes the autocorrelation of the residual into account, see regression/uncertainty.py.
    low, high : float
        95 % interval.
    used : bool
        False where a bound held it or the run does not determine it: it takes no part in trend and jump.
    """

    value: float
    stderr: float
    low: float
    high: float
    used: bool


@dataclass(frozen=True)
class TrackedRun:
    """One run: values by public name, and its RMS errors by channel [SI] before and after the refit.

    `rmse_card` is with the card's values and the run's own offset and start; `rmse` with the tracked parameters free.
    """

    name: str
    values: Mapping[str, TrackedValue]
    rmse_card: Mapping[str, float]
    rmse: Mapping[str, float]


def followed_fields(
    kernel: Kernel, runs: Sequence[FitRun], channels: Sequence[str], space: SearchSpace, candidates: Sequence[str]
) -> tuple[str, ...]:
    """Fields among ``candidates`` that single runs determine when they are fitted together.

    From all of them the one known worst is dropped until each has a standard error of at most `KNOWN` of its value, in
    the median over the first, the last and a middle run.

    Raises
    ------
    InputError
        If none is left.
    """
    places = sorted({round(x) for x in np.linspace(0, len(runs) - 1, PROBED)})
    remaining = list(candidates)
    while remaining:
        found = [_fitted(kernel, runs[k], channels, space, remaining) for k in places]
        unsure = {field: float(np.median([_relative(one, field) for one in found])) for field in remaining}
        worst = max(remaining, key=lambda field: unsure[field])
        if unsure[worst] <= KNOWN:
            return tuple(remaining)
        remaining.remove(worst)
    names = ", ".join(v.name for v in kernel.parameters if v.field in candidates) or "(none)"
    raise InputError(
        f"{kernel.name}: single runs determine none of the parameters that the card says are known ({names}) -- "
        f"expected one with a standard error below {KNOWN:.0%} of its value -- choose with --free, or give longer runs"
    )


def followed(
    kernel: Kernel,
    runs: Sequence[FitRun],
    channels: Sequence[str],
    space: SearchSpace,
    fields: Collection[str],
    reported: Collection[str],
    progress: Callable[[str], None] | None = None,
) -> Iterator[TrackedRun]:
    """Fit each run on its own, one after the other.

    Parameters
    ----------
    kernel : Kernel
    runs : sequence of FitRun
    channels : sequence of str
    space : SearchSpace
        The card's values, with what each run has of its own.
    fields : collection of str
        Shared fields that are free in each run.
    reported : collection of str
        Fields whose values are returned: these, and offsets of the runs.
    progress : callable, optional
        Told the run that is being fitted.
    """
    for number, run in enumerate(runs, 1):
        if progress:
            progress(f"run {number} of {len(runs)}, {run.name}")
        one = _fitted(kernel, run, channels, space, fields)
        values = {v.name: _value(one, v.field) for v in kernel.parameters if v.field in reported}
        rmse = {channel: score.rmse for channel, score in one.measured.items()}
        yield TrackedRun(run.name, values, _errors_of_card(kernel, run, channels, space), rmse)


def _fitted(kernel: Kernel, run: FitRun, channels: Sequence[str], space: SearchSpace, fields: Collection[str]) -> Fit:
    free = space.freeing_only([*fields, *(f for f, p in space.parameters.items() if p.per_run and p.free)])
    return fit(kernel, [run], channels, free, single_start=True)


def _errors_of_card(kernel: Kernel, run: FitRun, channels: Sequence[str], space: SearchSpace) -> dict[str, float]:
    problem = Problem(kernel, [run], tuple(channels), space)
    table = problem.start()
    if problem.per_run:
        table = Descent().refined(problem.over(space.freeing_only(problem.per_run)), table)
    (gap,) = problem.gaps(table)
    return dict(zip(channels, np.sqrt(np.mean(gap**2, axis=0)).tolist(), strict=True))


def _value(one: Fit, field: str) -> TrackedValue:
    p = one.parameters[field]
    stderr = math.nan if p.stderr is None else float(p.stderr)
    used = math.isfinite(stderr) and field not in one.at_bound and field not in one.undetermined
    half = QUANTILE * stderr
    return TrackedValue(float(p.value), stderr, float(p.value) - half, float(p.value) + half, used)


def _relative(one: Fit, field: str) -> float:
    """Standard error over value; infinite where the run does not determine it."""
    found = _value(one, field)
    return found.stderr / abs(found.value) if found.used and found.value else math.inf
