"""The MSSP 2015 loop at 1 kHz in each master, the same FMUs and steps, in total and per FMU step; many loops at once.

*Total* is from the ``.ssp`` to the last value, loading included and without the start of Python; *stepping* the steps
alone. Ours records all outputs at every step, the others keep the last value only (FMPy records too). The first run
of ours on a machine compiles its loop, once for all systems; what that costs is printed and in no row.
``python -m benchmarks.master_speed`` prints the table; ``--seconds`` of simulated time (`SECONDS` without it).
"""

from __future__ import annotations

import argparse
import math
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

from .masters import MASTERS, run, stepping
from .ratio import Ratio

STEP = 1e-3
CASE = "periodic.b065_law_1"
SECONDS = {"native": 100.0, "python": 50.0}
"""Simulated, by flavour of the FMUs."""
LINEAR = 1.5
"""Most that a unit step may cost more with 1000 units, which the processor's caches do not hold, than with 80."""


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


def ratios(simulated: float | None = None) -> Iterator[Ratio]:
    """Ours beside each other master, per FMU step; at most 1."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        for flavour, usual in SECONDS.items():
            seconds = simulated or usual
            steps = round(seconds / STEP)
            system = loop(flavour, folder)
            ssp = write_ssp(folder / f"{flavour}.ssp", (system, mssp_feedforward.EXPERIMENT))
            calls = steps * len(system.components)
            first, again = (run(ssp, "ours", 10, STEP).seconds for _ in range(2))
            print(f"{flavour} units: {first:.2f} s for 10 steps the first time here, {again:.2f} s the next")
            ours = run(ssp, "ours", steps, STEP)
            print(
                f"{flavour} units, {len(system.components)} of them, {seconds:g} s at 1 kHz: {ours.seconds:.2f} s, "
                f"{seconds / ours.seconds:.0f} x real time; stepping alone {seconds / ours.stepping:.0f} x"
            )
            for master in MASTERS:
                if master == "ours":
                    continue
                other = run(ssp, master, steps, STEP)
                if other.missing:
                    print(f"{master} does not load here: {other.missing}")
                    continue
                for what, name in (("total", "seconds"), ("stepping", "stepping")):
                    a, b = (getattr(r, name) / calls * 1e6 for r in (ours, other))
                    if math.isfinite(b):
                        yield Ratio(f"{flavour} units / {master}, {what} per FMU step", a, b, a / b, 1.0)
        yield _linear(loop("native", folder))


def _linear(system: System) -> Ratio:
    """Cost of a unit step with 1000 units beside that with 80; loading is told apart."""
    costs = []
    for copies, steps in ((10, 50_000), (125, 4000)):
        many_loops = many(system, copies)
        begin = perf_counter()
        with stepping() as spent:
            simulate_system(many_loops, steps * STEP, STEP, loops="delay", record=["error_0.y"], compiled=True)
        total, units = perf_counter() - begin, len(many_loops.components)
        costs.append(sum(spent) / steps / units * 1e6)
        print(f"{units} units: {costs[-1]:.3f} us a unit step, {total - sum(spent):.2f} s to load and wire them")
    return Ratio("native units / 1000 beside 80, per unit step", costs[1], costs[0], costs[1] / costs[0], LINEAR)


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=None)
    for row in ratios(parser.parse_args().seconds):
        print(
            f"{row.what:<58} {row.ours_us:>8.3f} us {row.reference_us:>8.3f} us {row.ratio:>6.3g}  {row.verdict}",
            flush=True,
        )


if __name__ == "__main__":
    main()
