"""A channel that stands at a limit: what that makes of the answer."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ...regression.problem import FitRun
from ..choice.selection import Selection
from ..evidence import Limit
from ..fits.refit import Fitted
from ..fits.response import places_of
from ..residual.limits import limits


def limits_met(fits: Sequence[Fitted], runs: Sequence[FitRun], holdout: Sequence[FitRun] = ()) -> dict[str, Limit]:
    """Limits at which channels stand in all samples of the runs where each of some fits goes on, by channel.

    Of held-out runs too: their motion may reach a limit that the measured runs hardly do.

    Parameters
    ----------
    fits : sequence of Fitted
        The refitted model without effects, which may bend to a limit; and the model as given: friction that levels off
        as it does there is no limit, though a refit that bends to something else goes on.
    runs, holdout : sequence of FitRun
        Those of the fits, and others.
    """
    first, *others = fits
    met = _limits(first, runs, holdout)
    for other in others if met else ():  # hardly ever: each is simulated on all samples
        there = _limits(other, runs, holdout)
        met = {channel: one for channel, one in met.items() if channel in there}
    return met


def _limits(fitted: Fitted, runs: Sequence[FitRun], holdout: Sequence[FitRun]) -> dict[str, Limit]:
    parts = [fitted.at(runs), *([fitted.on(holdout)] if holdout else [])]
    targets = [run.targets for whole in parts for run in whole.problem.runs]
    residuals = [one for whole in parts for one in whole.compared_residuals]
    return limits(fitted.problem.channels, targets, residuals, [one for whole in parts for one in places_of(whole)])


def with_limits(one: Selection, met: Collection[str]) -> Selection:
    """The same; what is missing at a limit is no effect of the library, and none that acts there is named.

    Parameters
    ----------
    one : Selection
    met : collection of str
        Channels that stand at a limit.
    """
    winner = one.choice.winner
    there = np.array([channel in met for channel in winner.fitted.problem.channels])
    if winner.effects and not (winner.acts & there).any():
        return one
    return replace(one, floors=replace(one.floors.missing_at(there), in_part=False))
