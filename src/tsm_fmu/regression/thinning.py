"""Long runs with fewer samples, for the parts of a search that need the motion and not every sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..kernels.kernel import Kernel
from .problem import FitRun

STROKE = 25
"""Samples of a stroke that are kept at least."""


def thinned(model: Kernel, runs: Sequence[FitRun], rows: int, shortest: int | None = None) -> list[FitRun]:
    """Every m-th sample of each run, but not so few that a stroke is no longer followed.

    Kernels step exactly along the line between two positions: nothing is filtered. Where a speed drives the model, a
    step has the mean speed of those that it stands for, and so moves as far as they do.

    Parameters
    ----------
    model : Kernel
        Whose motion the strokes are counted of; a chain moves as its model does.
    runs : sequence of FitRun
    rows : int
        Samples of all runs together that are enough.
    shortest : int, optional
        Samples that a run keeps at least; by default `rows`, which a run alone then has, too.
    """
    total, shortest = sum(run.time.size for run in runs), shortest or rows

    def step(run: FitRun) -> int:
        by_stroke = int(_samples_of_a_stroke(model, run) / STROKE)
        return max(1, min(total // rows, run.time.size // shortest, by_stroke))

    return [_every(model, run, step(run)) for run in runs]


def _every(model: Kernel, run: FitRun, step: int) -> FitRun:
    few, names = run.every(step), [v.name for v in model.inputs]
    if step == 1 or model.motion != "v" or "v" not in names:
        return few
    column = names.index("v")
    time, inputs = run.with_lead
    way = np.cumsum(np.append(0.0, inputs[1:, column] * np.diff(time)))
    kept, _ = few.with_lead
    speed = np.append(inputs[0, column], np.diff(np.interp(kept, time, way)) / np.diff(kept))
    lead = few.lead_time.size
    inputs, lead_inputs = few.inputs.copy(), few.lead_inputs.copy()
    inputs[:, column] = speed[lead:]
    if lead:
        lead_inputs[:, column] = speed[:lead]
    return replace(few, inputs=inputs, lead_inputs=lead_inputs)


def _samples_of_a_stroke(model: Kernel, run: FitRun) -> float:
    """Samples from one passage of the middle of the motion to the next, on average."""
    names = [v.name for v in model.inputs]
    if model.motion not in names:
        return float(run.time.size)
    x = run.inputs[:, names.index(model.motion)]
    return run.time.size / (1.0 + np.count_nonzero(np.diff(np.signbit(x - x.mean()))))
