"""Model selection: from hypotheses to those that the runs support, and to what these leave unexplained."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...regression.problem import FitRun
from ...regression.threads import together
from ..criteria import FOLDED_HYPOTHESES, MOST_EFFECTS
from .baselines import Baselines
from .floors import Floors, floors_of
from .hypotheses import Hypothesis, can_leave_out, left_out_in_turn
from .patches import without_patches
from .supported import Choice, choice_of, log_residual


@dataclass(frozen=True)
class Selection:
    """The supported hypotheses among those that were refitted, and the floors of what they leave.

    Attributes
    ----------
    baselines : Baselines
        With what they leave on runs left out in turn, where no run is held out.
    hypotheses : tuple of Hypothesis
        The first has no effect but the nuisance parameters.
    choice : Choice
    floors : Floors
    """

    baselines: Baselines
    hypotheses: tuple[Hypothesis, ...]
    choice: Choice
    floors: Floors


def select(
    found: Sequence[Hypothesis], baselines: Baselines, holdout: Sequence[FitRun], progress: Callable[[str], None]
) -> Selection:
    """The supported hypotheses, and the floors.

    Parameters
    ----------
    found : sequence of Hypothesis
        The first has no effect but the nuisance parameters.
    baselines : Baselines
    holdout : sequence of FitRun
    progress : callable
        Given what is being done.
    """
    if not holdout and can_leave_out(baselines.refitted.fitted.task.runs):
        progress("runs left out in turn")
        best = sorted(found[1:], key=log_residual)[:FOLDED_HYPOTHESES]
        refitted, *found = together(left_out_in_turn, [baselines.refitted, found[0], *best])
        baselines = replace(baselines, refitted=refitted, with_nuisances=found[0])
    choice = choice_of(found, baselines.refitted)
    floors = floors_of(choice, baselines.refitted, baselines.reference, baselines.stepped)
    if floors.open_.any() and not floors.unexplained.any():
        progress("patches")
        fewer = without_patches(choice, found, floors.open_, holdout)
        if fewer is None:
            floors = replace(floors, unexplained=floors.open_)
        else:
            choice = fewer
    if len(choice.winner.effects) > MOST_EFFECTS:  # its nuisance effects counted: some sum of so many closes any gap
        floors = replace(floors, unexplained=np.ones_like(floors.open_))
    return Selection(baselines, tuple(found), choice, floors)
