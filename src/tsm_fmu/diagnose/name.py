"""Naming: candidates refitted with the baseline, ranked by their gain, confirmed where they were not fitted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..identify.problem import FitRun, FloatArray
from ..models.contract import InputError
from .candidates import Screened
from .study import Fitted, refit

REFITTED = 6
"""Candidates of the linear step that are refitted."""


@dataclass(frozen=True)
class Named:
    """A candidate after its refit.

    Attributes
    ----------
    spec : str
        Effect and place.
    fitted : Fitted
    score : float
        Twice the log likelihood gained over the baseline with effective samples, less the information criterion's
        cost of its parameters, less the gain on reference runs.
    closure_measured, closure_holdout : float or None
        Share of the removable gap that it closes.
    holdout_gain : float or None
        Twice the log likelihood gained on held-out runs.
    """

    spec: str
    fitted: Fitted
    score: float
    closure_measured: float | None = None
    closure_holdout: float | None = None
    holdout_gain: float | None = None

    @property
    def effect(self) -> str:
        return self.spec.partition("@")[0]


def likelihood_gain(before: Fitted, after: Fitted) -> float:
    """Twice the log likelihood gained, channel by channel, each with the samples its residual is worth."""
    return float(np.sum(before.effective * np.log(before.rmse**2 / np.maximum(after.rmse**2, 1e-300))))


def residual_gain(before: Sequence[FloatArray], after: Sequence[FloatArray], worth: FloatArray) -> float:
    """The same for residuals of runs that were not fitted; ``worth`` is effective samples per sample, by channel."""
    count = sum(r.shape[0] for r in before)
    ratio = np.mean(np.concatenate(before) ** 2, axis=0) / np.mean(np.concatenate(after) ** 2, axis=0)
    return float(np.sum(worth * count * np.log(ratio)))


def closure(before: FloatArray, after: FloatArray, floor: FloatArray) -> float | None:
    """Share of the removable mean square that is gone, over the channels that had any; None without a gap."""
    removable = before**2 - floor**2
    open_ = removable > 0.05 * floor**2
    if not open_.any():
        return None
    weight = 1.0 / before[open_] ** 2
    return float(1.0 - np.sum(weight * (after[open_] ** 2 - floor[open_] ** 2)) / np.sum(weight * removable[open_]))


def named(
    base: Fitted, screened: Sequence[Screened], holdout: Sequence[FitRun], floor: FloatArray,
    said: Callable[[str], None] = lambda _: None,
) -> list[Named]:  # fmt: skip
    """Refit the best of the screened candidates; best score first."""
    results = []
    before_held = base.judged_on(holdout)
    worth = base.effective / sum(r.shape[0] for r in base.residuals)
    for s in [s for s in screened if s.excited][:REFITTED]:
        said(f"refit with {s.attached.spec}")
        try:
            fitted = refit(
                base.model,
                [*base.effects, s.attached.spec],
                base.problem.runs,
                base.problem.channels,
                values={**base.values, **s.values},
                free=_free(base, s),
                weights=base.problem.weights,
            )
        except InputError:
            continue
        added = len(s.values)
        score = likelihood_gain(base, fitted) - added * float(np.log(np.sum(base.effective)))
        one = Named(s.attached.spec, fitted, score, closure(base.rmse, fitted.rmse, floor))
        if holdout:
            after = fitted.judged_on(holdout)
            rms = [np.sqrt(np.mean(np.concatenate(r) ** 2, axis=0)) for r in (before_held, after)]
            one = replace(
                one,
                closure_holdout=closure(rms[0], rms[1], floor),
                holdout_gain=residual_gain(before_held, after, worth),
            )
        results.append(one)
    return sorted(results, key=lambda r: -r.score)


def _free(base: Fitted, s: Screened) -> list[str]:
    names = {base.problem.declared[f].name for f in (*base.problem.shared, *base.problem.own)}
    return [*names, *s.values, "motion.x_pre"]
