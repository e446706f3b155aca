"""Effects of channels that are explained, where another channel is not.

What nothing explains in a torque takes no name away from what a position lacks, as long as that has nothing to do with
the torque: its effects act on explained channels alone, and close as much of the gap there as others must. Nor does it
take few levels away: they are read from the log.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...kernels.arrays import BoolArray
from ...regression.problem import FitRun
from ..criteria import CLEAN_EFFECT_SPREAD_SHARE, OPEN_GAP_EFFECTS
from ..fits.quantised import Levels
from ..fits.refit import Fitted
from .floors import mostly_explained
from .hypotheses import Hypothesis
from .patches import restricted_to
from .supported import Choice


def of_explained_channels(
    choice: Choice, refitted: Hypothesis, explained: BoolArray, hypotheses: Sequence[Hypothesis],
    holdout: Sequence[FitRun], reference_fit: Fitted | None,
) -> Choice | None:  # fmt: skip
    """The choice with such effects alone; None where a supported hypothesis has none, or they are too many.

    Parameters
    ----------
    choice : Choice
    refitted : Hypothesis
        The refitted model without nuisance effects.
    explained : ndarray of bool, shape (channels,)
        Channels in which the choice leaves no more than the form of its laws.
    hypotheses : sequence of Hypothesis
        Where to find those with fewer effects.
    holdout : sequence of FitRun
    reference_fit : Fitted or None
        Of the model on reference runs: what it leaves there no effect takes away.
    """
    found: list[Hypothesis] = []
    for one in choice.supported:
        closed = explained & _closed(one, refitted, reference_fit)
        kept = [spec for spec in one.effects if _acts_within(one, spec, closed)]
        if not kept:
            return None
        fewer = one if len(kept) == len(one.effects) else restricted_to(one, kept, hypotheses, holdout)
        if not _closed(fewer, refitted, reference_fit)[closed].all():
            return None
        if all(set(fewer.effects) != set(other.effects) for other in found):
            found.append(fewer)
    fewest = min(len(h.effects) for h in found)
    if not 0 < fewest <= OPEN_GAP_EFFECTS:
        return None
    return Choice(choice.best, tuple(h for h in found if len(h.effects) == fewest))


def of_levels(
    choice: Choice, open_: BoolArray, levels: Sequence[Levels], hypotheses: Sequence[Hypothesis],
    holdout: Sequence[FitRun],
) -> Choice | None:  # fmt: skip
    """The choice without any effect, where a channel with few levels lacks nothing else; None where none does.

    Parameters
    ----------
    choice : Choice
    open_ : ndarray of bool, shape (channels,)
        Channels in which the choice leaves something.
    levels : sequence of Levels
    hypotheses : sequence of Hypothesis
        The first has no effect but the nuisance effects.
    holdout : sequence of FitRun
    """
    plain = hypotheses[0]
    closed = [c for c, there in zip(plain.fitted.problem.channels, open_, strict=True) if not there]
    if not any(one.channel in closed for one in levels):
        return None
    return Choice(choice.best, (restricted_to(plain, (), hypotheses, holdout),))


def _closed(one: Hypothesis, refitted: Hypothesis, reference_fit: Fitted | None) -> BoolArray:
    """Channels with a gap of which a hypothesis leaves as little as an answer may."""
    gap = refitted.measured > (CLEAN_EFFECT_SPREAD_SHARE * one.fitted.spread) ** 2
    return gap & mostly_explained(one, refitted, reference_fit)


def _acts_within(one: Hypothesis, spec: str, channels: BoolArray) -> bool:
    """Whether an effect of a hypothesis changes these channels and no other."""
    changed = one.changed_by(spec)
    return bool(changed[channels].any() and not changed[~channels].any())
