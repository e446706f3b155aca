"""Patches: what is named although something is left all the same.

A right name whose law is not quite the rig's leaves part of its effect, and further effects then gain by patching it
up. So where something is left that is no noise, the effect that removes most counts if it removes half of that, and a
further one if it removes more than that. An answer that needs more effects than are believed together is none, though
some of them only correct the form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...kernels.arrays import BoolArray, FloatArray
from ...regression.problem import FitRun
from ..criteria import EFFECT_SPREAD_SHARE, FURTHER_RATIO, OPEN_GAP_EFFECTS, STRONGEST_RATIO
from ..fits.nuisance import refit_without
from .hypotheses import Hypothesis, hypothesis
from .supported import Choice, log_residual


def without_patches(
    choice: Choice, hypotheses: Sequence[Hypothesis], open_: BoolArray, holdout: Sequence[FitRun]
) -> Choice | None:
    """The choice without such effects; None if no effect is more, or more of them are than are believed together.

    Parameters
    ----------
    choice : Choice
    hypotheses : sequence of Hypothesis
        Where to find those with fewer effects.
    open_ : ndarray of bool, shape (channels,)
        Channels in which the choice leaves something.
    holdout : sequence of FitRun
    """
    found: list[Hypothesis] = []
    for one in choice.supported:
        ratio = {spec: _removed_ratio(one, spec, hypotheses, open_) for spec in one.effects}
        strongest = max(ratio, key=lambda spec: ratio[spec])
        least = dict.fromkeys(one.effects, FURTHER_RATIO) | {strongest: STRONGEST_RATIO}
        kept = [spec for spec in one.effects if ratio[spec] >= least[spec]]
        fewer = one if len(kept) == len(one.effects) else restricted_to(one, kept, hypotheses, holdout)
        if fewer.effects and all(set(fewer.effects) != set(other.effects) for other in found):
            found.append(fewer)
    fewest = min((len(h.effects) for h in found), default=0)
    with_fewest = tuple(h for h in found if len(h.effects) == fewest)
    if not fewest or any(len({*h.added, *h.effects}) > OPEN_GAP_EFFECTS for h in with_fewest):
        return None
    return Choice(choice.best, with_fewest)


def _removed_ratio(one: Hypothesis, spec: str, hypotheses: Sequence[Hypothesis], open_: BoolArray) -> float:
    """Most that an effect removes over what is left, of any channel; without end where only noise is left."""
    if spec in one.significant:
        removed = (one.significant[spec] * one.fitted.spread) ** 2
    else:
        removed = _mean_square_without(one, spec, hypotheses) - one.measured
    acts = removed > (EFFECT_SPREAD_SHARE * one.fitted.spread) ** 2
    return float(np.max(np.where(open_, removed / one.measured, np.inf)[acts], initial=0.0))


def _mean_square_without(one: Hypothesis, spec: str, hypotheses: Sequence[Hypothesis]) -> FloatArray:
    """Mean square left with one effect less."""
    others = set(one.added) - {spec}
    known = [h.measured for h in hypotheses if h.adds(others, one)]
    return known[0] if known else refit_without(one.fitted, spec, one.nuisances).rmse ** 2 + one.reference_gain


def restricted_to(
    one: Hypothesis, kept: Sequence[str], hypotheses: Sequence[Hypothesis], holdout: Sequence[FitRun]
) -> Hypothesis:
    """The hypothesis with some of the effects; the other nuisance effects count as the form of the model."""
    kept = (*kept, *(spec for spec in one.form_corrections if spec in one.added))
    added = tuple(spec for spec in one.added if spec in kept)
    form = tuple(dict.fromkeys((*one.form_corrections, *(spec for spec in one.nuisances if spec not in kept))))
    known = sorted((h for h in hypotheses if h.adds(added, one)), key=log_residual)
    if known:
        return replace(known[0], form_corrections=form, nuisance_tests=lambda: known[0].tested)
    fitted = one.fitted
    for spec in one.added:
        fitted = fitted if spec in kept else refit_without(fitted, spec, one.nuisances)
    return replace(hypothesis(added, fitted, one.nuisances, holdout, one.reference_gain), form_corrections=form)
