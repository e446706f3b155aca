"""The family of what is missing, also where it has no name: over what the residual is a law."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.interpolate import make_interp_spline

from ...effects import about, place_of
from ...effects.about import Family
from ...kernels.arrays import FloatArray
from ...regression.problem import FitRun
from ..choice.hypotheses import Hypothesis
from ..choice.supported import Choice
from ..criteria import (
    CONTRADICTING_SHARE,
    FAMILY_SHARE,
    FAMILY_TIE_SHARE,
    LAW_FORM_SHARE,
    LITTLE_SPREAD_SHARE,
    MUCH_LESS_RATIO,
    REFERENCE_RATIO,
)
from ..evidence import FamilyShare
from ..fits.quantised import levels_of, step_noise
from ..fits.refit import Fitted
from ..fits.response import moves_left_open, normalised, places_of
from ..residual.families import Functions, family_shares


def family_evidence(fitted: Fitted, runs: Sequence[FitRun]) -> tuple[FamilyShare, ...]:
    """What the laws of each family predict of what a fit leaves of each channel, most first.

    Of a sensor's family also what the steps of a converter make.

    Parameters
    ----------
    fitted : Fitted
        The refitted model without any effect of the answer.
    runs : sequence of FitRun
        All samples of its runs.
    """
    whole = fitted.at(runs)
    problem, functions = whole.problem, Functions(places_of(whole))
    moves, found = _moves(fitted, problem.runs), []
    steps = step_noise(levels_of(problem.runs, problem.channels), problem.channels)
    for c, channel in enumerate(problem.channels):
        residuals = [r[:, c] for r in whole.residuals]
        outputs = [run.targets[:, c] - r for run, r in zip(problem.runs, residuals, strict=True)]
        shares = family_shares(residuals, outputs, functions, normalised(moves[:, c]))
        of_steps = min(1.0, float((steps[c] / max(whole.rmse[c], 1e-300)) ** 2))
        if of_steps > shares["sensor"]:
            del shares["sensor"]
            found.append(FamilyShare("sensor", channel, of_steps, "steps"))
        found += [FamilyShare(family, channel, share) for family, share in shares.items()]
    return tuple(sorted(found, key=lambda f: -f.share))


def contradicted(
    choice: Choice, refitted: Hypothesis, evidence: Sequence[FamilyShare],
    elsewhere: Callable[[], Sequence[FamilyShare]] = tuple,
) -> bool:  # fmt: skip
    """Whether laws of another kind than those of an answer predict most of what the model lacks.

    Either they leave little where those of the answer leave most, or the few of a sensor (its size, its rate, a delay
    that grows) leave much less than the many of the answer's families. Looked at is, of the channels that its effects
    change, that of which it removes most. What leaves no more there than a right name may, or than the model does on
    reference runs, or half of what those other laws leave, is not contradicted: what the functions predict is without
    the moves of the model's parameters, which a refit has, and with the form of the model. Nor are, as a rule, effects
    that are not among the functions of their family (bursts, steps of a converter): no others predict most of them.
    Where other motions show much of what the answer is a law of, measured runs that show little of it, beside the form
    of the model, do not speak against it.

    Parameters
    ----------
    choice : Choice
        All that it cannot tell apart is the answer.
    refitted : Hypothesis
        The model without effects.
    evidence : sequence of FamilyShare
        Of `family_evidence`.
    elsewhere : callable
        Gives the same of runs that were not fitted; only called when it is asked for.
    """
    families = {family for h in choice.supported for spec in h.effects for family in _families_at_its_place(spec)}
    if not choice.winner.acts.any():
        return False
    removed = np.where(choice.winner.acts, refitted.measured / np.maximum(choice.winner.measured, 1e-300), 0.0)
    c = int(np.argmax(removed))
    fitted, left = choice.winner.fitted, [choice.winner.measured, choice.winner.held_out]
    on_reference = (REFERENCE_RATIO * fitted.task.discrepancy) ** 2
    as_good = np.all([x <= on_reference for x in left if x is not None], axis=0)
    if removed[c] - 1.0 > 1.0 / LAW_FORM_SHARE or as_good[c]:
        return False
    channel, part_left = fitted.problem.channels[c], 1.0 / removed[c]

    def own_and_against(shares: Mapping[str, float]) -> tuple[float, bool]:
        own, most = max(shares.get(f, 0.0) for f in families), max(shares.values(), default=0.0)
        of_sensor = shares.get("sensor", 0.0)
        bends = most > CONTRADICTING_SHARE and own < 0.5 * most
        simpler = of_sensor > CONTRADICTING_SHARE and 1.0 - of_sensor < MUCH_LESS_RATIO * (1.0 - own)
        return own, (bends or simpler) and part_left > MUCH_LESS_RATIO * (1.0 - most)

    if not own_and_against({e.family: e.share for e in evidence if e.channel == channel})[1]:
        return False
    own, against = own_and_against({e.family: e.share for e in elsewhere() if e.channel == channel})
    return against or own < CONTRADICTING_SHARE


def _families_at_its_place(spec: str) -> set[Family]:
    """That of an effect, and the load's where it takes a load at its place beside what its family is named for."""
    known = about(spec)
    return {known.family, "load"} if "load" in known.at_outputs and place_of(spec)[1] else {known.family}


