"""The logs of the da Vinci instrument: runs, splits, thinning, and errors by channel."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tsm_fmu.checking import check_record
from tsm_fmu.identification.fit import Fit, fit
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.logs.record import Record, read_record
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.specification import fit_run, search_space

FloatArray = NDArray[np.float64]

SETTLED = 2.5
"""Seconds of start-up in each run that are simulated and not scored."""
THINNED = 8
"""Fits see every so-many-th sample (125 Hz of 1 kHz): the models step exactly. All samples are judged."""


@dataclass(frozen=True)
class Log:
    """One run: the record and what was commanded."""

    record: Record
    frequency: float
    load: float

    @cached_property
    def disturbed(self) -> tuple[tuple[float, float], ...]:
        """Spans [s] that the data gate calls a disturbance."""
        return tuple((f.t0, f.t1) for f in check_record(self.record).findings if f.kind == "disturbance")

    def scored(self, clean: bool = False) -> NDArray[np.bool_]:
        """Samples that count; with ``clean``, without the disturbed spans."""
        t = self.record.time
        keep = t > SETTLED
        for t0, t1 in self.disturbed if clean else ():
            keep &= (t < t0) | (t > t1)
        return keep


Logs = Mapping[str, Log]


@dataclass(frozen=True)
class Split:
    """Runs that are fitted and runs that are judged."""

    name: str
    fitted: Logs
    held_out: Logs


def data_folder() -> Path:
    """Folder that contains the tools' folders, whether it is there or not."""
    root = os.environ.get("TSM_FMU_DATA") or Path(__file__).parents[2] / "shared" / "data"
    return Path(root) / "davinci"


def read_logs(folder: Path, only: Callable[[str], bool] = lambda _: True) -> Logs:
    """All runs of a tool, or those whose number is wanted."""
    with (folder / "runs.csv").open(encoding="utf-8", newline="") as table:
        rows = [row for row in csv.DictReader(table) if only(row["run"])]
    return {row["run"]: _log(folder, row) for row in rows}


def _log(folder: Path, row: Mapping[str, str]) -> Log:
    frequency, load = float(row["header_frequency [Hz]"]), float(row["load_current_command [A]"])
    return Log(read_record(folder / f"{row['run']}.csv.gz"), frequency, load)


def splits(logs: Logs) -> list[Split]:
    """Ways to divide the runs of T4L4, from interpolation to extrapolation."""
    names = sorted(logs)

    def split(name: str, out: Callable[[str], bool]) -> Split:
        return Split(name, {n: logs[n] for n in names if not out(n)}, {n: logs[n] for n in names if out(n)})

    def loads(*out: float) -> Callable[[str], bool]:
        return lambda n: logs[n].load in out

    def frequencies(*out: float) -> Callable[[str], bool]:
        return lambda n: logs[n].frequency in out

    return [
        split("every third run out", lambda n: int(n) % 3 == 2),
        split("loads 0.3, 0.6, 0.9 A out", loads(0.3, 0.6, 0.9)),
        split("lowest and highest load out", loads(0.1, 1.0)),
        split("frequencies 0.2, 0.4 Hz out", frequencies(0.2, 0.4)),
        split("frequency 0.1 Hz out", frequencies(0.1)),
        split("frequency 0.5 Hz out", frequencies(0.5)),
    ]


def fit_runs(model: Kernel, logs: Logs, channels: Sequence[str], thin: int = THINNED) -> list[FitRun]:
    """Runs as a fit takes them, thinned."""
    runs = [fit_run(model, log.record, channels) for log in logs.values()]
    return [FitRun(r.name, *(np.ascontiguousarray(a[::thin]) for a in (r.time, r.inputs, r.targets))) for r in runs]


def fit_from(
    model: Kernel,
    start: Mapping[str, float],
    free: Collection[str],
    runs: Sequence[FitRun],
    channels: Sequence[str],
    at_most: Mapping[str, float] | None = None,
) -> Fit:
    """Fit of the parameters named from one physical start: the many starts of `fit` take minutes for so many.

    ``at_most`` holds bounds of the user, in SI, beside those of the model.
    """
    fixed = [v.name for v in model.parameters if v.name not in free]
    space = search_space(model, None, start, fixed)
    for name, hi in (at_most or {}).items():
        space = space.with_bounds(next(v.field for v in model.parameters if v.name == name), hi=hi)
    return fit(model, runs, channels, space, single_start=True)


def values_of(found: Fit) -> dict[str, float]:
    """All values of a fit by public name."""
    return {v.name: found.parameters[v.field].value for v in found.kernel.parameters}


def rmse(
    model: Kernel, values: Mapping[str, float], logs: Logs, channels: Sequence[str], clean: bool = False
) -> FloatArray:
    """Error of each channel in SI, pooled over all scored samples of the runs at full rate."""
    total, count = np.zeros(len(channels)), 0
    p = model.params(None, values)
    columns = [[v.name for v in model.outputs].index(c) for c in channels]
    for log in logs.values():
        run = fit_run(model, log.record, channels)
        error = (model.simulate(p, run.time, run.inputs)[:, columns] - run.targets)[log.scored(clean)]
        total, count = total + np.sum(error**2, axis=0), count + error.shape[0]
    return np.sqrt(total / count)
