"""Compile every model and effect into the cache, so that a first diagnosis waits for its chains alone.

``python -m tsm_fmu.kernels.precompile``, once after an installation; ``make demo`` does so in the background, the first
time. What is compiled already is left.
"""

from __future__ import annotations

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from ..effects import EFFECTS
from ..models import MODELS
from .compiled_cache import folder
from .kernel import compiled_run


def main() -> int:
    """Compile on all processors; 0, also where there is no folder to keep anything in."""
    if folder() is None:
        return 0
    print("precompile: models and effects, once for this version", flush=True)
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        for _ in pool.map(_compile, range(len(_MODULES)), chunksize=4):
            pass
    return 0


_MODULES = (*EFFECTS, *MODELS)


def _compile(number: int) -> None:
    from numba import float64, int64

    # table, spans, t, u, y, at
    arrays = float64[:, ::1], int64[:, ::1], float64[::1], float64[:, ::1], float64[:, ::1], int64[::1]
    compiled_run(_MODULES[number]).compile(arrays)  # type: ignore[attr-defined]


if __name__ == "__main__":
    sys.exit(main())
