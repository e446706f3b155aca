"""Model selection: from hypotheses to those that the runs support, and to what these leave unexplained."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects import about, looks_like, place_of
from ...kernels.arrays import BoolArray, FloatArray
from ...regression.problem import FitRun
from ...regression.residuals import rms
from ...regression.threads import together
from ..criteria import (
    CLEAN_EFFECT_SPREAD_SHARE,
    CONVERGED_SHARE,
    EFFECT_SPREAD_SHARE,
    EXPLAINED_SHARE,
    FOLDED_HYPOTHESES,
    FORM_RATIO,
    FURTHER_EFFECT_SPREAD_SHARE,
    LEADING_SHARE,
    MISLEADING_RATIO,
    MISLEADING_STATE_RATIO,
    MOST_EFFECTS,
    MUCH_LESS_RATIO,
    NOTABLE_RATIO,
)
from ..fits.refit import Fitted
from .baselines import Baselines
from .explained import of_explained_channels, of_levels
from .floors import Floors, floors_of, least_floor, shown_elsewhere
from .hypotheses import Hypothesis, can_leave_out, left_out_in_turn
from .near import hidden_near, rivals
from .patches import without_patches
from .served import served_choice
from .supported import Choice, clearly_worse, comes_near, dominated, leaves_less, log_residual

FREE_FAMILIES = ("position", "time")
"""Families of smooth laws of one coordinate."""


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

    @property
    def unlike_references(self) -> bool:
        """Whether nothing is missing with values of which none serve reference runs too: they may imitate a law."""
        winner = self.choice.winner
        return self.baselines.joint is not None and not winner.effects and not winner.serves_references

    @property
    def of_gap(self) -> Hypothesis:
        """The refitted model in whose gap a law is looked for: where values hide it, at those of reference runs too."""
        joint = self.baselines.joint
        return joint.refitted if joint is not None and self.unlike_references else self.baselines.refitted

    @property
    def elsewhere(self) -> BoolArray:
        """Channels of which only held-out runs show a gap, shape (channels,)."""
        return shown_elsewhere(self.choice.winner, self.baselines.reference)


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
    judged = found
    if not holdout and can_leave_out(baselines.refitted.fitted.task.runs):
        progress("runs left out in turn")
        refitted, *judged = together(left_out_in_turn, [baselines.refitted, found[0], *_contending(found, baselines)])
        baselines = replace(baselines, refitted=refitted, with_nuisances=judged[0])
        by_effects = {(h.added, h.nuisances): h for h in judged}
        found = [by_effects.get((h.added, h.nuisances), h) for h in found]
    choice = _without_any_laws(served_choice(judged, baselines.refitted))
    floors = floors_of(choice, baselines.refitted, baselines.reference)
    if floors.open_.any() and not floors.unexplained.any():
        progress("patches")
        fewer = without_patches(choice, found, floors.open_, holdout)
        if fewer is None:
            floors = replace(floors, unexplained=floors.open_)
        else:
            choice = fewer
    if floors.unexplained.any():
        ahead = floors.unexplained & _far_ahead(choice, judged, baselines.reference, floors.open_)
        floors = replace(floors, unexplained=floors.unexplained & ~ahead)
        if ahead.any():
            choice = replace(choice, supported=(*choice.supported, *hidden_near(choice, judged)))
    predicting = _predicting(choice.winner, found[0], baselines.refitted, holdout) if holdout else choice.winner
    if predicting and predicting is not choice.winner:
        found = [predicting if h is choice.winner else h for h in found]
        choice = replace(choice, supported=(predicting, *choice.supported[1:]))
    if (
        len(choice.winner.effects) > MOST_EFFECTS  # its nuisance effects counted: some sum of so many closes any gap
        or any(_any_law_of_a_coordinate(h.effects) for h in choice.supported)
        or _imitates(choice.winner, judged, baselines.refitted)
        or predicting is None
    ):
        floors = replace(floors, unexplained=np.ones_like(floors.open_))
    if floors.unexplained.any():
        part = of_explained_channels(
            choice, baselines.refitted, ~floors.unexplained, found, holdout, baselines.reference
        )
        left = floors.open_ & ~floors.unexplained
        if part and left.any():
            part = without_patches(part, found, left, holdout)
        part = part or of_levels(choice, floors.open_ | floors.unexplained, baselines.levels, found, holdout)
        choice, floors = part or choice, replace(floors, in_part=part is not None)
    return Selection(baselines, tuple(found), choice, floors)


def without_names(one: Selection) -> Selection:
    """The same, in which nothing is explained."""
    floors = replace(one.floors, unexplained=np.ones_like(one.floors.open_), in_part=False)
    return replace(one, floors=floors)


def with_rivals(one: Selection) -> Selection:
    """The same, in which effects that come near an answer are in a set with it."""
    if one.floors.without_answer:
        return one
    supported = (*one.choice.supported, *rivals(one.choice, one.hypotheses, one.baselines.reference))
    return replace(one, choice=replace(one.choice, supported=supported))


def _far_ahead(
    choice: Choice, hypotheses: Sequence[Hypothesis], reference_fit: Fitted | None, open_: BoolArray
) -> BoolArray:
    """Channels in which what is left takes no name away: no other effect comes near.

    One effect closes half of the gap of measured runs there and a notable part of that of others, nothing else is
    supported but what hides behind it, and without these twice as much is left at least: its law is not quite that of
    the rig then, or the form of the model is what all candidates leave. A gain of others will do where what it leaves
    of the measured runs is too little for a second effect: other motions may show more of the form, but of what is open
    not many times as much. Or it predicts most of the gap of runs that it was not fitted to, which no such form does.
    Of several effects each would have such a lead: a sum of laws bends to the form. Nor is it one where a sum with
    another law of the same coordinate leaves half as much: such a sum is any law of it, and the rig's is none of both.
    """
    one, plain = choice.winner, hypotheses[0]
    nowhere = np.zeros(one.measured.size, bool)
    if any(len(h.effects) != 1 for h in choice.supported) or one.held_out is None or plain.held_out is None:
        return nowhere
    floor, spread = least_floor(one, reference_fit) ** 2, one.fitted.spread

    def closed(left: FloatArray, gap: FloatArray, share: float) -> BoolArray:
        return (left - floor < (1.0 - share) * np.maximum(gap - floor, 0.0)) & (gap > floor)

    def removes(share: float) -> BoolArray:
        return plain.measured - one.measured > (share * spread) ** 2

    specs = {spec for h in choice.supported for spec in h.effects}
    if not _leads(one, hypotheses, specs) or _bends_to_any_law(one, hypotheses):
        return nowhere
    found = closed(one.held_out, plain.held_out, EXPLAINED_SHARE) & removes(CLEAN_EFFECT_SPREAD_SHARE)
    if all(_stands_for(spec, one.effects) for spec in specs):
        carries_over = plain.held_out - one.held_out > NOTABLE_RATIO * one.held_out
        little_left = one.measured < (FURTHER_EFFECT_SPREAD_SHARE * spread) ** 2
        gains = one.held_out * (1.0 + CONVERGED_SHARE) < plain.held_out
        carries_over |= little_left & removes(EFFECT_SPREAD_SHARE) & gains
        carries_over &= ~open_ | (one.held_out < FORM_RATIO**2 * np.maximum(one.measured, floor))
        found |= closed(one.measured, plain.measured, LEADING_SHARE) & carries_over
    return one.acts & found


def _bends_to_any_law(one: Hypothesis, hypotheses: Sequence[Hypothesis]) -> bool:
    """Whether with one more law of the position, or of time, at its place an effect leaves half as much."""
    sums = [h for h in hypotheses if set(one.added) < set(h.added) and _any_law_of_a_coordinate(h.added)]
    return any((h.measured < MUCH_LESS_RATIO * one.measured)[one.acts].any() for h in sums)


def _leads(one: Hypothesis, hypotheses: Sequence[Hypothesis], specs: Collection[str]) -> bool:
    """Whether all hypotheses without some effects, nor any that hides behind them, leave twice as much.

    On the average over measured and held-out runs, or of the measured ones and no less of the others, whose motion may
    show little but the form of the model. Not where every one has them, as nuisance effects that are large: nothing
    shows the lead then.
    """

    def without(h: Hypothesis) -> bool:
        return not h.disguised and not any(_stands_for(s, specs) for s in h.effects)

    def far(h: Hypothesis) -> bool:
        if not comes_near(h, one):
            return True
        if h.held_out is None or one.held_out is None:
            return False
        behind = (one.measured < MUCH_LESS_RATIO * h.measured) & (one.held_out <= h.held_out)
        return bool(behind[one.acts].any())

    rivals = [h for h in hypotheses if without(h)]
    return bool(rivals) and all(map(far, rivals))


def _stands_for(spec: str, others: Collection[str]) -> bool:
    """Whether an effect is one of others, whatever drives it, or hides behind one of them."""
    return place_of(spec) in map(place_of, others) or looks_like(spec, others)


def _misleads(one: Hypothesis, refitted: Hypothesis, holdout: Sequence[FitRun], ratio: float) -> bool:
    """Whether effects, as the measured runs have them, predict held-out runs worse than the model without them.

    By more than a ratio. Values may move there, but a law that has to move to be of use is no finding. Of what the
    effects change: a channel that they have nothing to do with may be worse because other parameters of it are.
    """
    if not one.acts.any():
        return False
    after, before = (rms(h.fitted.held_out_errors(holdout)) for h in (one, refitted))
    return bool((one.acts & (after > np.maximum(ratio * before, EFFECT_SPREAD_SHARE * one.fitted.spread))).any())


def _predicting(
    one: Hypothesis, plain: Hypothesis, refitted: Hypothesis, holdout: Sequence[FitRun]
) -> Hypothesis | None:
    """A hypothesis whose effects do not mislead: the same, or beside the values that the model has without them.

    What the measured runs leave open of these may have run away beside the effects; then they fit those runs about as
    well with the others, and predict held-out runs no worse at all.
    """
    if not _misleads(one, refitted, holdout, MISLEADING_STATE_RATIO if one.values_of_runs else MISLEADING_RATIO):
        return one
    fitted = one.fitted.lent_by(plain.fitted, one.effects)
    measured = fitted.rmse**2 + one.reference_gain
    other = replace(one, fitted=fitted, measured=measured, nuisance_tests=lambda: one.tested)
    as_good = (MUCH_LESS_RATIO * measured < one.measured).all()
    return other if as_good and not _misleads(other, refitted, holdout, 1.0) else None


def _imitates(one: Hypothesis, hypotheses: Sequence[Hypothesis], refitted: Hypothesis) -> bool:
    """Whether a law that is none of the library's leaves as little as an answer with fewer parameters, or clearly less.

    In the channels that the answer changes: what is left of others differs because the model's own values moved. What
    says that the same is missing, beside another curve of friction, imitates nothing.
    """
    others = [h for h in hypotheses if h.disguised and set(h.effects) != set(one.effects)]
    return any(
        (dominated(one, h, one.acts) or leaves_less(h, one, refitted)) and len(h.effects) <= len(one.effects)
        for h in others
    )


def _without_any_laws(choice: Choice) -> Choice:
    """The choice without sums of laws of one coordinate where others leave as little: they say more."""
    supported = tuple(h for h in choice.supported if not _any_law_of_a_coordinate(h.effects))
    return replace(choice, supported=supported or choice.supported)


def _any_law_of_a_coordinate(effects: Sequence[str]) -> bool:
    """Whether two effects at one place are laws of the position, or of time: a sum of such laws is any law of it."""
    laws = [(about(spec).family, place_of(spec)[1]) for spec in effects if about(spec).family in FREE_FAMILIES]
    return len(set(laws)) < len(laws)


def _contending(found: Sequence[Hypothesis], baselines: Baselines) -> list[Hypothesis]:
    """The best of the hypotheses with effects that runs left out can make the answer, and what those have in common."""
    ranked = sorted(found[1:], key=log_residual)
    best = next((h for h in ranked if not h.disguised), None)
    if best is None:
        return ranked[:1]
    close = [h for h in ranked if not clearly_worse(h, best, baselines.refitted) or set(h.added) < set(best.added)]
    return close[:FOLDED_HYPOTHESES]
