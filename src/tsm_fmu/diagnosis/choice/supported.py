"""Which hypothesis the runs support: the fewest effects that leave no more than the best fit does.

What a hypothesis leaves is compared with what the best one leaves, on measured and on held-out runs and in every
channel. A difference counts only beyond

* noise: what autocorrelated noise makes of the mean square of as many independent samples,
* form: the true law is never quite that of the library, and a right name leaves part of its effect (`LAW_FORM_SHARE`).

Of what is not told apart by that, the fewest effects win; several with as few are a set, but for those that need more
parameters to leave as much.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects import effect_of, looks_like, starts_of
from ...kernels.arrays import BoolArray, FloatArray
from ...regression.problem import FitRun
from ...regression.threads import together
from ..criteria import (
    CLEAN_EFFECT_SPREAD_SHARE,
    CONVERGED_SHARE,
    DIFFERENCE_DEVIANCE,
    EFFECT_SPREAD_SHARE,
    FIT_SPREAD_SHARE,
    FURTHER_EFFECT_SPREAD_SHARE,
    LAW_FORM_SHARE,
    MUCH_LESS_RATIO,
    NOTABLE_RATIO,
    PARAMETER_RATIO,
    REFERENCE_RATIO,
)
from ..fits.nuisance import refit_without
from ..fits.refit import above_floor
from ..fits.significance import nearly_removed
from .hypotheses import Hypothesis, find_significant_nuisances, with_fit


@dataclass(frozen=True)
class Choice:
    """What is supported.

    Attributes
    ----------
    best : Hypothesis
        That leaves least.
    supported : tuple of Hypothesis
        With the fewest effects, of those not best_without apart from the best; what leaves least first.
    """

    best: Hypothesis
    supported: tuple[Hypothesis, ...]

    @property
    def winner(self) -> Hypothesis:
        return self.supported[0]


def choice_of(
    hypotheses: Sequence[Hypothesis], refitted: Hypothesis, refused: Collection[tuple[str, ...]] = ()
) -> Choice:
    """The supported hypotheses.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        The first has no effect but the nuisance effects. Those whose effects have lost their signature are no
        candidates, nor those that predict held-out runs worse than without one of their effects.
    refitted : Hypothesis
        The refitted model without those nuisance effects: what is removed is counted from it.
    refused : collection of tuple of str
        What hypotheses add that come near the best and are no answer all the same.
    """
    plain = hypotheses[0]
    hypotheses = [h for h in hypotheses if not h.disguised]
    hypotheses = [h for h in hypotheses if not any(_predicts_worse(h, less) for less in hypotheses)]
    hypotheses = [h for h in hypotheses if not _adds_nothing(h, plain)]
    best = min(hypotheses, key=log_residual)
    best_without = without_corrections(best, hypotheses)
    near = [h for h in hypotheses if not clearly_worse(h, best_without, refitted)]
    find_significant_nuisances(near)
    near = [_with_laws_corrected(h, plain) for h in near if h.added not in refused]
    alike = [h for h in near if indistinguishable(h, best_without, refitted, hypotheses)]
    alike = [h for h in alike if not any(_more_laws(h, other) for other in alike)]
    fewest = min(len(h.effects) for h in alike)
    alike = [h for h in alike if len(h.effects) == fewest]
    if fewest:  # what more effects do than these is no allowance among them
        least = min(alike, key=log_residual)
        alike = [h for h in alike if indistinguishable(h, least, refitted, hypotheses)]
    # what corrects the form in vain is left out: of those that say the same the one without comes first
    supported = tuple(
        sorted(alike, key=lambda h: (sum(spec in h.form_corrections for spec in h.added), log_residual(h)))
    )

    def is_dominated(one: Hypothesis) -> bool:  # also by one that lacks a correction of the form
        return any(dominated(one, other) and len(other.effects) <= fewest for other in hypotheses)

    supported = tuple(h for h in supported if not is_dominated(h)) or supported
    # one that takes the place of the best by its few parameters must itself be told from none
    possible = not plain.effects and plain.added not in refused
    if fewest and possible and all(indistinguishable(plain, h, refitted) for h in supported):
        supported = (plain,)
    return Choice(best, supported)


def _more_laws(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether a hypothesis takes more laws, of those that correct the form too, to leave no less with more parameters.

    It says less only because one of them counts as form: what needs fewer laws may count none as that.
    """
    return len(other.added) < len(one.added) and dominated(one, other)


