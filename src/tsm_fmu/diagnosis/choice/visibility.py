"""What a log can show: an effect that would be plain in ordinary use, as these runs would show it.

Its amount is set so that it makes `ORDINARY_SPREAD_SHARE` of a channel's spread in ordinary use: strokes over the range
of the log at up to `ORDINARY_HZ`, holds between, a load that swings, a turn and a half of a drum. What the same amount
would do in the runs, beyond what the baseline's parameters imitate, is seen or is not. An effect that the baseline has
already shows in neither; it is not called unexcited.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.signal import chirp

from ...kernels.arrays import FloatArray
from ...kernels.attached import Attached
from ...kernels.kernel import kernel
from ...models.contract import InputError
from ...regression.problem import FitRun
from ...regression.residuals import rms
from ...regression.thinning import thinned
from ...regression.threads import together
from ..criteria import (
    CONTAINED_SHARE,
    EFFECT_SPREAD_SHARE,
    ONE_SIDED_SHARE,
    ORDINARY_HZ,
    ORDINARY_SPREAD_SHARE,
    ORDINARY_TURNS,
    VISIBLE_DEVIANCE,
)
from ..fits.disguise import load_stands
from ..fits.extent import SHAPES
from ..fits.placing import least_stroke
from ..fits.refit import Fitted
from ..fits.response import Responses
from .hypotheses import Hypothesis

STEP, LENGTH = 0.01, 16.0
ROWS = 3000


class Unseen(NamedTuple):
    """Candidates that do not show, by id and in their order.

    Attributes
    ----------
    hidden : tuple of str
        Those that the runs of a fit could not show at any place.
    unmoved : tuple of str
        Of these, those that their motion would not show if nothing were left.
    contained : tuple of str
        Those that no runs could: the model's own parameters do what they do.
    """

    hidden: tuple[str, ...]
    unmoved: tuple[str, ...]
    contained: tuple[str, ...]


def unexcited(base: Fitted, candidates: Sequence[Attached], best: Hypothesis) -> Unseen:
    """Which of the candidates the runs of a fit could not show.

    Parameters
    ----------
    base : Fitted
        Baseline without nuisance effects.
    candidates : sequence of Attached
    best : Hypothesis
        What it leaves is the noise in which a response must show.
    """
    shown, moved = ({c.module.NAME: False for c in candidates} for _ in range(2))
    contained = dict.fromkeys(shown, True)
    short = base.at(thinned(base.problem.kernel, base.problem.runs, ROWS, ROWS // 10))
    noise = best.fitted.rmse / base.spread
    detect = np.maximum(EFFECT_SPREAD_SHARE, np.sqrt(VISIBLE_DEVIANCE / best.effective) * noise)
    usual = turning = _Compared(short, base.spread, _usable(short, 0.0))
    if any(c.module.ABOUT.turns for c in candidates):
        turning = _Compared(short, base.spread, _usable(short, 2.0 * np.pi * ORDINARY_TURNS))

    def visible(one: Attached) -> tuple[bool, bool, bool]:
        compared = turning if one.module.ABOUT.turns else usual
        size, already = compared.visible(one)
        can_show = compared.travel >= least_stroke(one.module) and not load_stands(base, one)
        shows, moves = (can_show and bool((size >= least).any()) for least in (detect, EFFECT_SPREAD_SHARE))
        return shows, moves, already

    for one, (shows, moves, already) in zip(candidates, together(visible, candidates), strict=True):
        shown[one.module.NAME] |= shows
        moved[one.module.NAME] |= moves
        contained[one.module.NAME] &= already
    hidden = [n for n in shown if not shown[n] and not contained[n]]
    unmoved = tuple(n for n in hidden if not moved[n])
    return Unseen(tuple(hidden), unmoved, tuple(n for n in shown if not shown[n] and contained[n]))


class _Compared:
    """The runs of a fit beside ordinary use of the same model."""

    def __init__(self, fitted: Fitted, spread: FloatArray, use: Fitted) -> None:
        self.in_runs = Responses(fitted, 1.0 / spread)
        self.in_ordinary_use = Responses(use, 1.0 / np.maximum(use.spread, 1e-12), self.in_runs.signals)
        self.travel = max(float(np.ptp(c.x)) for c in self.in_runs.signals)
        self.channels = len(spread)

    def visible(self, one: Attached) -> tuple[FloatArray, bool]:
        """RMS by channel, over the spread, that the runs would show of the effect; whether the baseline has it."""
        found, beyond = [], []
        ordinarily, in_these = self.in_ordinary_use.acting(one), self.in_runs.acting(one)
        shapes = self.in_ordinary_use.extent.shapes(one.module)[:SHAPES]  # a median needs no more
        ordinary_use, steps = ordinarily.columns(shapes)
        in_runs, _ = in_these.columns(shapes, steps)
        left = self.in_runs.outside(in_runs), self.in_ordinary_use.outside(ordinary_use)
        for at in np.ndindex(ordinary_use.shape[:2]):
            whole = self._rms(ordinary_use[at]).max()
            if whole > 0.0:
                found.append(ORDINARY_SPREAD_SHARE * self._rms(left[0][at]) / whole)
                beyond.append(self._rms(left[1][at]).max() / whole)
        if not found:
            return np.zeros(self.channels), False
        return np.median(found, axis=0), float(np.median(beyond)) < CONTAINED_SHARE

    def _rms(self, column: FloatArray) -> FloatArray:
        return np.sqrt(np.mean(column.reshape(-1, self.channels) ** 2, axis=0))


def _usable(fitted: Fitted, travel: float) -> Fitted:
    """`ordinary`, or the runs themselves where the values of the fit do not carry the model so far."""
    try:
        return ordinary(fitted, travel)
    except InputError:
        return fitted


def ordinary(fitted: Fitted, travel: float) -> Fitted:
    """The fitted model in ordinary use; its targets are its outputs, moved by a little for a residual.

    Parameters
    ----------
    fitted : Fitted
    travel : float
        Half stroke at least.
    """
    problem = fitted.problem
    t = np.arange(0.0, LENGTH, STEP)
    row = fitted.table.mean(axis=0)
    runs = []
    for number, shape in enumerate((_sweep(t), _strokes(t))):
        inputs = _inputs(fitted, t, shape, travel)
        outputs = problem.kernel.simulate(problem.params(row), t, inputs)[:, problem.columns]
        runs.append(FitRun(f"use {number + 1}", t, inputs, outputs + 0.01 * rms([outputs])))
    table = np.tile(row, (len(runs), 1))
    return Fitted(fitted.task, fitted.effects, replace(problem, runs=runs), table, fitted.released)


def _sweep(t: FloatArray) -> FloatArray:
    swell = 0.7 + 0.3 * np.sin(2.0 * np.pi * 0.09 * t)
    return np.minimum(t / 0.5, 1.0) * swell * chirp(t, 0.12 * ORDINARY_HZ, t[-1], ORDINARY_HZ, phi=-90)


def _strokes(t: FloatArray) -> FloatArray:
    """Smooth moves to and fro with holds of different length."""
    x, now, at, k = np.zeros(t.size), 0.0, 0.3, 0
    while at < t[-1]:
        goal = (0.9, 0.7, 1.0, 0.6)[k % 4] * (1.0 if k % 2 == 0 else -1.0)
        length, hold = (0.5, 0.9, 1.4)[k % 3] / ORDINARY_HZ, (0.1, 1.0, 0.3, 3.0)[k % 4]
        q = np.clip((t - at) / length, 0.0, 1.0)
        x = np.where(t >= at, now + (goal - now) * q**3 * (10.0 - 15.0 * q + 6.0 * q**2), x)
        now, at, k = goal, at + length + hold, k + 1
    return x


def _inputs(fitted: Fitted, t: FloatArray, shape: FloatArray, travel: float) -> FloatArray:
    """Every input at its mean, the motion, the load and the sheath's angle as in ordinary use."""
    problem = fitted.problem
    model = kernel(problem.kernel.name)
    names = [v.name for v in problem.kernel.inputs]
    every = np.concatenate([r.inputs for r in problem.runs])
    inputs = np.tile(every.mean(axis=0), (t.size, 1))
    motion, load = model.motion, model.roles.load
    if motion == "v":
        reach = max(
            _reach([np.cumsum(r.inputs[:, names.index("v")] * np.gradient(r.time)) for r in problem.runs]), travel
        )
        v = np.gradient(reach * shape, t)
        inputs[:, names.index("v")] = v
    elif motion:
        column = names.index(motion)
        position = (
            float(every[:, column].mean()) + max(_reach([r.inputs[:, column] for r in problem.runs]), travel) * shape
        )
        inputs[:, column] = position
        v = np.gradient(position, t)
    else:
        return inputs
    for name, values in (("v", v), ("a", np.gradient(v, t))):
        if name in names and name != motion:
            inputs[:, names.index(name)] = values
    if "a" in names:
        inputs[:, names.index("a")] = np.gradient(v, t)
    loads = [load] if load in names else []
    for drive in fitted.task.drives:
        if drive.role == "bend":
            inputs[:, names.index(drive.column)] *= 1.0 + 0.5 * np.sin(2.0 * np.pi * 0.071 * t)
        elif drive.role == "position":
            middle = float(every[:, names.index(drive.column)].mean())
            inputs[:, names.index(drive.column)] = middle + np.cumsum(v) * STEP
        else:
            loads.append(drive.column)
    for number, name in enumerate(loads):
        column = names.index(name)
        own = every[:, column]
        size = max(0.5 * float(np.ptp(own)), 0.5 * float(np.abs(own).max()))
        if own.min() > 0.0 or own.max() < 0.0:  # tendons pull, and do not push
            size = min(size, ONE_SIDED_SHARE * abs(float(own.mean())))
        inputs[:, column] += size * np.sin(2.0 * np.pi * (0.17 + 0.023 * number) * t)
    return inputs


def _reach(positions: Sequence[FloatArray]) -> float:
    return 0.5 * max(float(np.ptp(x)) for x in positions) or 1.0
