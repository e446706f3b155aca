"""The same systems at many points of start values, cards and FMUs, and the table of what came out."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..batching.kept import digest_of
from ..logs.plain_json import finite
from ..logs.table import write_table
from ..logs.whole_file import remove_earlier, write_whole
from ..models.contract import InputError
from .cases import Quantities, flat, run_cases, statistics, with_values
from .description import describe
from .metric import Metric
from .ssp import Case
from .start_values import typed_value
from .system import check_system
from .trajectory import SimulationInterrupted, Trajectory

MOST_POINTS = 100_000
TABLES = ("csv", "parquet")
"""Endings of the table, which is written once for people and once for programs."""
SEED = "seed"
"""The axis that is for every component with a variable of this name."""
TRACE_ROWS = 400
"""Rows of a signal that is kept of every point."""

Values = Mapping[str, float | str]
"""Values of a point by the names of the axes: numbers, or texts that name a choice."""


@dataclass(frozen=True)
class Axis:
    """What is varied: ``component.variable`` over numbers, or a choice by its texts; ``unit`` is empty for a choice."""

    name: str
    unit: str
    values: tuple[float | str, ...]

    @property
    def heading(self) -> str:
        """Header cell of a table."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Change:
    """What the choices of a point do to the systems: FMUs by component, start values by ``component.variable``."""

    fmus: Mapping[str, Path] = field(default_factory=dict)
    values: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Point:
    """One point.

    Attributes
    ----------
    values : mapping of str to float or str
        By the names of the axes.
    metrics : mapping of str to Metric
        By name (`cases.flat`); empty if the run failed.
    failed : str
        Why it did; empty if it did not.
    trace : mapping of str to tuple of float
        By case: the signal that was asked for, at about `TRACE_ROWS` times.
    """

    values: Values
    metrics: Mapping[str, Metric]
    failed: str = ""
    trace: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @classmethod
    def from_plain(cls, data: Mapping[str, Any]) -> Point:
        """From the mapping that ``asdict`` makes."""
        metrics = {name: Metric(**metric) for name, metric in data["metrics"].items()}
        trace = {case: tuple(values) for case, values in data["trace"].items()}
        return cls(data["values"], metrics, data["failed"], trace)


@dataclass(frozen=True)
class Work:
    """All cases at a point: called with its values, in whichever process; a point that fails says why.

    Attributes
    ----------
    cases : mapping of str to Case
    record, quantities, simulate
        As in `run_cases` and `statistics`.
    changes : mapping of tuple of str to Change
        By the texts of a point in the order of the axes.
    settings : mapping of str to str
        Start values that hold at every point, whatever a choice says.
    traced : str
        ``component.variable`` that is kept of every case that has it; empty: none.
    """

    cases: Mapping[str, Case]
    record: Sequence[str] | None
    quantities: Quantities | None
    simulate: Callable[..., Trajectory]
    changes: Mapping[tuple[str, ...], Change] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)
    traced: str = ""

    def __call__(self, at: Values) -> Point:
        try:
            changed = self.cases_at(at)
            runs = run_cases(changed, record=self.record, simulate=self.simulate)
        except SimulationInterrupted as stopped:
            raise KeyboardInterrupt from stopped
        except InputError as wrong:  # a run that stopped, or a combination that does not fit together
            return Point(at, {}, str(wrong))
        trace = {
            case: tuple(float(v) for v in run.columns[self.traced][trace_rows(run.time.size)])
            for case, run in runs.items()
            if self.traced in run.columns
        }
        return Point(at, flat(statistics(changed, runs, self.quantities)), "", trace)

    def cases_at(self, at: Values) -> dict[str, Case]:
        """The systems at a point."""
        texts = tuple(value for value in at.values() if isinstance(value, str))
        change = self.changes.get(texts, Change())
        cases = with_fmus(self.cases, change.fmus)
        numbers = {name: repr(value) for name, value in at.items() if not isinstance(value, str) and "." in name}
        if SEED in at:
            numbers = {**{name: repr(at[SEED]) for name in seeds(cases)}, **numbers}
        return with_values(cases, {**change.values, **self.settings, **numbers})


def seeds(cases: Mapping[str, Case]) -> list[str]:
    """The variables that the axis `SEED` is for, ``component.seed``; none of a component of that name."""
    components = {c.name: c.fmu for system, _ in cases.values() for c in system.components}
    return [f"{name}.{SEED}" for name, fmu in components.items() if SEED in describe(fmu).ports]


def shown(value: float | str) -> str:
    """A value of an axis as people read it: five digits; of a file its name."""
    return Path(value).name if isinstance(value, str) else f"{value:.5g}"


def in_words(at: Values) -> str:
    """Where a point is."""
    return ", ".join(f"{name} = {shown(value)}" for name, value in at.items())


