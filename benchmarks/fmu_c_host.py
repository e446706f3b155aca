"""Cost of set + doStep + get in a host written in C, against a PythonFMU FMU with an empty do_step.

There PythonFMU's library makes a new Python thread state at each call; our slave keeps it, so ours costs less than an
FMU that does nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import fmpy

from system_tests import c_host
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel

from .fmu_cost import empty_fmu
from .ratio import Ratio

LIMIT = 0.5
STEPS, ROUNDS = 4000, 9
MODELS = ("PairedTsmBacklash", "TendonDrive")


def ratios() -> Iterator[Ratio]:
    """One ratio per model; none, and a line that says why, where there is no host."""
    with TemporaryDirectory(prefix="tsm_fmu_bench_") as name:
        folder = Path(name)
        try:
            c_host.libpython()
            program = c_host.compiled(folder)
        except c_host.Missing as missing:
            print(f"FMU in a C host: not measured, {missing}")
            return
        for model in MODELS:
            k = kernel(model)
            ours, empty = (_runs(program, path) for path in (build_fmu(k, folder), empty_fmu(k, folder)))
            pairs = [(ours(), empty()) for _ in range(ROUNDS)]
            a, b = (median(pair[i] for pair in pairs) for i in (0, 1))
            yield Ratio(f"{model} in a C host: set + doStep + get", a, b, median(x / y for x, y in pairs), LIMIT)


def _runs(program: Path, fmu: Path) -> Callable[[], float]:
    """A function that steps the FMU in a new process and returns the CPU time per step [us]."""
    unpacked = Path(fmpy.extract(str(fmu), str(fmu.with_suffix(""))))
    described = fmpy.read_model_description(str(unpacked), validate=False)  # the empty one has no InitialUnknowns
    first = {v.causality: v.valueReference for v in reversed(described.modelVariables) if v.type == "Real"}

    def run() -> float:
        done = c_host.run(program, unpacked, f"threads=1,{STEPS},{first['input']},{first['output']}")
        if done.returncode or not done.stdout.startswith("thread 0 "):
            raise RuntimeError(f"{fmu.stem} in the C host: {done.stdout}{done.stderr}")
        return float(done.stdout.split()[2])

    return run
