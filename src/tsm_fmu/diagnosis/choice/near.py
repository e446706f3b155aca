"""Effects that come near an answer: they may be there instead, though these runs tell them from it.

No law of a rig is quite that of the library, so which of two laws leaves less says little where it is not much less.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...effects import id_of, looks_like
from ..criteria import CLEAN_EFFECT_SPREAD_SHARE, MUCH_LESS_RATIO, REFERENCE_RATIO, RIVAL_RATIO
from ..fits.refit import Fitted
from .floors import least_floor
from .hypotheses import Hypothesis
from .supported import Choice, comes_near, log_gain, log_residual


def rivals(choice: Choice, hypotheses: Sequence[Hypothesis], reference_fit: Fitted | None) -> list[Hypothesis]:
    """Hypotheses with as many effects and no more parameters that come near an answer; the nearest first.

    Each leaves less than `RIVAL_RATIO` times as much and closes half of what the answer closes beside the nuisance
    parameters, on measured and on held-out runs: where most is noise, all leave about as much. An answer that leaves
    no more than the floor has the law of the rig, and no rivals.

    Parameters
    ----------
    choice : Choice
    hypotheses : sequence of Hypothesis
        The first has no effect but the nuisance parameters.
    reference_fit : Fitted or None
        Of the model on reference runs.
    """
    one, plain, found = choice.winner, hypotheses[0], list[Hypothesis]()
    above_floor = one.measured > (REFERENCE_RATIO * least_floor(one, reference_fit)) ** 2
    if not one.missing or not (one.acts & above_floor).any():
        return found
    known = [_ids(h) for h in choice.supported]
    for h in sorted(hypotheses, key=lambda h: log_gain(h, one)):
        if log_gain(h, one) >= np.log(RIVAL_RATIO):
            break
        alike = len(h.missing) == len(one.missing) and h.parameter_count <= one.parameter_count
        if not alike or h.disguised or not _closes_half(h, one, plain):
            continue
        if len(h.effects) == len(one.effects) and _ids(h) not in known:
            known.append(_ids(h))
            found.append(h)
    return found


def hidden_near(choice: Choice, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Single effects that hide behind one that is far ahead, and do not leave twice as much.

    Its law is not quite that of the rig: which of them is nearer to that does not tell which is there.
    """
    one, known = choice.winner, {h.effects for h in choice.supported}
    return [
        h for h in sorted(hypotheses, key=log_residual)
        if len(h.added) == len(h.effects) == 1 and h.effects not in known and not h.disguised
        and looks_like(h.added[0], one.effects) and comes_near(h, one)
    ]  # fmt: skip


def _ids(one: Hypothesis) -> set[str]:
    return set(map(id_of, one.effects))


def _closes_half(other: Hypothesis, one: Hypothesis, plain: Hypothesis) -> bool:
    """Whether a hypothesis closes half of what another one does, in each channel that this changes."""
    pairs = [(other.measured, one.measured, plain.measured)]
    if other.held_out is not None and one.held_out is not None and plain.held_out is not None:
        pairs.append((other.held_out, one.held_out, plain.held_out))
    least = (CLEAN_EFFECT_SPREAD_SHARE * one.fitted.spread) ** 2
    for theirs, mine, before in pairs:
        closed = one.acts & (before - mine > least)
        if (closed & (before - theirs < MUCH_LESS_RATIO * (before - mine))).any():
            return False
    return True
