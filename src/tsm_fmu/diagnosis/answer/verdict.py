"""The verdict that follows from the supported hypotheses and from what they leave."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ...effects import EFFECTS, about, effect_of, id_of, sizes_as
from ...regression.problem import FitRun
from ..choice.baselines import Baselines
from ..choice.floors import Floors
from ..choice.hypotheses import Hypothesis, left_out_in_turn, with_fit
from ..choice.supported import Choice, indistinguishable, log_residual
from ..criteria import EFFECT_SPREAD_SHARE, FAMILY_SHARE, IDLE_SPREAD_SHARE, MUCH_LESS_RATIO
from ..evidence import FamilyShare
from ..fits.nuisance import best_refit, with_free_offsets
from ..fits.quantised import with_levels, with_read
from ..fits.refit import Fitted
from ..fits.significance import is_play_before_friction
from .causes import made_by_the_drive
from .passivity import sign_notes


@dataclass(frozen=True)
class Verdict:
    """What is said of the model.

    Attributes
    ----------
    word : str
        ``named``, ``ambiguous``, ``unknown``, ``none``, ``parameters`` or ``not_excited``.
    refitted, final : Fitted
        The model without effects, and the answer's; both leave about as much on all samples.
    effects : tuple of str
        Named effects as ``id`` or ``id@channel``.
    equivalent : tuple of str
        Ids that these runs cannot tell apart.
    notes : tuple of str
    """

    word: str
    refitted: Fitted
    final: Fitted
    effects: tuple[str, ...] = ()
    equivalent: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def verdict_of(
    baselines: Baselines, choice: Choice, floors: Floors, evidence: Sequence[FamilyShare], tested: Sequence[str],
    unmoved: Sequence[str], nowhere: Collection[str], holdout: Sequence[FitRun], holding: Callable[[Fitted], Fitted],
    wandering: Sequence[str], curves: Sequence[Hypothesis], progress: Callable[[str], None],
) -> Verdict:  # fmt: skip
    """The verdict.

    Parameters
    ----------
    baselines : Baselines
    choice : Choice
    floors : Floors
    evidence : sequence of FamilyShare
        Of what the refitted model leaves.
    tested : sequence of str
        Ids of the effects that were refitted.
    unmoved : sequence of str
        Ids of those that the motion of these runs would not show, whatever is left of them.
    nowhere : collection of str
        Ids of those that cannot be in this model.
    holdout : sequence of FitRun
    holding : callable
        Gives a fit to more samples, where that of the search does not hold on all: see `Fitted.holding`.
    wandering : sequence of str
        Specs of the offsets of channels whose zeros wander: they are free in all fits.
    curves : sequence of Hypothesis
        Without an effect, but with other curves of friction after reversals.
    progress : callable
        Given what is being done.
    """
    refitted = holding(baselines.refitted.fitted)
    if floors.without_answer:
        unexplained = [c for c, there in zip(refitted.problem.channels, floors.unexplained, strict=True) if there]
        law = any(e.channel in unexplained and e.share > FAMILY_SHARE for e in evidence)
        testable = set(tested) - set(unmoved)
        return Verdict("unknown" if law or testable or not tested else "not_excited", refitted, refitted)
    winner, channels = choice.winner, refitted.problem.channels
    # where a channel lacks more than an answer explains, its few levels are no answer either
    levels = [one for one in baselines.levels if not floors.unexplained[channels.index(one.channel)]]
    final = holding(_final_fit(winner, holdout, progress))
    read = (*(one.spec for one in levels), *(spec for spec in wandering if spec not in winner.effects))
    if not winner.effects and not read:
        return _without_effect(baselines, winner, refitted, final)
    if levels:
        final = with_levels(final, levels)
    if wandering:
        final = with_read(final, [spec for spec in wandering if spec not in final.effects], {})
    final = final.not_kept(refitted.task.fixed)
    sets = [tuple(dict.fromkeys(id_of(spec) for spec in h.effects)) for h in choice.supported]
    common = [e for e in sets[0] if all(e in ids for ids in sets)]
    common += [e for e in map(id_of, read) if e not in common]
    alternatives = tuple(dict.fromkeys(e for ids in sets for e in ids if e not in common))
    in_doubt = _plays_in_doubt(winner, curves)
    for effect in [e for e in common if about(e).after_reversal or e in in_doubt]:
        common.remove(effect)
        others = [e for e in _other_laws_of_reversals(effect) if e not in nowhere]
        alternatives = tuple(dict.fromkeys((*alternatives, effect, *others)))
    for spec in [s for s in winner.effects if id_of(s) in common]:
        cause = made_by_the_drive(spec, refitted)
        if cause is not None and cause not in nowhere:
            common.remove(id_of(spec))
            alternatives = tuple(dict.fromkeys((*alternatives, id_of(spec), cause)))
    named = tuple(s for s in (*winner.effects, *read) if id_of(s) in common)
    notes = (*sign_notes(final), *_unexplained_notes(floors, final.problem.channels))
    return Verdict("named" if named else "ambiguous", refitted, final, named, alternatives, notes)


def _other_laws_of_reversals(effect: str) -> tuple[str, ...]:
    """What else such a law may stand for: rigs differ in what friction does after a reversal, and such laws are alike.

    One that is a nuisance parameter stands for play before it too, and play for all that this stands for.
    """
    if about(effect).play:
        curves = [m.NAME for m in EFFECTS if m.ABOUT.role == "nuisance" and effect in m.ABOUT.looks_like]
        return tuple(e for curve in curves for e in (curve, *about(curve).looks_like) if e != effect)
    alike = about(effect).looks_like
    return alike if about(effect).role == "nuisance" else tuple(e for e in alike if about(e).after_reversal)


def _plays_in_doubt(winner: Hypothesis, curves: Sequence[Hypothesis]) -> list[str]:
    """Ids of plays before a friction for which another curve of friction after reversals may stand.

    Of a law that looks like it, play must leave much less than the best, also of runs that were not fitted.
    """
    plays = [id_of(s) for s in winner.effects if is_play_before_friction(s, winner.fitted.model)]
    if not plays or len(plays) < len(winner.effects):
        return plays  # beside another effect a curve shapes its law
    best = min(curves, key=log_residual)
    left = [(winner.measured, best.measured)]
    if winner.held_out is not None and best.held_out is not None:
        left.append((winner.held_out, best.held_out))
    much_less = all((mine < MUCH_LESS_RATIO * other)[winner.acts].all() for mine, other in left)
    return [] if much_less else plays


def _without_effect(baselines: Baselines, winner: Hypothesis, refitted: Fitted, final: Fitted) -> Verdict:
    """No effect is missing: were other parameters needed?"""
    given, base = baselines.given, baselines.refitted
    needs_nuisances = not indistinguishable(base, winner, base)
    used = winner if needs_nuisances else base
    removed = np.maximum(given.rmse**2 - used.fitted.rmse**2, 0.0)
    if (removed <= (EFFECT_SPREAD_SHARE * used.fitted.spread) ** 2).all():
        return Verdict("none", refitted, given)
    return Verdict("parameters", refitted, final if needs_nuisances else refitted)


def _final_fit(winner: Hypothesis, holdout: Sequence[FitRun], progress: Callable[[str], None]) -> Fitted:
    """The winner's fit to the end, without the nuisance effects that do nothing.

    Offsets of runs that are named may be free in it if that does not cost on runs that were not fitted: there they
    could have taken what is a law.
    """
    fitted = winner.fitted
    if any(sizes_as(effect_of(spec), "per run") for spec in winner.significant):
        progress("refit with free offsets")
        loose = with_fit(winner, with_free_offsets(fitted, winner.nuisances), holdout)
        if not holdout and winner.held_out is not None:
            loose = left_out_in_turn(loose)
        if log_residual(loose) < log_residual(winner):
            fitted = loose.fitted
    progress("refit to the end")
    fitted = fitted.refined()
    used = [s for s in winner.nuisances if s in fitted.effects and s not in winner.effects]
    idle = [s for s in used if float(fitted.share_of(s).max()) < IDLE_SPREAD_SHARE]
    if not idle:
        return fitted
    progress(f"refit without {', '.join(idle)}")
    kept, released = ([e for e in every if e not in idle] for every in (fitted.effects, fitted.released))
    start = (fitted.values, fitted.per_run)
    return best_refit(fitted, kept, [start], winner.nuisances, released, scales=fitted.scales)


def _unexplained_notes(floors: Floors, channels: Sequence[str]) -> tuple[str, ...]:
    return tuple(
        f"what is left of {channel} is no noise: the law of the rig is not quite that of the answer"
        for channel, is_open in zip(channels, floors.open_ & ~floors.unexplained, strict=True) if is_open
    )  # fmt: skip