def _moves(fitted: Fitted, runs: Sequence[FitRun]) -> FloatArray:
    """What the parameters do at the samples of runs, shape (samples, channels, parameters).

    They are moved on the samples of the fit, which may be fewer: between these it is what lies on a line.
    """
    problem = fitted.problem
    channels = len(problem.channels)
    moves = moves_left_open(fitted, np.ones(channels))
    moves = moves.reshape(moves.shape[0] // channels, channels, moves.shape[1])  # no column where all is fixed
    parts = np.split(moves, np.cumsum([few.time.size for few in problem.runs])[:-1])
    return np.concatenate([
        make_interp_spline(few.time, part, k=1)(np.clip(run.time, few.time[0], few.time[-1])) if part.size
        else np.empty((run.time.size, *part.shape[1:]))
        for few, run, part in zip(problem.runs, runs, parts, strict=True)
    ])  # fmt: skip


def families_of(
    effects: Sequence[str], equivalent: Sequence[str], evidence: Sequence[FamilyShare], channel: str,
    closest: Sequence[str] = (),
) -> tuple[Family, ...]:  # fmt: skip
    """Families of what the model lacks, most telling first; empty where nothing can be said.

    Of named effects and of those that cannot be told apart it is what their files say, of a set also the families whose
    laws leave much less than those of the set's: what it lacks may be there. Of what has no name it is the family
    whose laws predict most of the residual, those whose laws predict nearly as much, and those of the effects that come
    closest, refitted with the model: what follows a parameter of the model the residual alone may not show.

    Parameters
    ----------
    effects, equivalent : sequence of str
        Named effects, and those of a set that these runs cannot tell apart.
    evidence : sequence of FamilyShare
        Most first.
    channel : str
        The one that the answer is about.
    closest : sequence of str
        Effects that close much of an unknown gap.
    """
    shown = [e for e in evidence if e.channel == channel and e.share > FAMILY_SHARE]
    if effects or equivalent:
        said: list[Family] = [about(spec).family for spec in (*effects, *equivalent)]
        if equivalent:
            most = max((e.share for e in shown if e.family in said), default=0.0)
            said.extend(e.family for e in shown if 1.0 - e.share < MUCH_LESS_RATIO * (1.0 - most))
        return tuple(dict.fromkeys(said))
    of_residual: list[Family] = [e.family for e in shown if e.share >= FAMILY_TIE_SHARE * shown[0].share]
    return tuple(dict.fromkeys((*of_residual, *(about(spec).family for spec in closest))))


def not_little(evidence: Sequence[FamilyShare], fitted: Fitted) -> tuple[FamilyShare, ...]:
    """Evidence of laws that are more than next to nothing of a channel, where a fit lacks no effect.

    Parameters
    ----------
    evidence : sequence of FamilyShare
        Of that fit.
    fitted : Fitted
    """
    size = dict(zip(fitted.problem.channels, (fitted.rmse / fitted.spread) ** 2, strict=True))
    return tuple(e for e in evidence if e.share * size[e.channel] > LITTLE_SPREAD_SHARE**2)
