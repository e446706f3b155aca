"""What a model leaves of its channels at its best values, in sentences that say where to go on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ..logs.agreement import Agreement
from ..logs.display import display
from ..regression.residuals import ResidualTests

NOTABLE_NRMSE = 0.012
"""Errors below this part of a channel's spread are no effect that a diagnosis would name."""
FLOOR_RATIO = 3.0
"""Times what a channel does not repeat from period to period, beyond which a model leaves a law."""
SLOW_WATSON = 0.2
"""Durbin-Watson statistic below which an error is slow: sensors seldom are, laws that a model lacks are."""
CONSTANT_SHARE = 0.25
"""Part of an error's mean square that the means of the runs make up, from which on they are said."""
FEWEST_RUNS = 3
"""Runs whose means say something about other runs."""


def shortfalls(
    measured: Mapping[str, Agreement], runs: Sequence[Mapping[str, Agreement]], floors: Mapping[str, float],
    residuals: Mapping[str, ResidualTests],
) -> tuple[str, ...]:  # fmt: skip
    """Sentences for the channels of which a fit leaves more than other values of its parameters can mend.

    Parameters
    ----------
    measured : mapping of str to Agreement
        Pooled over the measured runs, by channel.
    runs : sequence of mapping
        The same of each measured run.
    floors : mapping of str to float
        What does not repeat from period to period [RMS], of the channels where it is known.
    residuals : mapping of str to ResidualTests
    """
    sentences, lacking = [], []
    for channel, left in measured.items():
        if not left.nrmse > NOTABLE_NRMSE or not _lawful(left, floors.get(channel), residuals[channel]):
            continue
        lacking.append(_size(channel, left, floors.get(channel)))
        means = [run[channel].offset for run in runs]
        if len(runs) >= FEWEST_RUNS and left.offset**2 > CONSTANT_SHARE * left.rmse**2:
            sentences.append(_constants(channel, left, means))
    if lacking:
        sentences.append(
            f"what is left is no noise, {' and '.join(lacking)}: where other start values end here too, the model "
            "lacks a law; 'tsm-fmu diagnose CARD --measured RUN ...' looks for what is missing"
        )
    return tuple(sentences)


def _lawful(left: Agreement, floor: float | None, tests: ResidualTests) -> bool:
    if floor is not None:
        return left.rmse > FLOOR_RATIO * floor
    return not math.isnan(tests.durbin_watson) and tests.durbin_watson < SLOW_WATSON


def _size(channel: str, left: Agreement, floor: float | None) -> str:
    show = display(left.unit, left.rmse)
    if floor is None:
        return f"{show(left.rmse, 3)} of {channel} (slow)"
    if floor * 1e3 < left.rmse:  # simulated runs repeat exactly
        return f"{show(left.rmse, 3)} of {channel} (the same from period to period)"
    return f"{show(left.rmse, 3)} of {channel} ({left.rmse / floor:.2g} times what does not repeat itself)"


def _constants(channel: str, left: Agreement, means: Sequence[float]) -> str:
    show = display(left.unit, left.rmse)
    low, high = (show(end, 3) for end in (min(means), max(means)))
    return (
        f"each run has a constant error of {channel} of its own, from {low} to {high}, {show(left.offset, 3)} RMS over "
        f"{len(means)} runs, and {show(left.shape_rmse, 3)} beside it: a zero that moves from run to run "
        "(re-engagement, slip), or a law of something that is constant in a run, as a load"
    )
