"""Long runs thinned for the search, and where the motion of a model stands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.kernel import Kernel
from ...regression.problem import FitRun

ROWS = 4_000
"""Samples of all measured runs together that the search works on; more are thinned evenly."""
ROWS_OF_SPEED = 20_000
"""The same where the input is a speed: between samples it is not known, and thinning would act as a lag."""
SHORTEST = 500
"""Samples that a run keeps at least."""
STROKE = 25
"""Samples of a stroke that are kept at least."""


def searched(model: Kernel, runs: Sequence[FitRun]) -> list[FitRun]:
    """Runs as the search works on them."""
    return thinned(model, runs, ROWS_OF_SPEED if motion_channel(model) == "v" else ROWS)


def thinned(model: Kernel, runs: Sequence[FitRun], rows: int = ROWS, shortest: int = SHORTEST) -> list[FitRun]:
    """Runs with every m-th sample, but not so few that a stroke is no longer followed.

    Kernels step exactly along the line between two positions.
    """
    total = sum(run.time.size for run in runs)

    def step(run: FitRun) -> int:
        return max(1, min(total // rows, run.time.size // shortest, int(_samples_of_a_stroke(model, run) / STROKE)))

    return [run.every(step(run)) for run in runs]


def _samples_of_a_stroke(model: Kernel, run: FitRun) -> float:
    """Samples from one passage of the middle of the motion to the next, on average."""
    motion = motion_channel(model)
    names = [v.name for v in model.inputs]
    if motion not in names:
        return float(run.time.size)
    x = run.inputs[:, names.index(motion)]
    return run.time.size / (1.0 + np.count_nonzero(np.diff(np.signbit(x - x.mean()))))


def motion_channel(model: Kernel) -> str:
    """Name of the position or speed input; a chain moves as its model does."""
    return model.motion
