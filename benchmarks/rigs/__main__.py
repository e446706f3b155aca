"""``python -m benchmarks.rigs``: draw rigs with a fresh seed, diagnose each, print what the answers are worth."""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory

from .fresh import commit, fresh_seed, generator_of, judged, ours, theirs
from .outcome import Outcome
from .table import gate_failures, lines, row

CASES = 14


def main(words: list[str] | None = None) -> int:
    """Run; the exit code is 1 where wrong names or false alarms are more than chance."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rigs", description=__doc__)
    parser.add_argument("--cases", type=int, default=CASES, help=f"cases of each author ({CASES})")
    parser.add_argument("--seed", type=int, help="a seed that is burnt already; a fresh one without")
    parser.add_argument("--author", choices=("ours", "third", "both"), default="both")
    parser.add_argument("--generator", help="folder of the third author's rigs.py; else rigs beside $TSM_FMU_DATA")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, help="keep logs and outcomes here")
    chosen = parser.parse_args(words)
    if chosen.cases < 1 or chosen.jobs < 1:
        parser.error("--cases and --jobs 1 or more")
    home = generator_of(chosen.generator)
    if home is None and chosen.generator:
        parser.error(f"--generator {chosen.generator} -- expected a folder with rigs.py")
    if chosen.out is not None and chosen.out.exists() and (chosen.out.is_file() or any(chosen.out.iterdir())):
        parser.error(f"--out {chosen.out} -- expected an empty folder: logs of another seed would be among these")
    seed = fresh_seed() if chosen.seed is None else chosen.seed
    freshness = "fresh" if chosen.seed is None else "given: burnt if it was looked at"
    print(f"seed {seed} ({freshness}), commit {commit() or 'unknown'}", flush=True)
    if home is None and chosen.author != "ours":
        print("the third author's generator is not here (--generator, or rigs beside $TSM_FMU_DATA): left out")
    failed: list[str] = []
    with TemporaryDirectory() as scratch:
        out = chosen.out or Path(scratch)
        for author in ("ours", "third"):
            if chosen.author not in (author, "both") or (author == "third" and home is None):
                continue
            folder = out / author
            folder.mkdir(parents=True, exist_ok=True)
            made = ours(seed, chosen.cases, folder) if home is None or author == "ours" else []
            made = theirs(home, seed, chosen.cases, folder) if author == "third" and home is not None else made
            print(f"\n{author}: {len(made)} cases", flush=True)
            rows: list[Outcome] = []
            # spawned, not forked: simulations may have left threads behind
            with ProcessPoolExecutor(chosen.jobs, multiprocessing.get_context("spawn")) as pool:
                for one in pool.map(judged, made):
                    rows.append(one)
                    print(row(one), flush=True)
            (folder / "outcomes.json").write_text(json.dumps([asdict(r) for r in rows], indent=1) + "\n")
            print("", *lines(rows), sep="\n", flush=True)
            failed += gate_failures(rows)
    if failed:
        print("\nmore wrong names than chance makes of a tool that is right 95 times of 100:", *failed, sep="\n  ")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
