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
from ..residual.tones import tones


def tones_left(fitted: Fitted, runs: Sequence[FitRun]) -> dict[str, Tone]:
    """Tones in what a fit leaves of all samples of its runs, by channel."""
    whole = fitted.at(runs)
    return tones(whole.problem.channels, whole.residuals, places_of(whole), whole.spread)


def with_tones(one: Selection, heard: Mapping[str, Tone], on_reference: Mapping[str, Tone]) -> Selection:
    """The same; where no effect is missing, tones that reference runs do not hold as well are.

    Nothing of the library makes them, and noise they are not: a floor is at most what is left beside them.

    Parameters
    ----------
    one : Selection
    heard, on_reference : mapping of str to Tone
        In what the winner leaves, and the model on reference runs, by channel.
    """
    if one.choice.winner.effects:
        return one
    fitted, floors = one.choice.winner.fitted, one.floors
    there = {c: REFERENCE_RATIO * tone.rms for c, tone in on_reference.items()}
    missing = {c: tone.rms for c, tone in heard.items() if tone.rms > there.get(c, 0.0)}
    size = np.array([missing.get(c, 0.0) for c in fitted.problem.channels])
    beside = np.where(size > 0.0, np.sqrt(np.maximum(fitted.rmse**2 - size**2, 0.0)), np.inf)
    floors = replace(
        floors, noise=np.minimum(floors.noise, beside), least=np.minimum(floors.least, beside),
        open_=floors.open_ | (size > 0.0), unexplained=floors.unexplained | (size > 0.0),
    )  # fmt: skip
    return replace(one, floors=floors)
