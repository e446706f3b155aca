"""How many samples of long runs a diagnosis works on, and where the motion of a model stands."""

from __future__ import annotations

from collections.abc import Sequence

from ...kernels.kernel import Kernel
from ...regression.problem import FitRun
from ...regression.thinning import thinned
from ..criteria import KEPT_RUN_SAMPLES, SEARCH_SAMPLES, SPEED_INPUT_SEARCH_SAMPLES
from .unresolved import with_doubt


def thinned_for_search(model: Kernel, runs: Sequence[FitRun], channels: Sequence[str], times: int = 1) -> list[FitRun]:
    """Runs as the search works on them, or with so many times its samples."""
    rows = times * (SPEED_INPUT_SEARCH_SAMPLES if model.motion == "v" else SEARCH_SAMPLES)
    found = thinned(model, runs, rows, times * KEPT_RUN_SAMPLES)
    return [
        few if few.time.size == run.time.size else with_doubt(model, few, channels)
        for few, run in zip(found, runs, strict=True)
    ]