def _predicts_worse(one: Hypothesis, less: Hypothesis) -> bool:
    """Whether a hypothesis leaves clearly more of held-out runs than without some of its effects: these are none.

    Of channels that these effects change: in others it may because values that a fit moved on do not carry over.
    """
    fewer = set(less.added) < set(one.added) and less.nuisances == one.nuisances
    if one.held_out is None or less.held_out is None or not fewer:
        return False
    limit = CLEAN_EFFECT_SPREAD_SHARE**2 * one.fitted.spread**2
    noise = DIFFERENCE_DEVIANCE * less.held_out / less.effective_held_out
    worse = one.held_out - less.held_out > limit + noise
    surplus = [spec for spec in one.added if spec not in less.added]
    return bool(worse.any()) and bool((worse & np.any([one.changed_by(spec) for spec in surplus], axis=0)).any())


def _adds_nothing(one: Hypothesis, plain: Hypothesis) -> bool:
    """Whether effects remove less than any must beside nuisance effects that are missing: these say it all then.

    Parameters
    ----------
    one : Hypothesis
    plain : Hypothesis
        The nuisance effects alone.
    """
    gained = [plain.measured - one.measured]
    if one.held_out is not None and plain.held_out is not None:
        gained.append(plain.held_out - one.held_out)
    least = (CLEAN_EFFECT_SPREAD_SHARE * one.fitted.spread) ** 2
    if not one.added or any((gain > least).any() for gain in gained):
        return False
    missing = plain.significant  # takes refits
    return bool(missing) and all(spec in one.nuisances and one.changed_by(spec).any() for spec in missing)


def _with_laws_corrected(one: Hypothesis, plain: Hypothesis) -> Hypothesis:
    """A copy in which nuisance effects that remove something beside its effects alone correct the form of their laws.

    A channel that comes late does so whatever else is there. Unless next to nothing is left with one.

    Parameters
    ----------
    one : Hypothesis
    plain : Hypothesis
        The nuisance effects alone.
    """
    if not one.missing:
        return one
    left = one.fitted.rmse**2
    corrects = [
        spec for spec in one.significant
        if spec not in plain.tested and not nearly_removed(one.tested[spec][1].rmse ** 2, left).any()
    ]  # fmt: skip
    return replace(one, form_corrections=(*one.form_corrections, *corrects)) if corrects else one


def without_corrections(best: Hypothesis, hypotheses: Sequence[Hypothesis]) -> Hypothesis:
    """The best hypothesis without what hides behind its other effects: that corrects the form of their laws.

    Unless next to nothing is left with it, which no such correction does, or it acts on other channels than they do.
    """
    whole = set(best.effects)

    def hides(spec: str, others: set[str]) -> bool:
        beside = [s for s in others if (best.changed_by(s) & best.changed_by(spec)).any()]
        return looks_like(spec, beside)

    def corrected(one: Hypothesis) -> bool:
        if not set(one.added) <= whole | set(best.added) or _nearly_explained(one, best).any():  # known without a refit
            return False
        mine = set(one.effects)
        return mine < whole and all(hides(s, mine) for s in whole - mine)

    return min((h for h in hypotheses if corrected(h)), key=log_residual, default=best)


def dominated(one: Hypothesis, other: Hypothesis, where: BoolArray | None = None) -> bool:
    """Whether another hypothesis leaves no more with fewer parameters, but for what noise and rounding make of it.

    In all channels, or those given.

    Of two effects that hide behind each other the number of parameters does not tell which is there, unless the other
    leaves much less, but for one that needs a value for each run and leaves no less on measured and on held-out runs:
    what is constant in a run and differs between them it could always make.
    """
    surplus = one.parameter_count - other.parameter_count
    if surplus <= 0:
        return False
    pairs = [(one.measured, other.measured, one.effective)]
    if one.held_out is not None and other.held_out is not None:
        pairs.append((one.held_out, other.held_out, one.effective_held_out))
    if where is not None:
        pairs = [(mine[where], theirs[where], effective[where]) for mine, theirs, effective in pairs]
    bent = 0.5 * PARAMETER_RATIO * surplus  # sure to be no more than the law bending to the form of the model
    margins = [CONVERGED_SHARE + DIFFERENCE_DEVIANCE / effective + bent for *_, effective in pairs]
    if not all((theirs <= mine * (1.0 + m)).all() for (mine, theirs, _), m in zip(pairs, margins, strict=True)):
        return False
    if all((theirs < MUCH_LESS_RATIO * mine).any() for mine, theirs, _ in pairs):
        return True  # what hides behind what need not be known: that may take refits
    leaves_less = all((mine * (1.0 + CONVERGED_SHARE) < theirs).any() for mine, theirs, _ in pairs)
    if one.values_of_runs > other.values_of_runs and not leaves_less and not other.is_driven_within_runs:
        return True
    return not any(looks_like(spec, other.effects) for spec in one.effects)


