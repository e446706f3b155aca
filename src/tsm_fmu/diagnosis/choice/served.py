"""Hypotheses whose values serve no reference runs: they imitate what is missing, and what comes near may be there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..criteria import REFERENCE_RATIO
from .hypotheses import Hypothesis
from .supported import Choice, choice_of, comes_near, indistinguishable, log_residual

RIVALS = 4
"""Of what comes near, so many are asked whether some values serve reference runs with them."""


def served_choice(hypotheses: Sequence[Hypothesis], refitted: Hypothesis) -> Choice:
    """`choice_of` without what `_stands_for_another`, and in a set with what may be there as well: see `_as_good`.

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
            break
        refused |= more
    one, known = choice.winner, {h.effects for h in choice.supported}
    if not one.effects or one.serves_references:
        return choice
    beside = [h for h in _as_good(one, hypotheses, refitted) if h.serves_references and h.effects not in known]
    return replace(choice, supported=(*choice.supported, *beside))


def _stands_for_another(one: Hypothesis, others: Sequence[Hypothesis], refitted: Hypothesis) -> bool:
    """Whether no values serve reference runs too with a hypothesis, but with another one that is in its place.

    In place of effects what is `_as_good` with no more parameters. In place of none a single one that comes near,
    unless one value of the rig that has changed since the reference runs leaves about as little.
    """
    if one.serves_references:
        return False
    if one.has_effects:
        near = [h for h in _as_good(one, others, refitted) if h.parameter_count <= one.parameter_count]
        return any(h.serves_references for h in near)
    near = [h for h in others if len(h.added) == 1 and not h.disguised and comes_near(h, one)]
    near = sorted(near, key=log_residual)[:RIVALS]
    serving = next((h for h in near if h.serves_references), None)
    return serving is not None and not one.may_have_changed(REFERENCE_RATIO**2 * serving.measured)


def _as_good(one: Hypothesis, others: Sequence[Hypothesis], refitted: Hypothesis) -> list[Hypothesis]:
    """As many effects as those of a hypothesis, which its own runs do not tell from them; what leaves least first.

    Not with more values of each run, which stand for whatever differs between runs.
    """
    near = [
        h for h in others
        if len(h.added) == len(one.effects) and h.added != one.added and h.values_of_runs <= one.values_of_runs
        and not h.disguised and indistinguishable(h, one, refitted, others)
    ]  # fmt: skip
    return sorted(near, key=log_residual)[:RIVALS]
