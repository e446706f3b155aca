"""The MSSP 2015 loop at 1 kHz in each master, the same FMUs and steps, in total and per FMU step; many loops at once.

*Total* is from the ``.ssp`` to the last value, loading included and without the start of Python; *stepping* the steps
alone. Ours records all outputs at every step, the others keep the last value only (FMPy records too).
``python -m benchmarks.master_speed`` prints the table; ``--seconds`` of simulated time, 100 without it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import System
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios import mssp_feedforward

from .masters import MASTERS, run
from .ratio import Ratio

STEP = 1e-3
CASE = "periodic.b065_law_1"
FLAVOURS = ("native", "python")
LINEAR = 1.3
"""Most that a unit step may cost more in a hundred loops than in ten."""


def loop(flavour: str, folder: Path) -> System:
    """The loop with FMUs of a flavour."""
    for model in mssp_feedforward.FMUS:
        build_fmu(kernel(model), folder / flavour, flavour=flavour)
    fmus = {model: folder / flavour / f"{model}.fmu" for model in mssp_feedforward.FMUS}
    return mssp_feedforward.cases(fmus)[CASE][0]


def many(system: System, copies: int) -> System:
    """Copies of a system side by side."""
    components = [replace(c, name=f"{c.name}_{k}") for k in range(copies) for c in system.components]
    connections = [
        replace(
            c,
            source=c.source.replace(".", f"_{k}."),
            target=c.target.replace(".", f"_{k}."),
        )
        for k in range(copies)
        for c in system.connections
    ]
    return System(tuple(components), tuple(connections), f"{copies} loops")


def ratios(seconds: float = 100.0) -> Iterator[Ratio]:
    """Ours beside each other master, per FMU step; at most 1."""
    steps = round(seconds / STEP)
    with TemporaryDirectory() as name:
        folder = Path(name)
        for flavour in FLAVOURS:
            system = loop(flavour, folder)
            ssp = write_ssp(folder / f"{flavour}.ssp", (system, mssp_feedforward.EXPERIMENT))
            calls = steps * len(system.components)
            ours = run(ssp, "ours", steps, STEP)
            print(
                f"{flavour} units, {len(system.components)} of them, {seconds:g} s at 1 kHz: {ours.seconds:.2f} s, "
                f"{seconds / ours.seconds:.0f} x real time; stepping alone {seconds / ours.stepping:.0f} x"
            )
            for master in MASTERS:
                other = ours if master == "ours" else run(ssp, master, steps, STEP)
                if master == "ours" or other.missing:
                    print(f"{master}: {other.missing}") if other.missing else None
                    continue
                for what in ("seconds", "stepping"):
                    a, b = (getattr(r, what) / calls * 1e6 for r in (ours, other))
                    if b == b:
                        label = "total" if what == "seconds" else what
                        yield Ratio(f"{flavour} units / {master}, {label} per FMU step", a, b, a / b, 1.0)
        yield _linear(loop("native", folder))


def _linear(system: System) -> Ratio:
    """Cost of a unit step with 1000 units beside that with 80; loading is told apart."""
    costs = []
    for copies in (10, 125):
        many_loops, seconds = many(system, copies), []
        for steps in (1000, 5000):
            begin = perf_counter()
            simulate_system(
                many_loops, steps * STEP, STEP, method="jacobi", loops="delay", record=["error_0.y"], compiled=True
            )
            seconds.append(perf_counter() - begin)
        units = len(many_loops.components)
        costs.append((seconds[1] - seconds[0]) / 4000 / units * 1e6)
        print(f"{units} units: {seconds[0]:.2f} s with 1000 steps, {costs[-1]:.3f} us a unit step")
    return Ratio("native units / 1000 beside 80, per unit step", costs[1], costs[0], costs[1] / costs[0], LINEAR)


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=100.0)
    for row in ratios(parser.parse_args().seconds):
        print(
            f"{row.what:<58} {row.ours_us:>8.3f} us {row.reference_us:>8.3f} us {row.ratio:>6.3g}  {row.verdict}",
            flush=True,
        )


if __name__ == "__main__":
    main()