def leaves_less(one: Hypothesis, than: Hypothesis, refitted: Hypothesis) -> bool:
    """Whether a hypothesis leaves clearly less than another of a channel that this changes, measured and held out.

    More than its parameters, the form of a right law and noise make of it. Without held-out runs nothing is clear.
    """
    if one.held_out is None or than.held_out is None or refitted.held_out is None:
        return False
    parameters = PARAMETER_RATIO * max(one.parameter_count - than.parameter_count, 0)
    clearly = np.ones(one.measured.size, bool)
    for less, more, before, effective in (
        (one.measured, than.measured, refitted.measured, than.effective),
        (one.held_out, than.held_out, refitted.held_out, than.effective_held_out),
    ):
        form = LAW_FORM_SHARE * np.maximum(before - less, 0.0)
        clearly &= more > less * (1.0 + parameters + DIFFERENCE_DEVIANCE / effective) + form
    return bool(clearly[than.acts].any())


def leading(hypotheses: Sequence[Hypothesis]) -> Hypothesis:
    """The one that leaves least, of those that no other leaves as little with fewer parameters: one to build on."""
    hypotheses = [h for h in hypotheses if not h.disguised] or hypotheses
    best = min(hypotheses, key=log_residual)
    simpler = [h for h in hypotheses if dominated(best, h) and len(h.effects) <= len(best.effects)]
    return min(simpler, key=log_residual, default=best)


def with_fewer(
    best: Hypothesis, hypotheses: Sequence[Hypothesis], refitted: Hypothesis, holdout: Sequence[FitRun]
) -> list[Hypothesis]:
    """The same, and the best one without each of its effects, from its values, where that leaves as little.

    One more effect can lead the others out of a valley in which they had ended without it, or were not looked at
    without it: it is not missing for that. Of those that are known a lower fit, on held-out runs too, is kept, as
    little or not: what the valley was worth is no work of the effect.
    """
    found = {frozenset(h.added): h for h in hypotheses}

    def without(more: Hypothesis, spec: str) -> Hypothesis | None:
        added = tuple(s for s in more.added if s != spec)
        known = found.get(frozenset(added))
        fitted = refit_without(more.fitted, spec, more.nuisances, kept=more.nuisances)
        if known is None:
            kept = tuple(s for s in more.form_corrections if s != spec)
            known = replace(more, added=added, form_corrections=kept, nuisance_tests=None)
        elif fitted.cost >= (1.0 - CONVERGED_SHARE) * known.fitted.cost:
            return None
        less = with_fit(known, fitted, holdout)
        return less if frozenset(added) not in found or log_residual(less) < log_residual(known) else None

    wanted = [(best, spec) for spec in best.added]
    while wanted:
        wanted = [(h, spec) for h, spec in wanted if spec not in h.nuisances or spec in h.fitted.released]
        lower = together(lambda one: without(*one), wanted)
        fewer = sorted((h for h in lower if h is not None), key=log_residual, reverse=True)  # the lowest comes last
        as_good = {frozenset(h.added): h for h in fewer if indistinguishable(h, best, refitted)}
        found |= {frozenset(h.added): h for h in fewer if frozenset(h.added) in found} | as_good
        wanted = [(h, spec) for h in as_good.values() for spec in h.added]
    return list(found.values())


def log_residual(one: Hypothesis) -> float:
    """What a hypothesis leaves as one number: log of its mean squares over the spread."""
    parts = [one.measured] if one.held_out is None else [one.measured, one.held_out]
    spread = one.fitted.spread**2
    return float(np.mean([np.sum(np.log(p / spread + FIT_SPREAD_SHARE**2)) for p in parts]))


