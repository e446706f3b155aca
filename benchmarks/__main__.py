"""Print one table of ratios, limits and verdicts; exit code 1 when a limit is missed."""

from __future__ import annotations

import sys
from itertools import chain

from . import fmu_cost, identify_speed, kernel_vs_c


def main() -> int:
    """Measure and print row by row."""
    print(f"{'what':<46} {'ours':>9} {'reference':>9} {'ratio':>6} {'limit':>6}  verdict")
    missed = False
    for row in chain(kernel_vs_c.ratios(), fmu_cost.ratios(), identify_speed.ratios()):
        print(
            f"{row.what:<46} {row.ours_us:>6.3f} us {row.reference_us:>6.3f} us {row.ratio:>6.3g} {row.limit:>6.3g}  "
            f"{row.verdict}",
            flush=True,
        )
        missed |= row.ratio > row.limit
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
