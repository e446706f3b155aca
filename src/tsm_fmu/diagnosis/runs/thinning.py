"""How many samples of long runs a diagnosis works on, and where the motion of a model stands."""

from __future__ import annotations

from collections.abc import Sequence

from ...kernels.kernel import Kernel
from ...regression.problem import FitRun
from ...regression.thinning import thinned

ROWS = 4_000
"""Samples of all measured runs together that the search works on; more are thinned evenly."""
ROWS_OF_SPEED = 20_000
"""The same where the input is a speed: between samples it is not known, and thinning would act as a lag."""
SHORTEST = 500
"""Samples that a run keeps at least."""


def searched(model: Kernel, runs: Sequence[FitRun]) -> list[FitRun]:
    """Runs as the search works on them."""
    return thinned(model, runs, ROWS_OF_SPEED if motion_channel(model) == "v" else ROWS, SHORTEST)


def motion_channel(model: Kernel) -> str:
    """Name of the position or speed input; a chain moves as its model does."""
    return model.motion