def comes_near(one: Hypothesis, best: Hypothesis) -> bool:
    """Whether a hypothesis leaves less than twice what another one does."""
    return log_residual(one) < log_residual(best) - np.log(MUCH_LESS_RATIO)


def log_gain(before: Hypothesis, after: Hypothesis) -> float:
    """By how much less a hypothesis leaves than one before, as `log_residual`.

    On the measured runs alone where one of the two was not judged on others.
    """
    if before.held_out is None or after.held_out is None:
        before, after = replace(before, held_out=None), replace(after, held_out=None)
    return log_residual(before) - log_residual(after)


def indistinguishable(
    one: Hypothesis, best: Hypothesis, refitted: Hypothesis, others: Sequence[Hypothesis] = ()
) -> bool:
    """Whether these runs cannot tell a hypothesis from the best one.

    Parameters
    ----------
    one, best : Hypothesis
    refitted : Hypothesis
        The refitted model without nuisance effects.
    others : sequence of Hypothesis
        Where to find one with what both have in common: the allowance for form is for what they differ in.
    """
    fewer = not one.effects or len(one.effects) < len(best.effects)  # the surplus must matter
    baseline = refitted.measured, refitted.held_out  # what the laws of the fewer lack the surplus may make
    return _within_allowance(
        one, best, *(baseline if fewer else _residual_with_common(one, best, refitted, others)), fewer
    )


def clearly_worse(one: Hypothesis, best: Hypothesis, refitted: Hypothesis) -> bool:
    """Whether a hypothesis leaves more than `indistinguishable` allows, whatever its nuisance effects would be.

    That asks for no refit: what nuisance effects remove need be known of the others only.
    """
    baseline = refitted.measured, refitted.held_out
    return not any(_within_allowance(one, best, *baseline, fewer=fewer) for fewer in (True, False))


def _within_allowance(
    one: Hypothesis, best: Hypothesis, baseline: FloatArray, baseline_held_out: FloatArray | None, fewer: bool
) -> bool:
    """Whether a hypothesis leaves no more than the best one, but for noise and form.

    Parameters
    ----------
    one, best : Hypothesis
    baseline, baseline_held_out : ndarray, shape (channels,)
        What is left, measured and held out, with what both have in common; None without held-out runs.
    fewer : bool
        It has fewer effects: the surplus of the best must matter.
    """
    spread = best.fitted.spread**2
    nearly_explained = _nearly_explained(one, best)
    task, surplus = best.fitted.task, best.parameter_count - one.parameter_count
    parameters = 0.0 if fewer else PARAMETER_RATIO * max(surplus, 0)
    form = np.where(nearly_explained, 0.0, LAW_FORM_SHARE)
    pairs = [(one.measured, best.measured, baseline, best.effective)]
    if one.held_out is not None and best.held_out is not None and baseline_held_out is not None:
        pairs.append((one.held_out, best.held_out, baseline_held_out, best.effective_held_out))
    # other motions than theirs may show less of the form of the model: what halves that on all runs, with motions of
    # their own among them, is no form of it
    others = len(pairs) > 1 and not best.folded
    much_less = np.all([least < MUCH_LESS_RATIO * mine for mine, least, *_ in pairs], axis=0) & others
    limit = FIT_SPREAD_SHARE**2 * spread
    if fewer:
        share = least_of_further(one)
        # what is halved without an effect of this one is not what the law of that lacks
        if much_less.any() and not set(one.missing or one.effects) <= set(best.effects):
            share = np.where(much_less, CLEAN_EFFECT_SPREAD_SHARE, share)
        # a converter that truncates makes more than one that rounds, and some of that follows the motion
        limit = np.maximum(share**2 * spread, (REFERENCE_RATIO * task.steps) ** 2)
    worse, better, gains, margins = [], [], [], []
    for mine, least, before, effective in pairs:
        removed = np.maximum(before - np.minimum(mine, least), 0.0)
        of_form = form * removed
        allowed = np.maximum(limit, of_form) if fewer else limit + of_form  # both are the form of a law with fewer
        margin = allowed + DIFFERENCE_DEVIANCE * np.minimum(mine, least) / effective
        beyond = mine - least > margin + parameters * least
        # of two that leave no more than the model does on reference runs neither is the better one, and what leaves
        # little more than that has nothing to explain
        ratio = REFERENCE_RATIO * bool(task.reference_removal) if fewer else 1.0
        worse.append(beyond & (much_less | (above_floor(mine, task.steps, ratio * task.discrepancy) > 0.0)))
        better.append((least - mine > margin) & (not fewer))
        margins.append(margin)
        gains.append(np.log(np.maximum(mine, 1e-300) / np.maximum(least, 1e-300)))
    counts = np.any(worse, axis=0)
    if fewer and others:  # what the law of another effect there lacks differs between motions: a law carries over
        # unless it may lack more there than the surplus does on the measured runs, which then shows in what it halves
        counts &= ~one.changed | np.all(worse, axis=0) | (much_less & (margins[-1] > one.measured - best.measured))
    if (counts != np.all(worse, axis=0)).any() and _more_values_of_runs(one, best):
        # a value for each run can stand for whatever differs between runs, and of what hides it for more
        counts = np.all(worse, axis=0) | (worse[-1] & nearly_removed(pairs[-1][0], pairs[-1][1]) & (len(pairs) > 1))
    # measured and held-out runs that say the opposite tell nothing apart, nor do channels of two that leave as much
    counts &= ~np.any(better, axis=0)
    counts &= not (np.any(better) and comes_near(one, best))
    if fewer:  # of what is left with it, a surplus effect must explain a notable part: less may mend the model's form
        counts &= np.mean(gains, axis=0) > np.log1p(NOTABLE_RATIO)
        gained = one.measured - best.measured
        shown = gained > limit  # on the runs that it was fitted to
        if others:  # whose motion may show little of what is nearly all of a gap of others
            notable = gained > (NOTABLE_RATIO + DIFFERENCE_DEVIANCE / best.effective) * best.measured
            mine, least, *_ = pairs[-1]
            shown |= notable & nearly_removed(mine, least) & (mine - least > EFFECT_SPREAD_SHARE**2 * spread)
        counts &= shown
    return not counts.any()


