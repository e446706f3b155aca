"""``python -m benchmarks.planted``: plant each effect, diagnose, print the table."""

from __future__ import annotations

import argparse
import sys

from .catalogue import catalogue, first_of_each
from .judge import judged


def main(words: list[str] | None = None) -> int:
    """Run; the exit code is 1 when an effect is not named."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.planted", description=__doc__)
    parser.add_argument("--effect", action="append", default=[], help="only this one; repeatable")
    parser.add_argument("--model", action="append", default=[], help="only in this one; repeatable")
    parser.add_argument("--first", action="store_true", help="one model and place an effect, as in the test suite")
    chosen = parser.parse_args(words)
    cases = [
        case for case in (first_of_each() if chosen.first else catalogue())
        if case.effect in (chosen.effect or [case.effect]) and case.model in (chosen.model or [case.model])
    ]  # fmt: skip
    if not cases:
        parser.error("no such case")
    print(f"{'effect':<22} {'model':<18} {'place':<9} {'verdict':<12} {'right':<5} {'CPU s':>6}  answer")
    right = 0
    for case in cases:
        found = judged(case)
        right += found.right
        print(
            f"{case.effect:<22} {case.model:<18} {case.channel or 'friction':<9} {found.verdict:<12} "
            f"{'yes' if found.right else 'NO':<5} {found.seconds:>6.1f}  {', '.join(found.answer)}",
            flush=True,
        )
    print(f"{right} of {len(cases)} right")
    return 0 if right == len(cases) else 1


if __name__ == "__main__":
    sys.exit(main())
