"""What a drive may have done before its log: it may have come from either side.

Friction remembers that for a few presliding distances, which only a fitted model knows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...kernels.arrays import FloatArray
from ...kernels.kernel import Kernel
from ...regression.problem import FitRun
from .motion_signals import position_of

PAST_SAMPLES = 200
"""Samples of such a past: it only has to be long."""
PAST_STROKES = 2.0
"""Its length: the friction of a model forgets within a stroke."""


def coming_from(model: Kernel, run: FitRun, way: float, stroke: float) -> FitRun:
    """The run after a past in which it came from one side at its usual speed.

    Parameters
    ----------
    model : Kernel
        With a motion.
    run : FitRun
    way : float
        1 upwards, -1 downwards.
    stroke : float
        Longest one of the rig.
    """
    time, inputs = run.with_lead
    x = position_of(model, time, inputs)
    distance = PAST_STROKES * stroke
    speed = float(np.sqrt(np.mean(np.square(np.diff(x) / np.diff(time)))))
    if speed == 0.0:
        return run
    ago = np.arange(PAST_SAMPLES, 0, -1) * (distance / speed / PAST_SAMPLES)
    past = np.repeat(inputs[:1], PAST_SAMPLES, axis=0)
    past[:, [v.name for v in model.inputs].index(model.motion)] = (
        way * speed if model.motion == "v" else x[0] - way * speed * ago
    )
    lead = time.size - run.time.size
    return replace(
        run, lead_time=np.append(time[0] - ago, time[:lead]), lead_inputs=np.concatenate([past, inputs[:lead]])
    )


def travel(model: Kernel, run: FitRun) -> FloatArray:
    """How far the drive has gone, to and fro, from the first sample of a log to each one that is compared."""
    x = position_of(model, *run.with_lead)
    return np.cumsum(np.abs(np.diff(x, prepend=x[0])))[-run.time.size :]
