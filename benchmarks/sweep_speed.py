"""A sweep on two processes beside the same on one: efficiency, what a case costs, and what the start costs.

The MSSP 2015 loop with native FMUs over values of the load, by ``tsm_fmu.sweep``. Both numbers of `CASES` are run: what
the additional cases take is what a case costs, the rest is the start, of the processes too. Cases of `SECONDS`
simulated seconds at 1 kHz: in the short ones files and libraries are most, in the long ones steps and recording.
``python -m benchmarks.sweep_speed`` prints the rows.
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

SECONDS = {40.0: (10, 90), 400.0: (4, 28)}
"""Simulated by case, and the two numbers of cases."""
EFFICIENT = {40.0: 0.6, 400.0: 0.75}
"""Least share of two cores that two processes put to use; short cases wait for the one file system."""


def ratios() -> Iterator[Ratio]:
    """Time of a case on two processes beside half of that on one; at most 1 / `EFFICIENT`."""
    if cores() < 2:
        print("one core: the efficiency of a sweep on two is not measured")
        return
    with TemporaryDirectory() as folder:
        system = loop("native", Path(folder))
        for seconds, numbers in SECONDS.items():
            path = write_ssp(Path(folder) / f"loop_{seconds:g}.ssp", (system, Experiment(seconds, STEP)))
            one, two = (_spent(path, numbers, workers) for workers in (1, 2))
            ours, reference = two[0], 0.5 * one[0]
            print(
                f"sweep, cases of {seconds:g} s at 1 kHz: {one[0]:.0f} ms a case on one process, {two[0]:.0f} ms on "
                f"two, efficiency {100.0 * reference / ours:.0f} %; start {one[1]:.0f} and {two[1]:.0f} ms"
            )
            name = f"sweep / {seconds:g} s cases, two processes beside half of one"
            yield Ratio(name, 1e3 * ours, 1e3 * reference, ours / reference, 1.0 / EFFICIENT[seconds])


def _spent(path: Path, numbers: tuple[int, int], workers: int) -> tuple[float, float]:
    """Of a case and of the start [ms]."""
    tsm.sweep(path, {"load.k": [0.1, 0.11]}, workers=workers, loops="delay")  # what is read first is then at hand
    taken = []
    for number in numbers:
        begin = perf_counter()
        found = tsm.sweep(path, {"load.k": np.linspace(0.05, 0.2, number).tolist()}, workers=workers, loops="delay")
        taken.append(1e3 * (perf_counter() - begin))
        assert not found.failures
    case = (taken[1] - taken[0]) / (numbers[1] - numbers[0])
    return case, taken[0] - numbers[0] * case


def main() -> None:
    """Print the rows."""
    for row in ratios():
        print(f"{row.what:<58} {row.ours_us:>8.0f} us {row.reference_us:>8.0f} us {row.ratio:>6.3g}  {row.verdict}")


if __name__ == "__main__":
    main()
