"""A channel that hums: what that makes of the answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...regression.problem import FitRun
from ...regression.residuals import rms
from ..choice.selection import Selection
from ..criteria import REFERENCE_RATIO
from ..evidence import Tone
from ..fits.refit import Fitted
from ..fits.response import places_of
from ..residual.tones import RunTone, tones, tones_of_runs


def tones_left(whole: Fitted) -> dict[str, Tone]:
    """Tones in what a fit leaves of runs with all their samples, by channel."""
    return tones(whole.problem.channels, whole.compared_residuals, places_of(whole), whole.spread)


def sizes_on(reference: Fitted, heard: Mapping[str, Tone]) -> dict[str, float]:
    """RMS of the same tones in what the model leaves of reference runs, by channel.

    Parameters
    ----------
    reference : Fitted
        The model on reference runs with all their samples.
    heard : mapping of str to Tone
    """
    runs, of_runs = reference.problem.runs, _of_runs(reference, heard)
    return {c: float(rms([one.at(run.time) for one, run in zip(of_runs[c], runs, strict=True)])) for c in heard}


def without_tones(whole: Fitted, heard: Mapping[str, Tone]) -> tuple[FitRun, ...]:
    """The runs of a fit less their tones of these frequencies, which would hide what a law of the motion does.

    Parameters
    ----------
    whole : Fitted
        On runs with all their samples.
    heard : mapping of str to Tone
        By channel.
    """
    channels, of_runs = whole.problem.channels, _of_runs(whole, heard)

    def quiet(k: int, run: FitRun) -> FitRun:
        tones = [of_runs[c][k].at(run.time) if c in heard else np.zeros(run.time.size) for c in channels]
        return replace(run, targets=np.ascontiguousarray(run.targets - np.column_stack(tones)))

    return tuple(quiet(k, run) for k, run in enumerate(whole.problem.runs))


def taken_out(tone: Tone, left: Fitted, channel: str) -> Tone:
    """The tone, marked as taken out of the runs of a fit, beside what that leaves of these."""
    of_channel = np.concatenate([r[:, left.problem.channels.index(channel)] for r in left.compared_residuals])
    return replace(tone, beside=float(np.sqrt(np.nanmean(of_channel**2))), taken_out=True)


def _of_runs(whole: Fitted, heard: Mapping[str, Tone]) -> dict[str, list[RunTone]]:
    left, places, channels = whole.compared_residuals, places_of(whole), whole.problem.channels
    return {c: tones_of_runs(left, places, channels.index(c), tone.frequency) for c, tone in heard.items()}


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
