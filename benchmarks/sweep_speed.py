"""A sweep on two processes beside the same on one: efficiency, and what a case costs.

The MSSP 2015 loop with native FMUs, `POINTS` values of the load, `SECONDS` each at 1 kHz, by ``tsm_fmu.sweep``. The
start of the processes is in it. ``python -m benchmarks.sweep_speed`` prints the row.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

import tsm_fmu as tsm
from tsm_fmu.batching.processes import cores
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Experiment

from .master_speed import STEP, loop
from .ratio import Ratio

POINTS, SECONDS = 60, 40.0
EFFICIENT = 0.75
"""Least share of two cores that two processes put to use."""


def ratios() -> Iterator[Ratio]:
    """Time on two processes beside half the time on one, per case; at most 1 / `EFFICIENT`."""
    if cores() < 2:
        print("one core: the efficiency of a sweep on two is not measured")
        return
    with TemporaryDirectory() as folder:
        path = write_ssp(Path(folder) / "loop.ssp", (loop("native", Path(folder)), Experiment(SECONDS, STEP)))
        spent = {}
        for workers in (1, 2):
            begin = perf_counter()
            found = tsm.sweep(path, {"load.k": np.linspace(0.05, 0.2, POINTS).tolist()}, workers=workers, loops="delay")
            spent[workers] = perf_counter() - begin
            assert not found.failures
    case = {workers: 1e6 * seconds / POINTS for workers, seconds in spent.items()}
    ours, reference = case[2], 0.5 * case[1]
    print(
        f"sweep of {POINTS} cases of {SECONDS:g} s at 1 kHz: {case[1] / 1e3:.0f} ms a case on one process, "
        f"{case[2] / 1e3:.0f} ms on two, efficiency {100.0 * reference / ours:.0f} %"
    )
    yield Ratio(
        "sweep / two processes beside half of one, per case", ours, reference, ours / reference, 1.0 / EFFICIENT
    )


def main() -> None:
    """Print the row."""
    for row in ratios():
        print(f"{row.what:<58} {row.ours_us:>8.0f} us {row.reference_us:>8.0f} us {row.ratio:>6.3g}  {row.verdict}")


if __name__ == "__main__":
    main()