def _more_values_of_runs(one: Hypothesis, best: Hypothesis) -> bool:
    """Whether the best has more values of each run than another one, or any where what has them hides what that has."""
    if not best.values_of_runs:
        return False
    own, other = ([e for e in h.effects if e not in than.effects] for h, than in ((best, one), (one, best)))
    alike = len(own) == len(other) and any(looks_like(e, other) and starts_of(effect_of(e)) for e in own)
    return best.values_of_runs > (0 if alike else one.values_of_runs)


def least_of_further(one: Hypothesis) -> FloatArray:
    """Part of each channel's spread that one effect more must remove: more where an effect acts already."""
    removed = one.fitted.task.gap**2 - one.measured
    acts = (removed > (CLEAN_EFFECT_SPREAD_SHARE * one.fitted.spread) ** 2) & one.has_effects
    if one.missing:  # else it is a nuisance effect, which may act in any channel
        acts &= one.changed
    return np.where(acts, FURTHER_EFFECT_SPREAD_SHARE, CLEAN_EFFECT_SPREAD_SHARE)


def _nearly_explained(one: Hypothesis, best: Hypothesis) -> BoolArray:
    """Channels in which the best leaves next to nothing of what another one leaves."""
    nearly_explained = nearly_removed(one.measured, best.measured)
    if one.held_out is not None and best.held_out is not None:
        nearly_explained &= nearly_removed(one.held_out, best.held_out)
    return nearly_explained


def _residual_with_common(
    one: Hypothesis, best: Hypothesis, refitted: Hypothesis, others: Sequence[Hypothesis]
) -> tuple[FloatArray, FloatArray | None]:
    """What is left with the effects alone that both hypotheses have, measured and held out."""
    common = set(one.effects) & set(best.effects)
    if not common:
        return refitted.measured, refitted.held_out
    for other in others:
        if set(other.added) == common & set(other.added) and common <= set(other.effects):
            spread = other.fitted.spread**2
            surplus = sum(x**2 for spec, x in other.significant.items() if spec not in common) * spread
            return other.measured + surplus, None if other.held_out is None else other.held_out + surplus
    return refitted.measured, refitted.held_out
