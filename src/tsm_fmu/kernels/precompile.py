"""Compile every model and effect into the cache, so that a first diagnosis need not wait for the compiler.

``python -m tsm_fmu.kernels.precompile``, once after an installation; ``make demo`` does so in the background, the first
time. What is compiled already is left.
"""

from __future__ import annotations

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from ..effects import EFFECTS, coordinates, coordinates_of_speed
from ..models import MODELS
from .compiled_cache import folder
from .kernel import Kernel, compiled_run
from .ports import ports


def main() -> int:
    """Compile on all processors; 0, also where there is no folder to keep anything in."""
    if folder() is None:
        return 0
    print("precompile: models and effects, once for this version", flush=True)
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        for _ in pool.map(_compile, range(len(_MODULES)), chunksize=4):
            pass
    return 0


_MODULES = (coordinates, coordinates_of_speed, *EFFECTS, *MODELS, *(p for m in MODELS for p in ports(Kernel(m))))


def _compile(number: int) -> None:
    module = _MODULES[number]
    table, u, y = (np.zeros((0, len(c._fields))) for c in (module.Params, module.Inputs, module.Outputs))
    compiled_run(module)(table, np.zeros((0, 3), dtype=np.int64), np.zeros(0), u, y, np.zeros(1, dtype=np.int64))


if __name__ == "__main__":
    sys.exit(main())
