"""The same systems at every point of a grid of start values, and the table of what came out."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import islice, product
from pathlib import Path
from typing import Any

import numpy as np

from ..logs.plain_json import finite
from ..logs.table import write_table
from ..models.contract import InputError
from .cases import Quantities, flat, run_cases, statistics, with_values
from .master import simulate_system
from .metric import Metric
from .ssp import Case
from .start_values import typed_value
from .system import check_system
from .trajectory import SimulationInterrupted, SimulationStopped, Trajectory

MOST_POINTS = 100_000
TABLES = ("csv", "parquet")
"""Endings of the table, which is written once for people and once for programs."""


@dataclass(frozen=True)
class Axis:
    """One varied start value: ``component.variable``, its unit (1 where the FMU declares none), and its values."""

    name: str
    unit: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Point:
    """One point of the grid.

    Attributes
    ----------
    values : mapping of str to float
        By the names of the axes.
    metrics : mapping of str to Metric
        By name (`cases.flat`); empty if the run failed.
    failed : str
        Why it did; empty if it did not.
    """

    values: Mapping[str, float]
    metrics: Mapping[str, Metric]
    failed: str = ""


def grid(cases: Mapping[str, Case], varied: Mapping[str, Sequence[float]]) -> list[Axis]:
    """Axes whose values every system accepts by name and type.

    Raises
    ------
    InputError
        No such component or variable, a value of another type, or more points than are sensible.
    """
    axes = []
    for name, values in varied.items():
        component, _, variable = name.partition(".")
        changed = with_values(cases, {name: str(values[0])})
        system = next(s for s, _ in changed.values() if component in {c.name for c in s.components})
        port = check_system(system).descriptions[component].ports[variable]
        for value in values:
            typed_value(name, port, value)
        axes.append(Axis(name, port.unit or "1", tuple(values)))
    points = size(axes)
    if points > MOST_POINTS:
        raise InputError(f"{points} points -- expected at most {MOST_POINTS} -- take fewer values a parameter")
    return axes


def size(axes: Sequence[Axis]) -> int:
    """Number of points of the grid."""
    return math.prod(len(axis.values) for axis in axes)


Values = Mapping[str, float]
"""Values of a point by the names of the axes."""
Compute = Callable[[Values], Point]


def sweep(
    cases: Mapping[str, Case],
    axes: Sequence[Axis],
    *,
    record: Sequence[str] | None = None,
    quantities: Quantities | None = None,
    simulate: Callable[..., Trajectory] = simulate_system,
    begin: int = 0,
    mapped: Callable[[Compute, Iterable[Values]], Iterator[Point]] = map,
) -> Iterator[Point]:
    """Run all cases at every point, the last axis fastest; a point that fails says why and the rest goes on.

    Parameters
    ----------
    cases : mapping of str to Case
    axes : sequence of Axis
        From `grid`.
    record, quantities, simulate
        As in `run_cases` and `statistics`.
    begin : int
        Number of the first point that is run.
    mapped : callable
        ``map``, here or on a cluster (`cluster`).
    """
    names = [axis.name for axis in axes]
    points = islice(product(*(axis.values for axis in axes)), begin, None)
    compute = partial(computed, cases, record, quantities, simulate)
    return mapped(compute, (dict(zip(names, values, strict=True)) for values in points))


def computed(
    cases: Mapping[str, Case],
    record: Sequence[str] | None,
    quantities: Quantities | None,
    simulate: Callable[..., Trajectory],
    at: Values,
) -> Point:
    """Run all cases at one point."""
    changed = with_values(cases, {name: repr(value) for name, value in at.items()})
    try:
        runs = run_cases(changed, record=record, simulate=simulate)
    except SimulationInterrupted as stopped:
        raise KeyboardInterrupt from stopped
    except SimulationStopped as stopped:
        return Point(at, {}, str(stopped))
    return Point(at, flat(statistics(changed, runs, quantities)))


def units(points: Sequence[Point]) -> dict[str, str]:
    """Unit of every number that some point has, by name."""
    return {name: metric.unit for point in points for name, metric in point.metrics.items()}


def as_json(name: str, axes: Sequence[Axis], points: Sequence[Point], results: Path | None) -> dict[str, Any]:
    """The object of ``sweep.json``; ``results`` is the table beside it."""
    return {
        "system": name,
        "complete": len(points) == size(axes),
        "vary": {axis.name: {"unit": axis.unit, "values": axis.values} for axis in axes},
        "points": [asdict(point) for point in points],
        "results": str(results) if results is not None else None,
    }


def write_sweep(out: Path, name: str, axes: Sequence[Axis], points: Sequence[Point]) -> dict[str, Any]:
    """Write ``sweep.csv``, ``sweep.parquet`` and ``sweep.json`` and return the object of the latter.

    Rows are points; a failed one has its values and empty numbers. A sweep that was interrupted is marked
    ``incomplete`` in both file names; a whole one removes those.
    """
    whole = len(points) == size(axes)
    stem = "sweep" if whole else "sweep.incomplete"
    found = units(points)
    header = [*(f"{axis.name} [{axis.unit}]" for axis in axes), *(f"{name} [{unit}]" for name, unit in found.items())]
    columns = [np.array([p.values[axis.name] for p in points]) for axis in axes]
    columns += [np.array([p.metrics[name].value if name in p.metrics else np.nan for p in points]) for name in found]
    data = as_json(name, axes, points, out / f"{stem}.csv")
    for ending in TABLES:
        write_table(out / f"{stem}.{ending}", header, columns)
    (out / f"{stem}.json").write_text(json.dumps(finite(data), indent=2) + "\n", encoding="utf-8")
    for ending in (*TABLES, "json") if whole else ():
        (out / f"sweep.incomplete.{ending}").unlink(missing_ok=True)
    return data
