"""Identification as an experiment: a published set is played by its FMU, lost, and identified again.

The force (or the angle) of the FMU gets the noise that the paper's own error leaves room for; from it the set is
identified by the papers' way (genetic search, then simplex) and by least squares from several starts. Start values are
20 % off. How well the data determine each value is told twice: by the curvature of the error (condition number of the
Hessian) and by its profile (95 % intervals, all other values fitted anew at each point).

A value counts as recovered if its interval holds the published one and is narrower than the value itself on either
side: its sign is then known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..cosim.trajectory import Trajectory
from ..identification.fit import Fit, fit
from ..kernels.arrays import FloatArray
from ..kernels.kernel import kernel
from ..regression.problem import FitRun
from ..regression.specification import search_space
from ..report import Table
from .claims import Claim, Items, Method, Open, statement_claim
from .loops import side_by_side
from .preparation import filtered, prepared
from .verdict import Condition, Kind, Verdict, number

OFF = 0.2
"""Start values are off by this share of the published ones, up and down in turn."""
GENETIC, LEAST_SQUARES, PREPARED = "genetic search, simplex", "least squares", "least squares, prepared signals"
THINNED = "rows of the genetic search"
ROWS = 1000
"""So many of each motion at most: that search simulates tens of thousands of times. The simplex then gets all."""


class Motion(NamedTuple):
    """One motion: the trajectory, its columns by input of the model with a factor, and the part that is used [s]."""

    run: Trajectory
    inputs: Mapping[str, tuple[str, float]]
    output: str
    window: tuple[float, float]


@dataclass(frozen=True)
class Trial:
    """What is played and lost.

    Attributes
    ----------
    model, preset, channel : str
        Model, its published set, and the output that is measured.
    motions : sequence of Motion
        All are fitted at once.
    names : tuple of str
        Identified parameters; the others stay at the published set.
    noise : float
        Standard deviation of the noise, in the unit of the channel.
    rows_s : float
        Distance of the rows [s].
    encoder : float
        Count of the encoder from which speed and acceleration are differentiated, in the unit of the position; 0 leaves
        that out.
    cutoff : float
        Of the filter then [Hz].
    genetic_s : float
        Length of the part of each motion that the genetic search gets [s], where a step of the model is dear.
    """

    model: str
    preset: str
    channel: str
    motions: Sequence[Motion]
    names: tuple[str, ...]
    noise: float
    rows_s: float
    encoder: float = 0.0
    cutoff: float = 10.0
    genetic_s: float = math.inf

    @property
    def truth(self) -> dict[str, float]:
        """Published values by name."""
        p = kernel(self.model).params(self.preset)._asdict()
        return {v.name: float(p[v.field]) for v in kernel(self.model).parameters if v.name in self.names}


@dataclass(frozen=True)
class Recovery:
    """What came back.

    Attributes
    ----------
    trial : Trial
    values : mapping
        Identified values by method and name.
    rms : mapping of str to float
        What each method leaves of the noisy signal.
    noise : mapping of str to float
        RMS of the noise as it was drawn on the rows of each method: what the published set leaves there.
    intervals : mapping
        95 % profile intervals by name; without one the error does not rise.
    condition : float
        Of the normalised sensitivities, the root of that of the Hessian.
    """

    trial: Trial
    values: Mapping[str, Mapping[str, float]]
    rms: Mapping[str, float]
    noise: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    condition: float

    @property
    def lost(self) -> tuple[str, ...]:
        """Names that are not recovered."""
        return tuple(n for n in self.trial.names if not self._known(n))

    def _known(self, name: str) -> bool:
        lo, hi = self.intervals.get(name, (-math.inf, math.inf))
        value = self.values[LEAST_SQUARES][name]
        return lo <= self.trial.truth[name] <= hi and max(abs(hi - value), abs(value - lo)) < abs(value)


def recovered(trials: Mapping[str, Trial], quick: bool) -> dict[str, Recovery]:
    """Every trial by every method; ``quick``: least squares alone, from one start, with linear intervals."""
    jobs = {(name, method): trial for name, trial in trials.items() for method in _methods(trial, quick)}
    fits = side_by_side(_identified, [(trial, method, quick) for (_, method), trial in jobs.items()])
    done = dict(zip(jobs, fits, strict=True))
    return {name: _told(trial, {m: f for (n, m), f in done.items() if n == name}) for name, trial in trials.items()}


def _methods(trial: Trial, quick: bool) -> tuple[str, ...]:
    return (LEAST_SQUARES,) if quick else (LEAST_SQUARES, GENETIC, *((PREPARED,) if trial.encoder else ()))


class _Found(NamedTuple):
    """A fit without what does not cross processes."""

    values: dict[str, float]
    rms: float
    noise: float
    intervals: dict[str, tuple[float, float]]
    condition: float


def _identified(trial: Trial, method: str, quick: bool) -> _Found:
    k = kernel(trial.model)
    start = {n: v * (1.0 + OFF * (-1.0) ** i) for i, (n, v) in enumerate(trial.truth.items())}
    fixed = [v.name for v in k.parameters if v.name not in trial.names]
    field = {v.name: v.field for v in k.parameters}

    def fitted(begin: Mapping[str, float], rows: str, **how: Any) -> tuple[Fit, float]:
        rng = np.random.default_rng(2013)
        runs, noises = zip(
            *(_rows(trial, motion, str(i), rows, rng) for i, motion in enumerate(trial.motions)), strict=True
        )
        space = search_space(k, trial.preset, begin, fixed)
        noise = float(np.sqrt(np.mean(np.concatenate(noises) ** 2)))
        return fit(k, runs, [trial.channel], space, seed=1, **how), noise

    if method == GENETIC:
        searched, _ = fitted(start, THINNED, method="paper")
        begin = {n: float(searched.parameters[field[n]].value) for n in trial.names}
        found, noise = fitted(begin, GENETIC, method="paper", single_start=True)  # the simplex, on all rows
    else:
        profile = method == LEAST_SQUARES and not quick
        found, noise = fitted(start, method, single_start=quick, intervals="profile" if profile else "linear")
    return _Found(
        {n: float(found.parameters[field[n]].value) for n in trial.names},
        found.measured[trial.channel].rmse,
        noise,
        {n: found.intervals[field[n]] for n in trial.names if field[n] in found.intervals},
        found.uncertainty.condition_number,
    )


def _rows(trial: Trial, motion: Motion, name: str, method: str, rng: np.random.Generator) -> tuple[FitRun, FloatArray]:
    """Rows of a motion, and what was added to the signal there."""
    time = motion.run.time
    signal = motion.run.columns[motion.output]
    noisy = signal + rng.normal(0.0, trial.noise, signal.size)
    columns = {n: factor * motion.run.columns[c] for n, (c, factor) in motion.inputs.items()}
    if method == PREPARED:
        counts = trial.encoder * np.round(columns["x"] / trial.encoder)
        columns |= dict(zip(("x", "v", "a"), prepared(time, counts, trial.cutoff), strict=True))
        noisy = filtered(noisy, float(time[1] - time[0]), trial.cutoff)
    begin, end = motion.window
    if method == THINNED:
        end = min(end, begin + trial.genetic_s)
    used = np.flatnonzero((time >= begin - 1e-9) & (time <= end + 1e-9))
    every = max(1, round(trial.rows_s / (time[1] - time[0])))
    if method == THINNED:
        every *= math.ceil(used.size / every / ROWS)
    kept = used[::every]
    inputs: FloatArray = np.column_stack(
        [columns[v.name][kept] if v.name in columns else np.zeros(kept.size) for v in kernel(trial.model).inputs]
    )
    return FitRun(name, time[kept] - time[kept[0]], inputs, noisy[kept][:, None]), (noisy - signal)[kept]


def _told(trial: Trial, found: Mapping[str, _Found]) -> Recovery:
    ours = found[LEAST_SQUARES]
    return Recovery(
        trial,
        {m: f.values for m, f in found.items()},
        {m: f.rms for m, f in found.items()},
        {m: f.noise for m, f in found.items()},
        ours.intervals,
        ours.condition,
    )


def recovery_claim(
    key: str,
    items: Items,
    states: str,
    found: Recovery,
    *,
    kind: Kind,
    assumed: tuple[Open, ...],
    text: str = "",
) -> Claim:
    """Row on a published set: how many of its values such data give back; ``text`` ends the reason."""
    count = len(found.trial.names)
    rms = ", ".join(f"{number(r)} ({m}; drawn {number(found.noise[m])})" for m, r in found.rms.items())
    lost = f"not {', '.join(found.lost)}" if found.lost else "all of them"
    summary = (
        f"{lost}; the methods leave {rms} of a noise of {number(found.trial.noise)}, the condition number is "
        f"{number(found.condition)} (table)"
    )
    why = dict.fromkeys(Verdict, f"{summary}; {text}" if text else summary)
    return statement_claim(
        key,
        items,
        f"values of {count} that come back: their 95 % interval holds the published one and tells its sign",
        "1",
        states,
        {"recovered": Condition(float(count - len(found.lost)), ">=", float(count))},
        kind=kind,
        assumed=assumed,
        why=why,
        method=Method.CO_SIMULATION,
    )


def recovery_table(found: Recovery) -> Table:
    """Each value: published, identified by each method, and its interval."""
    rows = []
    for name, true in found.trial.truth.items():
        interval = found.intervals.get(name)
        interval_text = f"{number(interval[0])} to {number(interval[1])}" if interval else "none"
        rows.append(
            [
                name,
                number(true),
                *(number(values[name]) for values in found.values.values()),
                interval_text,
                "no" if name in found.lost else "yes",
            ]
        )
    unit = next(v.quantity.unit for v in kernel(found.trial.model).outputs if v.name == found.trial.channel)
    left = ", ".join(f"{m} {number(r)} of {number(found.noise[m])} drawn on its rows" for m, r in found.rms.items())
    return Table(
        ["parameter (SI)", "published", *found.values, "95 % interval", "recovered"],
        rows,
        f"The published set of {found.trial.model} as its FMU plays it with noise of {number(found.trial.noise)} "
        f"{unit}, identified anew. Left, rms: {left} {unit}.",
    )
