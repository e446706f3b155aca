"""A channel that stands at a limit where the model goes on: a sensor that saturates follows no law of the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import iqr

from ...kernels.arrays import BoolArray, FloatArray
from ...logs.quantisation import quantisation_step
from ...regression.residuals import rms
from ..criteria import (
    LIMIT_SAME_RATIO,
    LIMIT_SPEED_SHARE,
    LIMIT_STEPS,
    LIMIT_VISITS,
    LIMIT_WIDER_RATIO,
    LIMIT_WIDTH_SHARE,
)
from ..evidence import Limit
from ..runs.motion_signals import Coordinates

PARTS = (0.02, 0.04, 0.08, 0.16, 0.32)
"""Parts of the samples, the highest or the lowest of the model, among which a limit is looked for."""
HIGHEST = 0.999
"""Quantile of a channel that is its end: beyond may be a spike."""


def limits(
    channels: Sequence[str], targets: Sequence[FloatArray], residuals: Sequence[FloatArray],
    places: Sequence[Coordinates],
) -> dict[str, Limit]:  # fmt: skip
    """Limits that channels stand at, in several stretches of motion, by channel.

    Parameters
    ----------
    channels : sequence of str
    targets, residuals : sequence of ndarray, shape (n, channels)
        Of each run: what was measured, and what a model leaves of it, NaN where that is not compared.
    places : sequence of Coordinates
        At the same samples.
    """
    v = np.concatenate([c.v for c in places])
    moves = np.abs(v) > LIMIT_SPEED_SHARE * float(np.sqrt(np.mean(v**2)))
    edges: list[int] = np.cumsum([one.time.size for one in places])[:-1].tolist()
    found: dict[str, Limit] = {}
    for c, channel in enumerate(channels):
        y = np.concatenate([one[:, c] for one in targets])
        model = y - np.concatenate([one[:, c] for one in residuals])
        known = np.isfinite(model)
        model = np.where(known, model, y)
        least = LIMIT_STEPS * quantisation_step(y)
        ends = ((sign, _limit(sign * y, sign * model, moves & known, edges, least)) for sign in (1.0, -1.0))
        met = [replace(one, level=sign * one.level) for sign, one in ends if one]
        if met:
            found[channel] = max(met, key=lambda one: one.share)
    return found


def _limit(y: FloatArray, model: FloatArray, moves: BoolArray, edges: Sequence[int], least: float) -> Limit | None:
    """The upper limit of a signal: where the model is highest it stands, and it is nowhere higher."""
    highest, held = float(np.quantile(y, HIGHEST)), None
    before: tuple[float, float] | None = None
    for part in PARTS:
        at = moves & (model >= np.quantile(model, 1.0 - part))
        now: tuple[float, float] | None = None
        if _visits(at, edges) >= LIMIT_VISITS:
            width, of_model = (float(iqr(one[at], rng=(5, 95))) for one in (y, model))
            if 0.0 < width < LIMIT_WIDTH_SHARE * of_model and of_model > least:
                now = width, of_model
        if now and before and now[0] < LIMIT_SAME_RATIO * before[0] and now[1] > LIMIT_WIDER_RATIO * before[1]:
            level = float(np.median(y[at]))
            stands = np.abs(y - level) <= now[0]
            if highest <= level + now[0]:
                held = Limit(level, float(np.mean(stands)), _excess(y - model, stands))
        before = now
    return held


def _excess(residual: FloatArray, stands: BoolArray) -> float:
    """RMS of a residual where a channel stands, over that elsewhere."""
    there, elsewhere = (float(rms([residual[where]])) if where.any() else 0.0 for where in (stands, ~stands))
    return there / max(elsewhere, 1e-300)


def _visits(at: BoolArray, edges: Sequence[int]) -> int:
    """Stretches of samples that are at a place, over all runs."""
    return sum(int(np.sum(np.diff(one.astype(int), prepend=0) == 1)) for one in np.split(at, edges))
