"""Hypotheses whose values serve no reference runs: they imitate what is missing, and what comes near may be there."""

from __future__ import annotations

from collections.abc import Sequence

from ..criteria import REFERENCE_RATIO
from .hypotheses import Hypothesis
from .supported import Choice, choice_of, comes_near, indistinguishable, log_residual

RIVALS = 4
"""Of what comes near, so many are asked whether some values serve reference runs with them."""


def served_choice(hypotheses: Sequence[Hypothesis], refitted: Hypothesis) -> Choice:
    """`choice_of` without what `_stands_for_another`.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        The first has no effect but the nuisance effects.
    refitted : Hypothesis
        The refitted model without those.
    """
    refused: set[tuple[str, ...]] = set()
    while True:
        choice = choice_of(hypotheses, refitted, refused)
        more = {h.added for h in choice.supported if _stands_for_another(h, hypotheses, refitted)} - refused
        if not more:
            return choice
        refused |= more


def _stands_for_another(one: Hypothesis, others: Sequence[Hypothesis], refitted: Hypothesis) -> bool:
    """Whether no values serve reference runs too with a hypothesis, but with another one that may be in its place.

    In place of effects as many that their own runs cannot tell from them: the law of a right name is not quite that of
    the rig, and one that bends more serves more runs. Nor one with more values of each run, which stand for whatever
    differs between runs. In place of none one that comes near, unless a single value of the rig that has changed since
    the reference runs leaves about as little.
    """
    if one.serves_references:
        return False
    if one.has_effects:
        near = [
            h for h in others
            if len(h.added) == len(one.effects) and h.values_of_runs <= one.values_of_runs
            and indistinguishable(h, one, refitted, others)
        ]  # fmt: skip
    else:
        near = [h for h in others if len(h.added) == 1 and comes_near(h, one)]
    near = [h for h in sorted(near, key=log_residual) if h.added != one.added and not h.disguised][:RIVALS]
    serving = next((h for h in near if h.serves_references), None)
    if serving is None:
        return False
    return one.has_effects or not one.may_have_changed(REFERENCE_RATIO**2 * serving.measured)
