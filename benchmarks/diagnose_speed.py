"""Time of a diagnosis with all candidates, by step and against the number of samples, and of the first start.

``python -m benchmarks.diagnose_speed`` prints this alone. The rig is one of `blind.plants` with an effect hidden, so
that the search goes all the way to a name. But for the first start, kernels are compiled before the clock starts. What
a user waits for besides (FMU, replay, report) is printed beside it. Seconds mean little on a busy machine: see the CPU.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from tsm_fmu.diagnosis.report.write import write_diagnosis
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.compiled_cache import VARIABLE
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record, read_record

from .blind.catalogue import Case
from .blind.generate import SAMPLE, make

RUNS, ROWS, TARGET_S = 10, 20_000, 15.0
FEW_RUNS, FEW_ROWS, FEW_CPU_S = 5, 10_000, 10.0
FIRST_START_S = 30.0
FIRST = "--first-start"
KINDS = ("sines", "strokes", "chirp", "work_rest", "nested")
SHORTER = (5_000, 10_000)
CASE = Case("A", "TendonDrive", ("capstan",), 0.1, tuple(KINDS[k % len(KINDS)] for k in range(RUNS)), (),
            duration=ROWS * SAMPLE, seed=977)  # fmt: skip
STEPS = {
    "gate": "gate", "model": "baseline", "refit of": "baseline", "screen": "linear step of all candidates",
    "refit with ": "refit with each of the best", "runs left": "runs left out in turn, floors, what the log can show",
    "refit without": "answer without idle freedom", "locate": "locate",
}  # fmt: skip


def lines(*, first_start_only: bool = False) -> Iterator[str]:
    """The table, as it is measured; or the seconds of the first diagnosis of this process alone."""
    made = make(CASE)
    with TemporaryDirectory() as name:
        folder = Path(name)
        records = []
        for log, frame in made.runs.items():
            frame.to_csv(folder / log, index=False, float_format="%.8g")
            records.append(read_record(folder / log))
        if first_start_only:
            begin = process_time()
            wall, *_ = _timed(records[:FEW_RUNS], FEW_ROWS, made.values)
            yield f"{wall:.1f} s, {process_time() - begin:.1f} s of CPU"
            return
        for when, spent in _first_starts():
            yield f"start {when}, {FEW_RUNS} x {FEW_ROWS} samples, target {FIRST_START_S:.0f} s: {spent}"
        _timed(records, SHORTER[0], made.values)  # compiles
        begin = process_time()
        _timed(records[:FEW_RUNS], FEW_ROWS, made.values)
        cpu = process_time() - begin
        met = "met" if cpu <= FEW_CPU_S else "MISSED"
        yield f"{FEW_RUNS} x {FEW_ROWS} samples: {cpu:.1f} s of CPU, target {FEW_CPU_S:.0f} s {met}"
        yield f"diagnosis of {CASE.model}, {RUNS} runs, all candidates; target {TARGET_S:.0f} s on 2 cores"
        cost: dict[int, float] = {}
        cpu, steps = 0.0, {}
        found: Diagnosis | None = None
        for rows in (*SHORTER, ROWS):
            begin = process_time()
            cost[rows], steps, found = _timed(records, rows, made.values)
            cpu = process_time() - begin
            named = ", ".join(found.effects) or found.verdict
            times = cost[rows] / cost[SHORTER[0]]
            yield (
                f"  {rows:>6} samples a run: {cost[rows]:>6.1f} s ({cpu:.1f} s of CPU), {times:>4.2f} times "
                f"that of {SHORTER[0]} for {rows / SHORTER[0]:.0f} times the samples "
                f"({named} for {', '.join(CASE.hidden)})"
            )
        verdict = "met" if cost[ROWS] <= TARGET_S else "MISSED"
        spent = f"{cost[ROWS]:.1f} s ({cpu:.1f} s of CPU)"
        yield f"  {RUNS} x {ROWS} samples: {spent}, target {TARGET_S:.0f} s {verdict}; of these"
        for what, seconds in sorted(steps.items(), key=lambda item: -item[1]):
            yield f"    {what:<54} {seconds:>6.1f} s {100.0 * seconds / cost[ROWS]:>5.0f} %"
        begin = perf_counter()
        assert found is not None
        write_diagnosis(folder / "out", found)
        yield f"  card, FMU, replay, report: {perf_counter() - begin:.1f} s more"


def _first_starts() -> Iterator[tuple[str, str]]:
    """Seconds of the same in new processes, with more and more of what was compiled before to be found."""
    first = "benchmarks.diagnose_speed", FIRST
    with TemporaryDirectory() as cache:
        yield "with nothing compiled", _printed(cache, *first)
    with TemporaryDirectory() as cache:
        _printed(cache, "tsm_fmu.kernels.precompile")
        yield "after precompile", _printed(cache, *first)
        yield "the second time", _printed(cache, *first)


def _printed(cache: str, *words: str) -> str:
    """What a module prints that keeps its compiled forms in a folder."""
    environment = {**os.environ, VARIABLE: cache}
    command = [sys.executable, "-m", *words]
    return subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout.strip()


def _timed(records: Sequence[Record], rows: int, values: dict[str, float]) -> tuple[float, dict[str, float], Diagnosis]:
    """Seconds in all, seconds by step, and the answer."""
    runs, steps_seen = [_first(r, rows) for r in records], [("gate", perf_counter())]
    found = diagnose(
        kernel(CASE.model), runs, values=values, progress=lambda text: steps_seen.append((text, perf_counter()))
    )
    end = perf_counter()
    steps: dict[str, float] = {}
    for (text, begin), (_, until) in zip(steps_seen, [*steps_seen[1:], ("", end)], strict=True):
        step = next((what for start, what in STEPS.items() if text.startswith(start)), text)
        steps[step] = steps.get(step, 0.0) + until - begin
    return end - steps_seen[0][1], steps, found


def _first(record: Record, rows: int) -> Record:
    return replace(
        record, time=record.time[:rows], columns={name: values[:rows] for name, values in record.columns.items()}
    )


def main() -> None:
    """Print the table."""
    for line in lines(first_start_only=FIRST in sys.argv):
        print(line, flush=True)


if __name__ == "__main__":
    main()
