"""How small a gap can be, and whether what a hypothesis leaves is still something to explain.

Noise: what no hypothesis and no function of the coordinates predicts. Form: what the same refit leaves on reference
runs without the missing effect. A gap is open where a law is left in it, or where something wanders that is too large
to be noise of an instrument.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...kernels.arrays import BoolArray, FloatArray
from ...regression.residuals import noise_floor
from ...regression.residuals import white_noise as white_noise_of
from ..criteria import (
    CLEAN_EFFECT_SPREAD_SHARE,
    EFFECT_SPREAD_SHARE,
    ELSEWHERE_RATIO,
    ELSEWHERE_SPREAD_SHARE,
    EXPLAINED_SHARE,
    FORM_RATIO,
    LAW_FORM_SHARE,
    LAW_SHARE,
    REFERENCE_RATIO,
    SLOW_RATIO,
    WANDERING_SPREAD_SHARE,
    WHITE_SHARE,
)
from ..fits.refit import Fitted, above_floor
from ..fits.response import places_of
from ..residual.predictable import predictable_share
from ..runs.motion_signals import coordinate_units
from .hypotheses import Hypothesis
from .supported import Choice


@dataclass(frozen=True)
class Floors:
    """Floors of each channel, in its unit.

    Attributes
    ----------
    noise : ndarray, shape (channels,)
        RMS below which no gap can be explained, as far as we can tell: without repeats it holds the form of the law
        of the best hypothesis too; not less than the gap on reference runs.
    least : ndarray, shape (channels,)
        RMS that is noise whatever the law is; the same where every run repeats.
    reference : ndarray or None
        Gap on reference runs after the same refit.
    open_ : ndarray of bool, shape (channels,)
        Where the supported hypothesis leaves something that is no noise.
    unexplained : ndarray of bool, shape (channels,)
        Where that is more than the form of its laws.
    in_part : bool
        Whether its effects explain the other channels, and are those of an answer all the same.
    """

    noise: FloatArray
    least: FloatArray
    reference: FloatArray | None
    open_: BoolArray
    unexplained: BoolArray
    in_part: bool = False

    def missing_at(self, there: BoolArray) -> Floors:
        """The same, with something left there that is no noise and that no effect explains."""
        return replace(self, open_=self.open_ | there, unexplained=self.unexplained | there)

    @property
    def without_answer(self) -> bool:
        """Whether something is left that takes away the names."""
        return bool(self.unexplained.any()) and not self.in_part


def floors_of(choice: Choice, refitted: Hypothesis, reference_fit: Fitted | None) -> Floors:
    """Floors that follow from what the best hypothesis leaves.

    Parameters
    ----------
    choice : Choice
    refitted : Hypothesis
        Refitted baseline.
    reference_fit : Fitted or None
        The same on reference runs.
    """
    best, winner = choice.best.fitted, choice.winner
    share = _predictable(best)
    noise = best.rmse * np.sqrt(np.clip(1.0 - share, 0.0, 1.0))
    repeats = _repeats(best)
    if repeats is not None:
        noise = np.minimum(noise, np.maximum(repeats, 1e-9 * best.spread))
    white = np.minimum(white_noise(best), best.rmse)
    noise = np.minimum(np.maximum(noise, white), winner.fitted.rmse)
    least = np.minimum(white, noise) if repeats is None else noise
    if reference_fit is not None:  # gaps are judged against the larger floor
        noise, least = np.maximum(noise, reference_fit.rmse), np.maximum(least, reference_fit.rmse)
    open_ = open_channels(winner, refitted.fitted, reference_fit)
    unexplained = open_ & ~mostly_explained(winner, refitted, reference_fit)
    unexplained |= _lost_elsewhere(winner, refitted, noise) | shown_elsewhere(winner, reference_fit)
    unexplained |= _above_references(winner, reference_fit)
    return Floors(noise, least, None if reference_fit is None else reference_fit.rmse, open_, unexplained)


def open_channels(
    one: Hypothesis, base: Fitted, reference_fit: Fitted | None,
    least: FloatArray | float = EFFECT_SPREAD_SHARE, form_share: float = LAW_FORM_SHARE,
) -> BoolArray:  # fmt: skip
    """Channels in which a hypothesis leaves something to explain.

    Parameters
    ----------
    one : Hypothesis
    base : Fitted
        Refitted baseline: part of what was removed from it may be left, since no law is quite the true one.
    reference_fit : Fitted or None
        Baseline on reference runs.
    least : float, or ndarray of shape (channels,)
        Part of a channel's spread beyond which a law is a gap.
    form_share : float
        Part of what was removed that may be left.
    """
    fitted = one.fitted
    mean_square, spread = fitted.rmse**2, fitted.spread
    form = form_share * np.maximum(base.rmse**2 - mean_square, 0.0)
    share = _predictable(fitted)
    lawful = (share > LAW_SHARE) & (share * mean_square > np.maximum((least * spread) ** 2, form))
    white = np.minimum(white_noise(fitted) ** 2, mean_square)
    coloured = mean_square - white
    large = np.where(mean_square > SLOW_RATIO**2 * white, least, WANDERING_SPREAD_SHARE) * spread
    wandering = (white < WHITE_SHARE * mean_square) & (coloured > np.maximum(large**2, form))
    stepped = fitted.task.steps > 0.0  # what is between two levels follows the motion and wanders
    found = lawful | (wandering & ~stepped)
    there = np.zeros_like(mean_square) if reference_fit is None else REFERENCE_RATIO * reference_fit.rmse
    # a refit to stairs is a little off, and one to stairs of a converter that truncates more
    above = above_floor(mean_square, REFERENCE_RATIO * fitted.task.steps, there)
    if reference_fit is not None:
        found = (found & (above > 0.0)) | (above > np.maximum((least * spread) ** 2, form))
    return found & (~stepped | (above > 0.0))


def _predictable(fitted: Fitted) -> FloatArray:
    return predictable_share(fitted.residuals, places_of(fitted), *coordinate_units(fitted.problem.kernel))


def mostly_explained(one: Hypothesis, refitted: Hypothesis, reference_fit: Fitted | None) -> BoolArray:
    """Channels in which the effects close nearly all of the gap, though their law is not quite the true one."""
    return nearly_closed(one, refitted, reference_fit) & bool(one.effects)


def nearly_closed(one: Hypothesis, refitted: Hypothesis, reference_fit: Fitted | None) -> BoolArray:
    """Channels in which a hypothesis leaves next to nothing of the gap of the refitted model.

    The gap is that of the measured and of the held-out runs together: where a motion shows little of an effect, the
    form of the model is most of what is left.
    """
    noise = least_floor(one, reference_fit)
    gap, left = refitted.measured - noise**2, one.measured - noise**2
    if one.held_out is not None and refitted.held_out is not None:
        gap, left = gap + refitted.held_out - noise**2, left + one.held_out - noise**2
    return left < (1.0 - EXPLAINED_SHARE) * np.maximum(gap, 1e-300)


def least_floor(one: Hypothesis, reference_fit: Fitted | None) -> FloatArray:
    """RMS that no effect takes away: what is left on reference runs, or without any the noise, by channel."""
    return np.minimum(white_noise(one.fitted), one.fitted.rmse) if reference_fit is None else reference_fit.rmse


def _lost_elsewhere(one: Hypothesis, refitted: Hypothesis, noise: FloatArray) -> BoolArray:
    """Channels in which effects that close the gap of the measured runs leave much of that of held-out ones.

    A law that is the rig's carries over to other motions; what only patches the form of the model does not.
    """
    if one.held_out is None or refitted.held_out is None:
        return np.zeros(noise.size, bool)
    gap, left = refitted.held_out - noise**2, one.held_out - noise**2
    acts = one.acts & (refitted.measured - one.measured > (EFFECT_SPREAD_SHARE * one.fitted.spread) ** 2)
    plain = gap > (EFFECT_SPREAD_SHARE * one.fitted.spread) ** 2
    return acts & plain & (left > (1.0 - EXPLAINED_SHARE) * gap)


def shown_elsewhere(one: Hypothesis, reference_fit: Fitted | None) -> BoolArray:
    """Channels whose gap is that of held-out runs alone, where nothing is missing of what the measured ones show.

    Values that may move to those runs do not close it: their motion shows what that of the measured runs does not.
    """
    if one.effects or one.held_out is None or one.folded:
        return np.zeros(one.measured.size, bool)
    known = one.measured if reference_fit is None else np.maximum(one.measured, reference_fit.rmse**2)
    least = (ELSEWHERE_SPREAD_SHARE * one.fitted.spread) ** 2
    return (one.held_out > ELSEWHERE_RATIO**2 * known) & (one.held_out > least)


def _above_references(one: Hypothesis, reference_fit: Fitted | None) -> BoolArray:
    """Channels where nothing is missing, and far more is left than of reference runs: of measured and held-out runs.

    What is left of reference runs is what the form of the model leaves, however little of the spread that is. What the
    steps of a converter make is no gap: they are read from the values.
    """
    if one.effects or one.held_out is None or reference_fit is None:
        return np.zeros(one.measured.size, bool)
    steps, known = REFERENCE_RATIO * one.fitted.task.steps, FORM_RATIO * reference_fit.rmse
    above = [above_floor(left, steps, known) > 0.0 for left in (one.measured, one.held_out)]
    plain = one.measured + one.held_out > 2.0 * (CLEAN_EFFECT_SPREAD_SHARE * one.fitted.spread) ** 2
    return plain & np.all(above, axis=0)


def white_noise(fitted: Fitted) -> FloatArray:
    """RMS of what changes from sample to sample in a residual: a lower bound of the noise."""
    return np.sqrt(np.mean([white_noise_of(r) ** 2 for r in fitted.residuals], axis=0))


def _repeats(fitted: Fitted) -> FloatArray | None:
    """RMS by which each channel does not repeat from period to period; None where a run has no period."""
    squares = []
    for run in fitted.problem.runs:
        floor = noise_floor(run)
        if floor is None:
            return None
        squares.append(floor**2 * run.time.size)
    return np.sqrt(np.sum(squares, axis=0) / sum(run.time.size for run in fitted.problem.runs))
