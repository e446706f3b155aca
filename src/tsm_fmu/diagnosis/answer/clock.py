"""A channel that comes later and later: its clock does not run as that of the others, which no lag makes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...effects import about, effect_of, place_of
from ...kernels.kernel import Kernel
from ..choice.supported import Choice
from ..criteria import CLEAN_EFFECT_SPREAD_SHARE, SLOW_CLOCK_SHARE
from ..fits.refit import Fitted


def slow_clocks(fitted: Fitted) -> dict[str, float]:
    """By channel, by how much later it comes in each second [s/s], below zero for earlier.

    Of what a constant delay leaves, one that grows with the time of a run predicts a notable part.

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
            columns.append(np.stack([speed, (run.time - time[0]) * speed], axis=1))
            left.append(residual[:, c])
        both, y = np.concatenate(columns), np.concatenate(left)
        constant = y - both[:, 0] * (both[:, 0] @ y / max(both[:, 0] @ both[:, 0], 1e-300))
        rates = np.linalg.lstsq(both, y)[0]
        gained = np.mean(constant**2) - np.mean((y - both @ rates) ** 2)
        least = (CLEAN_EFFECT_SPREAD_SHARE * fitted.spread[c]) ** 2
        if gained > max(SLOW_CLOCK_SHARE * float(np.mean(constant**2)), least):
            found[channel] = float(-rates[1])
    return found


def lags_of_slow_clocks(choice: Choice) -> bool:
    """Whether a lag of a channel is in the answer that grows with time."""
    slow = slow_clocks(choice.winner.fitted)
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
