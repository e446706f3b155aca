"""A zero that wanders: what that makes of the runs and of the answer."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from ...effects import EFFECTS, about
from ...regression.problem import FitRun
from ..choice.floors import nearly_closed
from ..choice.selection import Selection
from ..criteria import WANDER_FUNCTIONS
from ..evidence import FamilyShare, Wander
from ..fits.refit import Fitted
from ..fits.response import places_of
from ..residual.wander import slow_with_nothing, wander_sizes, wandering_zeros
from ..runs.motion_signals import coordinate_units
from ..runs.prepared import PreparedRuns

OFFSET = next(module for module in EFFECTS if module.ABOUT.fitted_as == "offset")
"""The effect of a zero."""


def zeros_that_wander(one: Selection, runs: PreparedRuns) -> dict[str, Wander]:
    """Zeros that wander in what the best hypothesis leaves of channels in which something is open.

    Or, where there is no answer, in what the model without effects leaves: laws with a memory follow part of a zero.

    Parameters
    ----------
    one : Selection
    runs : PreparedRuns
    """
    still_open = dict(zip(runs.channels, one.floors.open_ | one.floors.unexplained, strict=True))
    best, plain = one.choice.best, one.baselines.with_nuisances
    for hypothesis in (best, plain) if one.floors.without_answer and best.added else (best,):
        left = hypothesis.fitted.at(runs.measured)
        units = coordinate_units(left.problem.kernel)
        found = wandering_zeros(runs.channels, left.residuals, places_of(left), left.spread, units)
        if wanders := {c: wander for c, wander in found.items() if still_open[c]}:
            return wanders
    return {}


def slow_parts(refitted: Fitted, runs: PreparedRuns) -> tuple[FamilyShare, ...]:
    """What moves slowly in what the refitted model leaves, and with nothing that the log holds.

    Parameters
    ----------
    refitted : Fitted
    runs : PreparedRuns
    """
    whole = refitted.at(runs.measured)
    shares = slow_with_nothing(whole.residuals, places_of(whole), coordinate_units(whole.problem.kernel))
    found = zip(runs.channels, shares.tolist(), strict=True)
    return tuple(FamilyShare(about(OFFSET.NAME).family, channel, share, "slow") for channel, share in found if share)


def with_sizes(wanders: Mapping[str, Wander], one: Selection, runs: PreparedRuns) -> dict[str, Wander]:
    """The same, as large as what the answer's model leaves of the runs when no zero is free.

    Parameters
    ----------
    wanders : mapping of str to Wander
        By channel.
    one : Selection
        With free zeros.
    runs : PreparedRuns
        Without.
    """
    fitted = one.choice.winner.fitted.at(runs.measured)
    sizes = dict(zip(runs.channels, wander_sizes(fitted.residuals, places_of(fitted)).tolist(), strict=True))
    return {c: replace(wander, rms=sizes[c]) for c, wander in wanders.items()}


def with_free_zeros(runs: PreparedRuns, channels: Collection[str]) -> PreparedRuns:
    """The same, compared but for slow zeros of these channels.

    Of held-out runs wholly: the offset that their first seconds give is that of the zero there.
    """
    columns = [c for c, channel in enumerate(runs.channels) if channel in channels]

    def free(group: tuple[FitRun, ...], *, constant: bool = False) -> tuple[FitRun, ...]:
        return tuple(run.with_slow_zero(columns, WANDER_FUNCTIONS, constant=constant) for run in group)

    return replace(
        runs,
        measured=free(runs.measured),
        holdout=free(runs.holdout, constant=True),
        reference=free(runs.reference),
    )


def offsets_of(wanders: Collection[str]) -> list[str]:
    """Specs of the offsets of channels."""
    return [f"{OFFSET.NAME}@{channel}" for channel in wanders]


def explained_by_zeros(free: Selection, plain: Selection, wanders: Collection[str]) -> Selection | None:
    """What was chosen with free zeros, if these and its effects explain their channels; else None.

    The zeros then close most of the gap, though they may move a little faster than what is free; and what was named
    without them is named with them.

    Parameters
    ----------
    free, plain : Selection
        With and without free zeros.
    wanders : collection of str
        Channels.
    """
    winner, before = free.choice.winner, plain.choice.winner
    there = np.array([channel in wanders for channel in winner.fitted.problem.channels])
    closed = there & nearly_closed(winner, plain.baselines.refitted, free.baselines.reference)
    floors = replace(free.floors, unexplained=free.floors.unexplained & ~closed)
    named = () if plain.floors.without_answer else before.effects
    lost = set(named) - {*winner.effects, *offsets_of(wanders)}
    if lost or (floors.unexplained & there).any():
        return None
    return replace(free, floors=floors)
