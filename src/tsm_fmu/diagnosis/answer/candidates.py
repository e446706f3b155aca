"""Candidates as a user sees them: one row for each effect that was refitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...effects import id_of, prefix_of
from ...kernels.arrays import FloatArray
from ...regression.problem import FitRun
from ..choice.floors import Floors
from ..choice.hypotheses import Hypothesis
from ..choice.supported import Choice, log_gain
from ..evidence import AnswerStep, Candidate, ChannelError, Gap
from ..fits.refit import Fitted
from .gaps import closure

DECIBEL = 10.0 / np.log(10.0)

Row = tuple[str, Hypothesis]
"""An effect, as ``id`` or ``id@channel``, and a hypothesis that holds it."""
Start = Mapping[str, tuple[float, float | None]]
"""RMS of each channel on all samples, measured and held out; zeros that wander are free in it, as in the search."""


def rows_of(hypotheses: Sequence[Hypothesis], choice: Choice, floors: Floors) -> list[Row]:
    """Effects of the answer in the answer's fit, then each other effect alone; best first.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        The first has no effect but the nuisance parameters.
    choice : Choice
    floors : Floors
        Where something is left that takes away the names there is no answer.
    """
    start, found = hypotheses[0], {}
    rows = [] if floors.without_answer else [(spec, choice.winner) for spec in choice.winner.effects]
    rows += [(spec, start) for spec in start.significant]
    singles = [h for h in hypotheses if len(h.added) == 1]
    rows += [(h.added[0], h) for h in sorted(singles, key=lambda h: -log_gain(start, h))]
    for spec, one in rows:
        found.setdefault(spec, one)
    return list(found.items())


def candidates_of(
    rows: Sequence[Row], answered: Sequence[str], gap: Mapping[str, Gap], start: Start, refitted: Hypothesis,
    with_nuisances: Hypothesis, runs: Sequence[FitRun], hidden: Sequence[str], *, unknown: bool,
) -> tuple[Candidate, ...]:  # fmt: skip
    """Candidates, best first.

    Parameters
    ----------
    rows : sequence of (str, Hypothesis)
        Of `rows_of`.
    answered : sequence of str
        Named effects, and those of a set: their numbers are those of the answer's model.
    gap : mapping of str to Gap
    start : Start
        What the model without effects leaves in the search.
    refitted, with_nuisances : Hypothesis
        The model without effects; from it closures are counted, from the second the score.
    runs : sequence of FitRun
        All samples of the measured runs.
    hidden : sequence of str
        Ids that these runs could not show.
    unknown : bool
        Whether something is left that no effect explains: then only sure noise is floor.
    """
    floor = np.array([g.floor_least if unknown else g.floor for g in gap.values()])
    least = np.array([g.floor_least for g in gap.values()])
    searched = refitted.fitted.at(runs).rmse
    found = []
    for spec, one in rows:
        of_answer, alone = spec in answered, spec in one.added
        score = DECIBEL * log_gain(with_nuisances if alone else refitted, one)
        base = np.array([g.refitted for g in gap.values()]) if of_answer else searched
        shared = 0.0 if of_answer else one.reference_gain  # what it closes on reference runs too is not the gap
        if of_answer:
            measured = np.array([g.after for g in gap.values()])
        elif alone:
            measured = one.fitted.at(runs).rmse
        else:
            measured, score = _with_nuisance_alone(spec, one, base, runs), _nuisance_score(spec, one)
        squares = [(base**2, measured**2 + shared)]
        if of_answer and all(g.holdout_after is not None for g in gap.values()):
            pairs = [(g.holdout_refitted or 0.0, g.holdout_after or 0.0) for g in gap.values()]
            squares.append((np.array([b for b, _ in pairs]) ** 2, np.array([a for _, a in pairs]) ** 2))
        elif (of_answer or alone) and one.held_out is not None and refitted.held_out is not None:
            squares.append((refitted.held_out, one.held_out))
        closures = [closure(before, after, floor) for before, after in squares]
        channels = {}
        for c, channel in enumerate(gap):
            parts = [_range(before[c], after[c], least[c], floor[c]) for before, after in squares]
            held_out = None
            if squares[1:]:
                held_out = _held_out(start[channel][1], squares[1][0][c], squares[1][1][c])
            channels[channel] = ChannelError(float(measured[c]), *parts, holdout=held_out)
        values = one.parameters(spec)
        found.append(
            Candidate(
                spec, score, closures[0],
                closures[1] if closures[1:] else None, values, _units(one.fitted, spec, values), channels,
                _misfit(measured, one.fitted), id_of(spec) not in hidden,
            )
        )  # fmt: skip
    return tuple(sorted(found, key=lambda c: -c.score))


def steps_of(
    hypotheses: Sequence[Hypothesis], effects: Sequence[str], start: Start, refitted: Hypothesis,
    runs: Sequence[FitRun], wandering: Sequence[str],
) -> tuple[AnswerStep, ...]:  # fmt: skip
    """What the first effects of an answer of several left, each time the best of as many among the hypotheses.

    Zeros that wander come first: they are free in all of these.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
    effects : sequence of str
        Of the answer.
    start : Start
        What that leaves.
    refitted : Hypothesis
        The model without effects, as the search has it.
    runs : sequence of FitRun
        All samples of the measured runs.
    wandering : sequence of str
        Offsets among the effects whose zeros wander.
    """
    steps, there, laws = [], set(), [e for e in effects if e not in wandering]
    if wandering and laws:
        held_out = {channel: rms for channel, (_, rms) in start.items() if rms is not None}
        steps.append(AnswerStep(tuple(wandering), {channel: rms for channel, (rms, _) in start.items()}, held_out))
    for size in range(1, len(laws)):
        fits = [h for h in hypotheses if len(h.added) == size and there < set(h.added) < set(laws)]
        best = max(fits, key=lambda h: log_gain(refitted, h), default=None)
        if best is None:
            break
        there, left_out = set(best.added), {}
        for c, (channel, (_, before)) in enumerate(start.items()):
            if best.held_out is not None and refitted.held_out is not None:
                rms = _held_out(before, refitted.held_out[c], best.held_out[c])
                left_out |= {} if rms is None else {channel: rms}
        parts = best.fitted.at(runs).rmse / np.maximum(refitted.fitted.at(runs).rmse, 1e-300)
        measured = {c: float(before * part) for (c, (before, _)), part in zip(start.items(), parts, strict=True)}
        steps.append(AnswerStep((*wandering, *best.added), measured, left_out))
    return tuple(steps)


def _held_out(refitted: float | None, before: float, after: float) -> float | None:
    """RMS on all samples of the held-out runs, from mean squares before and after on the samples that a fit has."""
    if refitted is None or not before > 0.0:
        return None
    return float(refitted * np.sqrt(after / before))


def _with_nuisance_alone(spec: str, one: Hypothesis, refitted: FloatArray, runs: Sequence[FitRun]) -> FloatArray:
    """RMS left by the refitted model less what one nuisance effect removes beside the others, not what all remove."""
    _, without = one.tested[spec]
    removed = without.at(runs).rmse ** 2 - one.fitted.at(runs).rmse ** 2
    return np.sqrt(np.clip(refitted**2 - removed, 0.0, refitted**2))


def _nuisance_score(spec: str, one: Hypothesis) -> float:
    """By how many decibels a nuisance effect beside the others lowers what is left of the measured runs."""
    _, without = one.tested[spec]
    before = replace(one, measured=without.rmse**2 + one.reference_gain, held_out=None)
    return DECIBEL * log_gain(before, one)


def _range(before: float, after: float, least: float, floor: float) -> tuple[float, float] | None:
    """Closure of one channel above the least and above the full floor."""
    low, high = (closure(np.array([before]), np.array([after]), np.array([f])) for f in (least, floor))
    return None if low is None or high is None else (low, high)


def _units(fitted: Fitted, spec: str, values: Mapping[str, float]) -> dict[str, str]:
    prefix = prefix_of(spec)
    units = {v.name: v.quantity.unit for v in fitted.problem.kernel.parameters}
    return {n: units[prefix + n] for n in values}


def _misfit(rmse: np.ndarray, fitted: Fitted) -> float:
    return float(np.sum((rmse / np.maximum(fitted.spread, 1e-300)) ** 2))
