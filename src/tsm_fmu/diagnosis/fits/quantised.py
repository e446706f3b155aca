"""Few levels: what a coarse converter does is read from the log and not fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...effects import EFFECTS
from ...kernels.arrays import FloatArray
from ...kernels.chain import attach
from ...kernels.kernel import kernel
from ...logs.quantisation import quantisation_step
from ...regression.problem import FitRun, Problem
from ...regression.specification import search_space
from ..criteria import EFFECT_SPREAD_SHARE, LEVEL_GAP_RATIO, LEVEL_STEP_SHARE, VALUES_OF_A_LEVEL
from .refit import Fitted

READ = next(module for module in EFFECTS if module.ABOUT.role == "read")
"""The effect of few levels."""


@dataclass(frozen=True)
class Levels:
    """Levels of a channel.

    Attributes
    ----------
    channel : str
    q, y_0 : float
        Step, and one of the levels, in the channel's unit.
    """

    channel: str
    q: float
    y_0: float

    @property
    def spec(self) -> str:
        return f"{READ.NAME}@{self.channel}"

    @property
    def noise(self) -> float:
        """RMS that the steps make of the channel."""
        return self.q / math.sqrt(12.0)


def coarse(runs: Sequence[FitRun], channels: Sequence[str], spread: FloatArray) -> list[Levels]:
    """Channels whose steps alone make a gap that matters: q/sqrt(12) against the spread.

    Parameters
    ----------
    runs : sequence of FitRun
        All samples.
    channels : sequence of str
    spread : ndarray, shape (channels,)
    """
    least = dict(zip(channels, EFFECT_SPREAD_SHARE * spread, strict=True))
    return [one for one in levels_of(runs, channels) if one.noise > least[one.channel]]


def levels_of(runs: Sequence[FitRun], channels: Sequence[str]) -> list[Levels]:
    """Levels on which the values of channels lie, however fine; none of a channel without.

    Parameters
    ----------
    runs : sequence of FitRun
        All samples.
    channels : sequence of str
    """
    found = (_levels(channel, [run.targets[:, c] for run in runs]) for c, channel in enumerate(channels))
    return [one for one in found if one is not None]


def _levels(channel: str, parts: Sequence[FloatArray]) -> Levels | None:
    """Levels on which the values of all runs lie, as all or one of them show: one may blur them more than others do."""
    y = np.concatenate(parts)
    for shown in (y, *parts) if len(parts) > 1 else (y,):
        q = quantisation_step(without_blur(shown))
        if q == 0.0:
            continue
        turn = np.exp(2j * np.pi * y / q)
        y_0 = float(np.angle(turn.mean()) / (2.0 * np.pi) * q)
        off = np.abs((y - y_0) / q - np.round((y - y_0) / q))
        if np.quantile(off, 0.99) < LEVEL_STEP_SHARE:
            return Levels(channel, float(q), y_0)
    return None


def without_blur(y: FloatArray) -> FloatArray:
    """Values with the small noise that was added behind a converter taken off: those of a level are its median.

    As they are where they do not gather round levels, many at each: the gaps between two levels then stand apart from
    those between two values of one.

    Parameters
    ----------
    y : ndarray, shape (n,)
    """
    order = np.argsort(y, kind="stable")
    gaps = np.diff(y[order])
    ranked = np.sort(gaps[gaps > 0.0])[::-1]  # equal values, of a stand-still in a log of few digits, are no two
    most = min(y.size // VALUES_OF_A_LEVEL, ranked.size - 1)
    if most < 2:
        return y
    falls = ranked[1:most] / ranked[2 : most + 1]
    between = int(np.argmax(falls)) + 2  # gaps: three levels or more, as of two any values make a pair
    if falls[between - 2] < LEVEL_GAP_RATIO:
        return y
    found = np.empty_like(y)
    for level in np.split(order, np.flatnonzero(gaps >= ranked[between - 1]) + 1):
        found[level] = np.median(y[level])
    return found


def step_noise(levels: Sequence[Levels], channels: Sequence[str]) -> FloatArray:
    """RMS that the steps make of each channel, zero without: an effect below that is not seen."""
    noise = {one.channel: one.noise for one in levels}
    return np.array([noise.get(channel, 0.0) for channel in channels])


def with_levels(fitted: Fitted, levels: Sequence[Levels]) -> Fitted:
    """A fit whose channels have these levels; nothing else changes."""
    base = kernel(fitted.model)
    named: dict[str, float] = {}
    for one in levels:
        prefix = attach(base, one.spec).prefix.replace("__", ".")
        named |= {f"{prefix}q": one.q, f"{prefix}y_0": one.y_0}
    return with_read(fitted, [one.spec for one in levels], named)


def with_read(fitted: Fitted, specs: Sequence[str], named: Mapping[str, float]) -> Fitted:
    """A fit with more effects, of which nothing is fitted; nothing else changes.

    Parameters
    ----------
    fitted : Fitted
    specs : sequence of str
    named : mapping of str to float
        Their values by public name; those that are not here change nothing.
    """
    old, effects = fitted.problem, (*fitted.effects, *specs)
    made = fitted.task.kernel(effects)
    values = {**fitted.values, **named}
    space = search_space(made, fitted.task.preset, values, per_run=old.per_run).freeing_only(old.space.free)
    for name in old.fields:
        space = space.with_bounds(name, old.space[name].lo, old.space[name].hi)
    problem = Problem(made, old.runs, old.channels, space, old.weights, old.pooling)
    table = problem.start()
    for j, name in enumerate(old.fields):
        table[:, problem.fields.index(name)] = fitted.table[:, j]
    return Fitted(fitted.task, effects, problem, table, fitted.released)
