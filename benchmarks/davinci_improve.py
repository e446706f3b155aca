"""From the plain estimator to a good one, effect after effect, as `diagnose --improve` finds them, on da Vinci logs.

    python -m benchmarks.davinci_improve [--every N [--first K]] [SPLIT ...]

SPLIT is a part of a split's name, as "third"; without one, all six. ``--every N`` fits every N-th of the fitted runs,
from the first or from run ``--first K``, counted from 0.
Beside each stands the chain of `davinci_estimator`, written by hand, fitted to the same runs.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tsm_fmu.diagnosis.answer.improvement import improvement_of
from tsm_fmu.diagnosis.choice.path import way_to_a_better_model
from tsm_fmu.diagnosis.runs.prepared import prepared
from tsm_fmu.diagnosis.workflow import task_of
from tsm_fmu.kernels.kernel import kernel

from . import davinci_estimator
from .davinci_data import SETTLED, Logs, Split, data_folder, read_logs, splits

SHOWN = {"x_out": 180.0 / np.pi, "tau_out": 1e3}


def table(split: Split, every: int, first: int) -> Iterator[str]:
    """The way of one split, in degrees and mN.m, and what is said at its end."""
    model = kernel("DistalEstimator")

    def settled(logs: Logs) -> list:
        return [log.record.window(SETTLED) for log in logs.values()]

    fitted = dict(list(split.fitted.items())[first::every])
    begin = time.process_time()
    runs = prepared(model, settled(fitted), [], settled(split.held_out), None)
    way = way_to_a_better_model(runs, task_of(runs, {}, None, ()))
    found = improvement_of(way, runs, (), (), "", 0)
    seconds = time.process_time() - begin
    count = f"{len(runs.measured)} runs fitted, {len(runs.holdout)} held out"
    yield f"| {split.name}, {count} | measured | left out | held out |"
    yield "| --- | ---: | ---: | ---: |"
    for step in found.steps:
        errors = map(_shown, (step.measured, step.left_out, step.holdout))
        yield f"| {step.added or 'refitted'} | {' | '.join(errors)} |"
    by_hand = davinci_estimator.error(davinci_estimator.fitted(fitted)[0], split.held_out)
    yield f"| by hand, from the same runs | | | {_shown(dict(zip(SHOWN, by_hand, strict=True)))} |"
    yield ""
    yield found.text
    yield f"{seconds:.0f} s of CPU"


def _shown(errors: Mapping[str, float]) -> str:
    return ", ".join(f"{factor * errors[c]:.3g}" for c, factor in SHOWN.items())


def main(words: Sequence[str]) -> int:
    """Print the tables wanted."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.davinci_improve", description=__doc__)
    parser.add_argument("split", nargs="*", help="part of a split's name")
    parser.add_argument("--every", type=int, default=1, help="fit every N-th of the fitted runs")
    parser.add_argument("--first", type=int, default=0, help="begin with run K of these, less than N")
    wanted = parser.parse_args(words)
    if not 0 <= wanted.first < wanted.every:
        parser.error(f"--first {wanted.first} with --every {wanted.every} -- expected 0 or more, less than N")
    folder = data_folder() / "T4L4"
    if not folder.is_dir():
        print(f"no {folder} -- set TSM_FMU_DATA to the folder that contains davinci/", file=sys.stderr)
        return 2
    for split in splits(read_logs(folder)):
        if not wanted.split or any(part in split.name for part in wanted.split):
            print(*table(split, wanted.every, wanted.first), "", sep="\n", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