def trace_rows(size: int) -> slice:
    """Rows of a run that a trace keeps."""
    return slice(None, None, max(1, size // TRACE_ROWS))


def lost(at: Values, reason: str) -> Point:
    """The point whose process is gone."""
    return Point(at, {}, reason)


def with_fmus(cases: Mapping[str, Case], fmus: Mapping[str, Path]) -> dict[str, Case]:
    """Other FMUs for components, in every case that has them."""
    if not fmus:
        return dict(cases)
    found = {}
    for name, (system, experiment) in cases.items():
        components = tuple(replace(c, fmu=fmus.get(c.name, c.fmu)) for c in system.components)
        found[name] = (replace(system, components=components), experiment)
    return found


def numeric_axis(cases: Mapping[str, Case], name: str, values: Sequence[float]) -> Axis:
    """An axis whose values every system accepts by name and type.

    Raises
    ------
    InputError
        No such component or variable, or a value of another type.
    """
    component, _, variable = name.partition(".")
    changed = with_values(cases, {name: str(values[0])})
    system = next(s for s, _ in changed.values() if component in {c.name for c in s.components})
    port = check_system(system).descriptions[component].ports[variable]
    for value in values:
        typed_value(name, port, value)
    return Axis(name, port.unit or "1", tuple(values))


def grid(axes: Sequence[Axis]) -> list[Values]:
    """Points of a grid, the last axis fastest.

    Raises
    ------
    InputError
        More points than are sensible.
    """
    points = math.prod(len(axis.values) for axis in axes)
    if points > MOST_POINTS:
        raise InputError(f"{points} points -- expected at most {MOST_POINTS} -- take fewer values a parameter")
    names = [axis.name for axis in axes]
    return [dict(zip(names, values, strict=True)) for values in product(*(axis.values for axis in axes))]


def identity(work: Work, points: Sequence[Values]) -> object:
    """All that the numbers of a sweep depend on, as plain data."""
    fmus = {c.fmu for system, _ in work.cases.values() for c in system.components}
    fmus |= {fmu for change in work.changes.values() for fmu in change.fmus.values()}
    systems = [
        (
            name,
            [(c.name, c.fmu.name, sorted(c.parameters.items())) for c in system.components],
            [asdict(connection) for connection in system.connections],
            asdict(experiment),
        )
        for name, (system, experiment) in work.cases.items()
    ]
    changes = [
        (*texts, sorted((c, f.name) for c, f in change.fmus.items()), sorted(change.values.items()))
        for texts, change in work.changes.items()
    ]
    digests = sorted((fmu.name, digest_of(fmu)) for fmu in fmus)
    drawn = hashlib.sha256(json.dumps(points).encode()).hexdigest()
    return (__version__, digests, systems, changes, drawn, sorted(work.settings.items()), work.record, work.traced)


def units(points: Sequence[Point]) -> dict[str, str]:
    """Unit of every number that some point has, by name."""
    return {name: metric.unit for point in points for name, metric in point.metrics.items()}


def as_json(
    name: str, axes: Sequence[Axis], points: Sequence[Point], complete: bool, results: Path | None
) -> dict[str, Any]:
    """The object of ``sweep.json``; ``results`` is the table beside it."""
    return {
        "system": name,
        "complete": complete,
        "vary": {axis.name: {"unit": axis.unit, "values": axis.values} for axis in axes},
        "points": [{"values": p.values, "metrics": _plain(p.metrics), "failed": p.failed} for p in points],
        "results": str(results) if results is not None else None,
    }


def _plain(metrics: Mapping[str, Metric]) -> dict[str, Any]:
    return {name: asdict(metric) for name, metric in metrics.items()}


def write_sweep(
    out: Path, name: str, axes: Sequence[Axis], points: Sequence[Point], complete: bool = True, kind: str = "sweep"
) -> dict[str, Any]:
    """Write ``sweep.csv``, ``sweep.parquet`` and ``sweep.json`` and return the object of the latter.

    ``kind`` is another stem of the names.

    Rows are points; a failed one has its values, empty numbers, and why in the last column. A sweep that was
    interrupted is marked ``incomplete`` in both file names; a whole one removes those.
    """
    stem = kind if complete else f"{kind}.incomplete"
    found = units(points)
    header = [*(axis.heading for axis in axes), *(f"{name} [{unit}]" for name, unit in found.items()), "failed"]
    columns: list[Any] = [np.array([p.values[axis.name] for p in points]) for axis in axes]
    columns += [np.array([p.metrics[name].value if name in p.metrics else np.nan for p in points]) for name in found]
    columns.append(np.array([p.failed for p in points]))
    data = as_json(name, axes, points, complete, out / f"{stem}.csv")
    remove_earlier(out, [f"{stem}.{ending}" for ending in (*TABLES, "json")] + ["report.html"])
    for ending in TABLES:
        write_table(out / f"{stem}.{ending}", header, columns)
    write_whole(out / f"{stem}.json", json.dumps(finite(data), indent=2) + "\n")
    for ending in (*TABLES, "json") if complete else ():
        (out / f"{kind}.incomplete.{ending}").unlink(missing_ok=True)
    return data
