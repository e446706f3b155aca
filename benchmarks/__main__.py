"""Print ratios, limits and verdicts, the time of a diagnosis, and its answers to a part of the blind cases and to rigs
drawn afresh.

The exit code is 1 when a limit of a ratio or a target of the blind cases is missed. All blind cases take more than ten
minutes: ``python -m benchmarks.blind``.
"""

from __future__ import annotations

import sys
from itertools import chain
from tempfile import TemporaryDirectory
from time import perf_counter

from . import (
    diagnose_speed,
    fmu_c_host,
    fmu_cost,
    identify_speed,
    kernel_vs_c,
    master_speed,
    native_step,
    one_form,
    simulation_speed,
    sweep_speed,
)
from .blind import __main__ as blind
from .blind.catalogue import STRATA, catalogue
from .rigs import __main__ as rigs

BLIND_CASES = 4 * len(STRATA)
FRESH_CASES = 2 * len(STRATA)


def main() -> int:
    """Measure and print row by row."""
    begin = perf_counter()
    print(f"{'what':<58} {'ours':>9} {'reference':>9} {'ratio':>6} {'limit':>6}  verdict")
    missed = False
    for row in chain(
        kernel_vs_c.ratios(),
        fmu_cost.ratios(),
        native_step.ratios(),
        one_form.ratios(),
        fmu_c_host.ratios(),
        master_speed.ratios(),
        sweep_speed.ratios(),
        simulation_speed.ratios(),
        identify_speed.ratios(),
    ):
        print(
            f"{row.what:<58} {row.ours_us:>6.3f} us {row.reference_us:>6.3f} us {row.ratio:>6.3g} {row.limit:>6.3g}  "
            f"{row.verdict}",
            flush=True,
        )
        missed |= row.ratio > row.limit
    print()
    diagnose_speed.main()
    print(f"\nblind cases, {BLIND_CASES} of {len(catalogue())} (all: python -m benchmarks.blind)", flush=True)
    with TemporaryDirectory() as folder:
        missed |= blind.main(["--cases", str(BLIND_CASES), "--out", folder]) != 0
    print(f"\nrigs drawn afresh, {FRESH_CASES} of each author", flush=True)
    missed |= rigs.main(["--cases", str(FRESH_CASES)]) != 0
    print(f"{perf_counter() - begin:.0f} s in all")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
