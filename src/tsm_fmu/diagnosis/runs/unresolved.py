"""Reversals that the samples of a run do not resolve.

After a reversal friction turns over within the presliding distance. Where the drive passes that in a sample or two, or
in a step or two of its encoder, what is simulated there depends on how the drive moved between two samples, which no
log says: differences as large as the friction itself, and no fault of the model. They are compared beyond what that
may make: a channel that comes late is off by more.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d

from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel
from ...logs.differentiate import after_gaps
from ...logs.quantisation import quantisation_step
from ...regression.problem import FitRun
from ...regression.residuals import white_noise
from ..criteria import DOUBT_DEVIATIONS, UNRESOLVED_MOST_SHARE, UNRESOLVED_SPREAD_SHARE
from .beginning import friction_channels
from .motion_signals import position_of

NOISE_DEVIATIONS = 4.0
"""Standard deviations of a channel's noise that a change from sample to sample must exceed."""


def with_doubt(model: Kernel, run: FitRun, channels: Sequence[str]) -> FitRun:
    """The run, of which such values are in doubt.

    Parameters
    ----------
    model : Kernel
        Its motion.
    run : FitRun
    channels : sequence of str
        Measured ones. Those that hold the friction are looked at: a position that jumps at a reversal has play, or a
        side that goes free.
    """
    if not model.motion or run.time.size < 8:
        return run
    x = position_of(model, run.time, run.inputs)
    frictional = friction_channels(model)
    found = np.zeros(run.targets.shape)
    for c, channel in enumerate(channels):
        if channel in frictional:
            found[:, c] = doubt_of(x, run.targets[:, c])
    most = UNRESOLVED_MOST_SHARE  # a log that resolves nothing is compared as it is
    return run.doubting(np.where((found > 0.0).mean(axis=0) <= most, found, 0.0))


def doubt_of(x: FloatArray, y: FloatArray) -> FloatArray:
    """What is in doubt of a channel as it depends on how the drive moved between two samples, shape (n,).

    What is not known of the position (its encoder's step, and at a reversal how far it went between the samples),
    times what the channel changes over the position; zero where that is little.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Position and channel.
    """
    moved = np.diff(x)
    turns = np.zeros(moved.size, bool)
    turns[1:] = moved[1:] * moved[:-1] <= 0.0
    beyond = np.zeros(moved.size)
    beyond[1:] = np.abs(np.diff(moved)) / 8.0  # of a parabola through three samples, beyond the outer one
    unknown = np.where(turns | np.append(turns[1:], False), np.maximum(beyond, np.append(beyond[1:], 0.0)), 0.0)
    unknown = np.maximum(unknown, quantisation_step(x) / np.sqrt(12.0))
    change = np.maximum(np.abs(np.diff(y)) - NOISE_DEVIATIONS * float(white_noise(y)), 0.0)
    error = change * unknown / np.maximum(np.maximum(np.abs(moved), unknown), 1e-300)
    bad = error > UNRESOLVED_SPREAD_SHARE * float(np.std(y))
    error = np.where(bad, DOUBT_DEVIATIONS * error, 0.0)
    return np.asarray(maximum_filter1d(np.maximum(np.append(error, 0.0), np.append(0.0, error)), 3))


def unresolved_notes(runs: Sequence[FitRun], channels: Sequence[str]) -> Iterator[str]:
    """What a user should know of it, a sentence for each channel that has such values."""
    gap = ", or follow a gap of the log" if any(after_gaps(run.with_lead[0]).size for run in runs) else ""
    for c, channel in enumerate(channels):
        count = sum(int(run.unresolved[:, c].sum()) for run in runs if run.unresolved.size)
        if count:
            share = 100.0 * count / sum(run.time.size for run in runs)
            yield (
                f"{share:.2g} % of the samples of {channel} are reversals, or rests after them, that these samples or "
                f"the steps of the position do not resolve{gap}: they are compared beyond what that leaves open"
            )
