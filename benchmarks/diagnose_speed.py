"""Time of a diagnosis with all candidates: ten runs of 20 000 samples, by step and against the number of samples.

``python -m benchmarks.diagnose_speed`` prints this alone. The rig is one of `blind.plants` with an effect hidden,
so that the search goes all the way to a name. Kernels are compiled before the clock starts, as in every use but the
first. What a user waits for besides (FMU, replay, report) is printed beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from tsm_fmu.diagnosis.report.write import write_diagnosis
from tsm_fmu.diagnosis.result import Diagnosis
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record, read_record

from .blind.catalogue import Case
from .blind.generate import SAMPLE, make

RUNS, ROWS, TARGET_S = 10, 20_000, 60.0
KINDS = ("sines", "strokes", "chirp", "work_rest", "nested")
SHORTER = (5_000, 10_000)
CASE = Case("A", "TendonDrive", ("capstan",), 0.1, tuple(KINDS[k % len(KINDS)] for k in range(RUNS)), (),
            duration=ROWS * SAMPLE, seed=977)  # fmt: skip
STEPS = {
    "gate": "gate", "model": "baseline", "refit of": "baseline", "screen": "linear step of all candidates",
    "refit with ": "refit with each of the best", "runs left": "runs left out in turn, floors, what the log can show",
    "refit without": "answer without idle freedom", "locate": "locate",
}  # fmt: skip


def lines() -> Iterator[str]:
    """The table, as it is measured."""
    made = make(CASE)
    with TemporaryDirectory() as name:
        folder = Path(name)
        records = []
        for log, frame in made.runs.items():
            frame.to_csv(folder / log, index=False, float_format="%.8g")
            records.append(read_record(folder / log))
        _timed(records, SHORTER[0], made.values)  # compiles
        yield f"diagnosis of {CASE.model}, {RUNS} runs, all candidates; target {TARGET_S:.0f} s on 2 cores"
        cost = {}
        for rows in (*SHORTER, ROWS):
            cost[rows], steps, found = _timed(records, rows, made.values)
            named = ", ".join(found.effects) or found.verdict
            times = cost[rows] / cost[SHORTER[0]]
            yield (
                f"  {rows:>6} samples a run: {cost[rows]:>6.1f} s, {times:>4.2f} times that of {SHORTER[0]} for "
                f"{rows / SHORTER[0]:.0f} times the samples ({named} for {', '.join(CASE.hidden)})"
            )
        verdict = "met" if cost[ROWS] <= TARGET_S else "MISSED"
        yield f"  {RUNS} x {ROWS} samples: {cost[ROWS]:.1f} s, target {TARGET_S:.0f} s {verdict}; of these"
        for what, seconds in sorted(steps.items(), key=lambda item: -item[1]):
            yield f"    {what:<54} {seconds:>6.1f} s {100.0 * seconds / cost[ROWS]:>5.0f} %"
        begin = perf_counter()
        write_diagnosis(folder / "out", found)
        yield f"  card, FMU, replay, report: {perf_counter() - begin:.1f} s more"


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
    for line in lines():
        print(line, flush=True)


if __name__ == "__main__":
    main()
