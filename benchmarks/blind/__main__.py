"""``python -m benchmarks.blind``: make the cases, diagnose each, print the tables."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from .catalogue import STRATA, selected
from .generate import write
from .judge import diagnosed
from .score import Scored, rates, scored
from .table import lines, row


def main(words: list[str] | None = None) -> int:
    """Run; the exit code is 1 when a target is missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind", description=__doc__)
    parser.add_argument("--cases", type=int, help="at most so many, spread over the strata; the same ones each time")
    parser.add_argument("--stratum", default=STRATA, help="letters of the strata wanted, for example AF")
    parser.add_argument("--out", type=Path, default=Path("out/blind"), help="folder for logs, answers and diagnoses")
    parser.add_argument("--only-make", action="store_true", help="write the cases and stop")
    parser.add_argument("--again", action="store_true", help="score the diagnoses that are there, run nothing")
    chosen = parser.parse_args(words)
    unknown = sorted(set(chosen.stratum) - set(STRATA))
    if unknown or (chosen.cases is not None and chosen.cases < 1):
        parser.error(f"--stratum letters of {STRATA}, --cases 1 or more")
    cases = selected(chosen.cases, chosen.stratum)
    truth = write(cases, chosen.out)
    if chosen.only_make:
        print(f"{len(cases)} cases in {chosen.out / 'logs'}, truth in {chosen.out / 'answers.json'}")
        return 0
    results: list[Scored] = []
    for case in cases:
        folder = chosen.out / "diagnoses" / case.name
        kept = folder / "answer.json"
        if chosen.again and kept.is_file():
            answer = json.loads(kept.read_text())
        elif chosen.again:
            continue
        else:
            answer = diagnosed(chosen.out / "logs" / case.name, folder)
            kept.write_text(json.dumps(answer) + "\n")
        results.append(scored(case.name, truth[case.name], answer))
        print(row(results[-1]), flush=True)
    if not results:
        print(f"no diagnoses in {chosen.out / 'diagnoses'} -- run without --again first", file=sys.stderr)
        return 2
    print("", *lines(results), sep="\n")
    return 0 if all(r.met is not False for r in rates(results)) else 1


if __name__ == "__main__":
    sys.exit(main())
