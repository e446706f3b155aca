"""How many samples of long runs a diagnosis works on, and where the motion of a model stands."""

from __future__ import annotations

from collections.abc import Sequence

from ...kernels.kernel import Kernel
from ...regression.problem import FitRun
from ...regression.thinning import thinned
from ..criteria import KEPT_RUN_SAMPLES, SEARCH_SAMPLES, SPEED_INPUT_SEARCH_SAMPLES


def thinned_for_search(model: Kernel, runs: Sequence[FitRun]) -> list[FitRun]:
    """Runs as the search works on them."""
    return thinned(model, runs, SPEED_INPUT_SEARCH_SAMPLES if model.motion == "v" else SEARCH_SAMPLES, KEPT_RUN_SAMPLES)
