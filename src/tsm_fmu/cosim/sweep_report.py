"""Report of a sweep: maps, distributions and worst cases of its chief numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..report import Figure, Line, Section, Table, bar_figure, histogram_figure, loop_figure, map_figure
from .sweep import in_words, shown

MOST_NUMBERS = 8
"""A scenario of many cases has hundreds of numbers: they are in the table, the chief ones are drawn."""
MOST_LINES, MOST_CELLS, MOST_ROWS = 6, 10_000, 60
"""Lines of a plot, cells of a map, rows of a table; ``sweep.parquet`` has every point."""
LEAST_SHOWN = 8
"""Points that a distribution needs."""


@dataclass(frozen=True)
class SweepTable:
    """The object of ``sweep.json`` as columns.

    Attributes
    ----------
    axes : mapping of str to mapping
        ``unit`` and ``values`` by name.
    at : list of mapping
        Values of each point.
    numbers : mapping of str to ndarray, shape (points,)
        The chief numbers by name; NaN where a point failed.
    units : mapping of str to str
        Of these.
    failed : list of str
        Why a point failed.
    """

    axes: Mapping[str, Mapping[str, Any]]
    at: list[Mapping[str, Any]]
    numbers: Mapping[str, NDArray[np.float64]]
    units: Mapping[str, str]
    failed: list[str]

    def label(self, axis: str) -> str:
        """Name and unit of an axis."""
        unit = self.axes[axis]["unit"]
        return f"{axis} [{unit}]" if unit else axis


def chief_numbers(names: Sequence[str]) -> list[str]:
    """Tracking errors and what the scenario computes itself; where there is neither, how far each signal swings."""
    swings = [n for n in names if n.endswith(".peak_to_peak")]
    own = [n for n in swings if n.endswith("tracking_error.peak_to_peak")]
    own += [n for n in names if n not in own and n.partition("tracking_error.")[1]]
    own += [n for n in names if n.rpartition(".")[2] not in ("mean", "std", "peak_to_peak")]
    return (own or swings or list(names))[:MOST_NUMBERS]


def sweep_table(data: Mapping[str, Any]) -> SweepTable:
    """The columns of the object of ``sweep.json`` (`sweep.write_sweep`)."""
    axes, points = data["vary"], data["points"]
    units = {name: metric["unit"] for point in points for name, metric in point["metrics"].items()}
    chief = chief_numbers(list(units))
    numbers = {name: np.array([_value(point, name) for point in points]) for name in chief}
    return SweepTable(
        axes, [p["values"] for p in points], numbers, {n: units[n] for n in chief}, [p["failed"] for p in points]
    )


def sweep_section(data: Mapping[str, Any]) -> Section:
    """Section on the object of ``sweep.json``: how the numbers go over what was varied."""
    table = sweep_table(data)
    figures = [figure for k, name in enumerate(table.numbers) for figure in _pictures(table, name, chief=k == 0)]
    figures += distributions(table)
    return Section(f"Sweep of {data['system']}", sweep_answer(data), [*worst_tables(table), *_points(table)], figures)


def sweep_answer(data: Mapping[str, Any]) -> str:
    """How many points there are, and where the chief number is worst."""
    table = sweep_table(data)
    failures = sum(map(bool, table.failed))
    state = "complete" if data["complete"] else "interrupted"
    text = f"{len(table.at)} points, {failures} failed; {state}."
    name, values = next(iter(table.numbers.items()), ("", np.empty(0)))
    if np.isfinite(values).any():
        worst = int(np.nanargmax(np.abs(values)))
        text += f" {name} is at worst {values[worst]:.4g} {table.units[name]}, at {in_words(table.at[worst])}."
    return text


def worst_tables(table: SweepTable) -> list[Table]:
    """Spread of each chief number over the points, and where it is worst; the points that failed."""
    rows = []
    for name, values in table.numbers.items():
        good = values[np.isfinite(values)]
        if good.size == 0:
            continue
        worst = int(np.nanargmax(np.abs(values)))
        low, middle, high = np.percentile(good, [5.0, 50.0, 95.0]).tolist()
        rows.append((name, table.units[name], low, middle, high, float(values[worst]), in_words(table.at[worst])))
    heading = ("number", "unit", "5 %", "median", "95 %", "worst", "there")
    tables = [Table(heading, rows, "Over the points: shares of them, and the value furthest from zero.")]
    failed = [(in_words(at), why) for at, why in zip(table.at, table.failed, strict=True) if why]
    if failed:
        tables.append(Table(("failed at", "why"), failed[:MOST_ROWS], _of("Points without a result", len(failed))))
    return tables


def distributions(table: SweepTable) -> list[Figure]:
    """Histograms of the chief numbers, where there are points enough and they differ."""
    good = {name: values[np.isfinite(values)] for name, values in table.numbers.items()}
    return [
        histogram_figure(values, f"Distribution: {name}", f"{name} [{table.units[name]}]", "points")
        for name, values in good.items()
        if values.size >= LEAST_SHOWN and np.ptp(values) > 0.0
    ]


def _points(table: SweepTable) -> list[Table]:
    """The points, the worst of the first number first."""
    if not table.numbers:
        return []
    first = next(iter(table.numbers.values()))
    order = np.argsort(-np.abs(first), kind="stable")  # NaN, which failed, comes last
    heading = [*map(table.label, table.axes), *(f"{name} [{unit}]" for name, unit in table.units.items())]
    rows = [
        [*(shown(v) for v in table.at[k].values()), *(_or_none(float(values[k])) for values in table.numbers.values())]
        for k in order[:MOST_ROWS].tolist()
    ]
    return [Table(heading, rows, _of("Points, the worst of the first number first", len(table.at)))]


def _of(title: str, count: int) -> str:
    return f"{title}." if count <= MOST_ROWS else f"{title}: {MOST_ROWS} of {count}."


def _or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _pictures(table: SweepTable, name: str, chief: bool) -> list[Figure]:
    axes = list(table.axes)
    label = f"{name} [{table.units[name]}]"
    if len(axes) == 1 and not table.axes[axes[0]]["unit"]:
        bars = {shown(at[axes[0]]): float(v) for at, v in zip(table.at, table.numbers[name], strict=True)}
        return [bar_figure({label: bars}, f"Over {axes[0]}")]
    found = []
    for x, y in list(combinations(axes, 2))[: None if chief else 1]:
        if len(table.axes[x]["values"]) * len(table.axes[y]["values"]) <= MOST_CELLS:
            found.append(_map(table, name, x, y))
    if lines := _lines(table, name):
        found.append(loop_figure(lines, f"{name} over {lines_axis(table)}", table.label(lines_axis(table)), label))
    return found


def lines_axis(table: SweepTable) -> str:
    """The axis of numbers with the most values; empty without one."""
    numeric = [axis for axis, about in table.axes.items() if about["unit"]]
    return max(numeric, key=lambda axis: len(table.axes[axis]["values"]), default="")


def _lines(table: SweepTable, name: str) -> list[Line]:
    """A number over one axis, a line for each combination of the others; nothing if those are too many."""
    along = lines_axis(table)
    groups: dict[str, list[tuple[float, float]]] = {}
    for at, value in zip(table.at, table.numbers[name], strict=True) if along else ():
        others = in_words({n: v for n, v in at.items() if n != along})
        groups.setdefault(others or name, []).append((float(at[along]), float(value)))
    if len(groups) > MOST_LINES:
        return []
    return [Line(group, *np.array(values).T) for group, values in groups.items()]


def _map(table: SweepTable, name: str, x: str, y: str) -> Figure:
    """The worst of a number over all other axes, in the plane of two."""
    columns, rows = (list(table.axes[axis]["values"]) for axis in (x, y))
    place = {(c, r): (k, n) for n, c in enumerate(columns) for k, r in enumerate(rows)}
    values = np.full((len(rows), len(columns)), np.nan)
    for at, value in zip(table.at, table.numbers[name], strict=True):
        cell = place[at[x], at[y]]
        if not abs(value) <= abs(values[cell]):  # also where one of them is no number
            values[cell] = value if np.isfinite(value) else values[cell]
    others = [axis for axis in table.axes if axis not in (x, y)]
    title = f"{name} [{table.units[name]}]" + (f", worst over {', '.join(others)}" if others else "")
    texts = ([shown(v) for v in columns], [shown(v) for v in rows])
    return map_figure(values, title, table.label(x), table.label(y), *texts)


def _value(point: Mapping[str, Any], name: str) -> float:
    value = point["metrics"].get(name, {}).get("value")
    return np.nan if value is None else value
