"""Where else a drive may have been between the steps of its encoder.

A drive that turns within a step or two of its encoder, or comes back by less as it stops, has moved by an unknown part
of a presliding distance. Its friction then stands anywhere on the way from one side to the other, until the drive has
moved on: seconds, where it rests. The same readings allow a motion that turned as late as they allow and one that
turned as early.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.arrays import FloatArray, IntArray
from ...kernels.kernel import Kernel
from ...logs.quantisation import quantisation_step
from ...regression.problem import FitRun
from ..criteria import LONG_STAY_RATIO
from .drivers import drives_of


@dataclass(frozen=True)
class Elsewhere:
    """Two motions that the readings of a run allow as well; inputs of shape (samples with lead, inputs).

    Attributes
    ----------
    late, early : ndarray
        Each reversal, and each rest, as far on as the readings allow, and as little far.
    """

    late: FloatArray
    early: FloatArray


def elsewhere(model: Kernel, read: FitRun, used: FitRun) -> Elsewhere | None:
    """Other motions of a run; None where its position is not read in steps, or never turns.

    Parameters
    ----------
    model : Kernel
        With the inputs of the runs.
    read, used : FitRun
        As the encoder reads it, and as it drives the model; both from their first sample.
    """
    names = [v.name for v in model.inputs]
    position = next((d.column for d in drives_of(model) if d.role == "position"), model.motion)
    if not model.motion or position == "v":
        return None
    x, column = read.inputs[:, names.index(position)], names.index(model.motion)
    step = quantisation_step(x)
    if step == 0.0:
        return None
    driven = used.inputs[:, column]
    if model.motion == "v":
        driven = np.cumsum(driven * np.diff(used.time, prepend=used.time[0]))
        driven += np.median(x - driven)
    knots, outer, inner = _stops(x, step)
    if not knots.size:
        return None

    def moved(at: FloatArray) -> FloatArray:
        other = driven + np.interp(np.arange(x.size), knots, at - driven[knots])
        inputs = used.inputs.copy()
        inputs[:, column] = np.append(0.0, np.diff(other) / np.diff(used.time)) if model.motion == "v" else other
        return inputs

    return Elsewhere(moved(outer), moved(inner))


def _stops(x: FloatArray, step: float) -> tuple[IntArray, FloatArray, FloatArray]:
    """Samples at which a position stands, at a reversal or for long, and the edges of its reading there.

    First the edge on which it stands if it has gone as far as it could the way that it came, then the other.
    """
    edges = np.flatnonzero(np.abs(np.diff(x)) > 0.2 * step) + 1
    first = np.concatenate([[0], edges])
    last, at = np.append(edges, x.size) - 1, x[first]
    lengths, ways = last - first + 1, np.sign(np.diff(at))
    beside = np.maximum(lengths[:-1], np.append(lengths[2:], 0))  # of all levels but the first
    stops = np.append(ways[1:] * ways[:-1] < 0.0, True) | (lengths[1:] > LONG_STAY_RATIO * beside)
    stops = np.flatnonzero(stops) + 1 if ways.size else np.empty(0, np.intp)
    # a long stay is no slow motion: it was reached about as fast as the levels beside it were passed
    soft = np.minimum(lengths[stops], beside[stops - 1]) // 2
    begin = np.minimum(first[stops] + soft, (first[stops] + last[stops]) // 2)
    end = np.maximum(last[stops] - soft, begin)
    knots, kept = np.unique(np.stack([begin, end], axis=1).ravel(), return_index=True)
    reading, out = np.repeat(at[stops], 2)[kept], 0.5 * step * np.repeat(ways[stops - 1], 2)[kept]
    return knots, reading + out, reading - out
