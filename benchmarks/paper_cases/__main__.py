"""``python -m benchmarks.paper_cases``: diagnose every case, print the tables; exit code 1 when an answer differs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios import mssp_feedforward

from . import lebus, mmt, mssp
from .case import Answer, answered

HEAD = (
    f"{'paper':<10} {'hidden':<24} {'held-out gap, of given':<23} {'answer':<11} effects\n"
    f"{'':<10} {'':<24} {'refit / answer':<23}"
)


def line(answer: Answer) -> str:
    """Row of a case."""
    case, (refitted, after) = answer.case, answer.gap
    mark = "" if answer.met else f"  EXPECTED {case.expected}"
    gap = f"{refitted:.3f} / {after:.3f}"
    return f"{case.paper:<10} {case.hidden:<24} {gap:<23} {answer.verdict:<11} {', '.join(answer.effects) or '-'}{mark}"


def answers(out: Path) -> Iterator[tuple[Answer, list[mssp.Tracked]]]:
    """All cases, one after the other, with the errors of the loop where there is one."""
    (out / "fmus").mkdir(parents=True, exist_ok=True)
    fmus = {name: build_fmu(kernel(name), out / "fmus" / f"{name}.fmu") for name in mssp_feedforward.FMUS}
    for name in mssp.rigs():
        yield mssp.worked(name, fmus, out / name)
    yield answered(mmt.case(out / "mmt"), out / "mmt" / "diagnosis"), []
    for name in lebus.RIGS:
        folder = out / f"lebus_{name}"
        yield answered(lebus.case(name, folder), folder / "diagnosis"), []


def main(words: list[str] | None = None) -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper_cases", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/paper_cases"), help="folder for logs and diagnoses")
    out = parser.parse_args(words).out
    print(HEAD)
    loops, missed = [], False
    for answer, tracked in answers(out):
        print(line(answer), flush=True)
        loops += [(answer.case.hidden, t) for t in tracked]
        missed |= not answer.met
    print(f"\n{'loop of MSSP 2015':<24} {'compensator':<20} error peak to peak [deg]: periodic, non-periodic")
    for hidden, t in loops:
        periodic, other = (t.peak_to_peak[m] for m in mssp_feedforward.MOTIONS)
        print(f"{hidden:<24} {t.compensator:<20} {periodic:>26.2f}, {other:.2f}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
