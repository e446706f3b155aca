"""A channel that stands at a limit where the model goes on: a sensor that saturates follows no law of the motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.arrays import BoolArray, FloatArray
from ...logs.quantisation import quantisation_step
from ..criteria import LIMIT_STEPS, LIMIT_VISITS, LIMIT_WIDTH_SHARE
from ..evidence import Limit
from ..runs.motion_signals import Coordinates

PARTS = (0.02, 0.04, 0.08, 0.16, 0.32)
"""Parts of the samples, the highest or the lowest of the model, among which a limit is looked for."""
MIDDLE = (0.05, 0.95)
"""Quantiles between which a width is taken."""
HIGHEST = 0.999
"""Quantile of a channel that is its end: beyond may be a spike."""
SAME, WIDER = 1.3, 1.1
"""Of a limit the width stays below so many times itself from one part to the next, while that of the model grows."""
SLOWEST = 0.05
"""Part of the RMS of the speed below which the drive counts as resting: there a channel may stand."""


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
    moves = np.abs(v) > SLOWEST * float(np.sqrt(np.mean(v**2)))
    edges: list[int] = np.cumsum([one.time.size for one in places])[:-1].tolist()
    found: dict[str, Limit] = {}
    for c, channel in enumerate(channels):
        y = np.concatenate([one[:, c] for one in targets])
        model = y - np.concatenate([one[:, c] for one in residuals])
        known = np.isfinite(model)
        model = np.where(known, model, y)
        least = LIMIT_STEPS * quantisation_step(y)
        ends = [_limit(sign * y, sign * model, moves & known, edges, least) for sign in (1.0, -1.0)]
        sides = [(one, sign) for one, sign in zip(ends, (1.0, -1.0), strict=True) if one]
        if sides:
            one, sign = max(sides, key=lambda side: side[0].share)
            found[channel] = Limit(sign * one.level, one.share)
    return found


def _limit(y: FloatArray, model: FloatArray, moves: BoolArray, edges: Sequence[int], least: float) -> Limit | None:
    """The upper limit of a signal: where the model is highest it stands, and it is nowhere higher."""
    held: Limit | None = None
    before: tuple[float, float] | None = None
    for part in PARTS:
        at = moves & (model >= np.quantile(model, 1.0 - part))
        if _visits(at, edges) < LIMIT_VISITS:
            before = None
            continue
        width, of_model = (float(np.subtract(*np.quantile(one[at], MIDDLE[::-1]))) for one in (y, model))
        level = float(np.median(y[at]))
        stands = 0.0 < width < LIMIT_WIDTH_SHARE * of_model and of_model > least
        if stands and before and float(np.quantile(y, HIGHEST)) <= level + width:
            same, wider = width < SAME * before[0], of_model > WIDER * before[1]
            if same and wider:
                held = Limit(level, float(np.mean(np.abs(y - level) <= width)))
        before = (width, of_model) if stands else None
    return held


def _visits(at: BoolArray, edges: Sequence[int]) -> int:
    """Stretches of samples that are at a place, over all runs."""
    return sum(int(np.sum(np.diff(one.astype(int), prepend=0) == 1)) for one in np.split(at, edges))
