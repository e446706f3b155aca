"""A channel that comes later and later: its clock does not run as that of the others, which no lag makes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...effects import about, effect_of, place_of
from ...kernels.kernel import Kernel
from ...regression.residuals import mean_square_beside
from ..choice.supported import Choice
from ..criteria import FIT_SPREAD_SHARE, MUCH_LESS_RATIO
from ..fits.refit import Fitted


def slow_clocks(fitted: Fitted) -> dict[str, float]:
    """By channel, by how much later it comes in each second [s/s], below zero for earlier.

    Of what a constant delay and a constant lost motion leave, a delay that grows with the time of a run predicts more
    than half, and leaves less than half of what a lost motion that grows leaves: no form of a model does so, however
    small.

    Parameters
    ----------
    fitted : Fitted
    """
    found = {}
    for c, channel in enumerate(fitted.problem.channels):
        columns, left = [], []
        for run, residual in zip(fitted.problem.runs, fitted.residuals, strict=True):
            time, _ = run.with_lead
            speed = np.gradient(run.targets[:, c] - residual[:, c], run.time)
            speed[residual[:, c] == 0.0] = 0.0  # not compared
            way, since = np.sign(speed), run.time - time[0]
            columns.append(np.stack([speed, way, since * speed, since * way], axis=1))
            left.append(residual[:, c])
        every, y = np.concatenate(columns), np.concatenate(left)
        constant, later, wider = (mean_square_beside(every[:, kept], y) for kept in ([0, 1], [0, 1, 2], [0, 1, 3]))
        told = constant - later > (FIT_SPREAD_SHARE * fitted.spread[c]) ** 2
        if told and later < MUCH_LESS_RATIO * min(constant, wider):
            found[channel] = float(-np.linalg.lstsq(every[:, :3], y)[0][2])
    return found


def clock_runs_slow(choice: Choice) -> bool:
    """Whether a slow clock takes an answer away: it holds a lag of that channel, or no effect at all."""
    slow = slow_clocks(choice.winner.fitted)
    if not choice.winner.effects:
        return bool(slow)
    return any(
        place_of(spec)[1] in slow and about(spec).family == "sensor" and _takes_time(spec)
        for one in choice.supported for spec in one.effects
    )  # fmt: skip


def _takes_time(spec: str) -> bool:
    return any(v.quantity.unit == "s" for v in Kernel(effect_of(spec)).parameters)


def clock_notes(fitted: Fitted) -> Iterator[str]:
    """What a user should know of it, a sentence for each such channel."""
    for channel, rate in slow_clocks(fitted).items():
        when = "later" if rate > 0.0 else "earlier"
        yield (
            f"{channel} comes {when} by {1e3 * abs(rate):.2g} ms in each second of a run: its clock does not run as "
            "that of the motion; give the log with one clock"
        )
