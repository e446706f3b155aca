"""A channel that hums: what that makes of the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...regression.problem import FitRun
from ..choice.selection import Selection
from ..criteria import REFERENCE_RATIO
from ..evidence import Tone
from ..fits.refit import Fitted
from ..fits.response import places_of
from ..residual.tones import size_of_tone, tones


def tones_left(fitted: Fitted, runs: Sequence[FitRun]) -> dict[str, Tone]:
    """Tones in what a fit leaves of all samples of its runs, by channel."""
    whole = fitted.at(runs)
    return tones(whole.problem.channels, whole.compared_residuals, places_of(whole), whole.spread)


def sizes_on(reference: Fitted, runs: Sequence[FitRun], heard: Mapping[str, Tone]) -> dict[str, float]:
    """RMS of the same tones in what the model leaves of reference runs, by channel.

    Parameters
    ----------
    reference : Fitted
        The model on reference runs.
    runs : sequence of FitRun
        All samples of these.
    heard : mapping of str to Tone
    """
    whole = reference.at(runs)
    left, places, channels = whole.compared_residuals, places_of(whole), whole.problem.channels
    return {c: size_of_tone(left, places, channels.index(c), tone.frequency) for c, tone in heard.items()}


def with_tones(one: Selection, heard: Mapping[str, Tone], on_reference: Mapping[str, float]) -> Selection:
    """The same; where no effect is missing, tones that reference runs do not hold as well are.

    Nothing of the library makes them, and noise they are not: a floor is at most what is left beside them, and at least
    what the model leaves of reference runs.

    Parameters
    ----------
    one : Selection
    heard : mapping of str to Tone
        In what the winner leaves, by channel.
    on_reference : mapping of str to float
        RMS of the same tones on reference runs, by channel.
    """
    if one.choice.winner.effects:
        return one
    channels, floors = one.choice.winner.fitted.problem.channels, one.floors
    coarse = [levels.channel for levels in one.baselines.levels]  # missing already
    missing = {
        c: tone for c, tone in heard.items()
        if c not in coarse and tone.rms > REFERENCE_RATIO * on_reference.get(c, 0.0)
    }  # fmt: skip
    there = np.array([c in missing for c in channels])
    beside = np.array([missing[c].beside if c in missing else np.inf for c in channels])
    known = np.zeros(len(channels)) if floors.reference is None else floors.reference
    noise, least = np.minimum(floors.noise, np.maximum(beside, known)), np.minimum(floors.least, beside)
    return replace(one, floors=replace(floors.missing_at(there), noise=noise, least=least))
