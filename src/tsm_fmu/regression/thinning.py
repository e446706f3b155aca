"""Long runs with fewer samples, for the parts of a search that need the motion and not every sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kernels.kernel import Kernel
from .problem import FitRun

STROKE = 25
"""Samples of a stroke that are kept at least."""


def thinned(model: Kernel, runs: Sequence[FitRun], rows: int, shortest: int | None = None) -> list[FitRun]:
    """Every m-th sample of each run, but not so few that a stroke is no longer followed.

    Kernels step exactly along the line between two positions: nothing is filtered.

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

    return [run.every(step(run)) for run in runs]


def _samples_of_a_stroke(model: Kernel, run: FitRun) -> float:
    """Samples from one passage of the middle of the motion to the next, on average."""
    names = [v.name for v in model.inputs]
    if model.motion not in names:
        return float(run.time.size)
    x = run.inputs[:, names.index(model.motion)]
    return run.time.size / (1.0 + np.count_nonzero(np.diff(np.signbit(x - x.mean()))))
