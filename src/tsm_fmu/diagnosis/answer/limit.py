"""A channel that stands at a limit: what that makes of the answer."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...regression.problem import FitRun
from ..choice.selection import Selection
from ..criteria import LIMIT_EXCESS_RATIO
from ..evidence import Limit
from ..fits.refit import Fitted
from ..fits.response import places_of
from ..residual.limits import limits


def limits_met(fits: Sequence[Fitted], runs: Sequence[FitRun], holdout: Sequence[FitRun] = ()) -> dict[str, Limit]:
    """Limits at which channels stand in all samples of the runs where each of some fits goes on, by channel.

    Of held-out runs too, whose motion may reach one that the measured runs hardly do: one of the fits must be off there
    by much more than elsewhere, as any that predicts them badly goes on beyond friction that levels off.

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
    for other in others if any(met) else ():  # hardly ever: each is simulated on all samples
        met = tuple(map(_of_both, met, _limits(other, runs, holdout)))
    of_measured, of_all = met[0], met[-1]
    return {channel: one for channel, one in of_all.items() if one.excess > LIMIT_EXCESS_RATIO} | of_measured


def _limits(fitted: Fitted, runs: Sequence[FitRun], holdout: Sequence[FitRun]) -> tuple[dict[str, Limit], ...]:
    """Of the measured runs, and of all if there are others."""
    parts = [fitted.at(runs), *([fitted.on(holdout)] if holdout else [])]
    channels, found = fitted.problem.channels, list[dict[str, Limit]]()
    for some in (parts[: k + 1] for k in range(len(parts))):
        targets = [run.targets for whole in some for run in whole.problem.runs]
        residuals = [one for whole in some for one in whole.compared_residuals]
        found.append(limits(channels, targets, residuals, [one for whole in some for one in places_of(whole)]))
    return tuple(found)


def _of_both(one: Mapping[str, Limit], other: Mapping[str, Limit]) -> dict[str, Limit]:
    """Limits beyond which two fits go on; of each that of the one that is off there by more."""
    return {c: max(limit, other[c], key=lambda one: one.excess) for c, limit in one.items() if c in other}


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
