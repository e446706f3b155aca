"""The effects that come closest to what has no name: of what family that may be."""

from __future__ import annotations

from ..choice.hypotheses import Hypothesis
from ..choice.selection import Selection
from ..choice.supported import log_residual
from ..criteria import STRONGEST_RATIO
from ..fits.significance import notably_removed, telling_nuisances
from .verdict import Verdict


def closest_effects(one: Selection, verdict: Verdict, *, missing: bool) -> tuple[str, ...]:
    """Effects of the best hypothesis, where it closes as much of a channel as a named effect must.

    Of those that have lost their signature only where one closes as much alone: they stand for a law like theirs.
    Else, also where nothing is missing, those that it adds to the nuisance parameters, if they remove a notable part of
    what is left, and more than next to nothing. Where these parameters close the gap with other values of the model, or
    alone as much of it as a named effect must and no other does notably more, it is those of them that tell of it.

    Parameters
    ----------
    one : Selection
    verdict : Verdict
    missing : bool
        Whether something is.
    """
    best, plain, refitted = one.choice.best, one.hypotheses[0], one.baselines.refitted
    adds = notably_removed(plain.measured, best.measured, best.fitted.spread).any()
    fitted = verdict.final if verdict.word == "parameters" else None
    if missing and not adds and _closes_as_a_name(plain, refitted):
        fitted = plain.fitted
    telling = telling_nuisances(fitted, plain.nuisances) if fitted else ()
    if telling:
        return telling
    for near in (best, min(one.hypotheses, key=log_residual)):
        if missing and _closes_as_a_name(near, refitted):
            return near.effects
    return best.added if adds else ()


def _closes_as_a_name(one: Hypothesis, refitted: Hypothesis) -> bool:
    """Of a channel."""
    return bool((one.measured < (1.0 - STRONGEST_RATIO) * refitted.measured).any())
