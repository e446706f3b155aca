"""Report of a sweep: every number over the values that were varied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..report import Line, Section, Table, loop_figure

MOST_FIGURES = 12
"""A scenario of many cases has hundreds of numbers: they are in the table, the first are drawn."""


def sweep_section(data: Mapping[str, Any]) -> Section:
    """Section on the object of ``sweep.json`` (`sweep.write_sweep`)."""
    axes, points = data["vary"], data["points"]
    names = list(axes)
    units = {name: metric["unit"] for point in points for name, metric in point["metrics"].items()}
    rows = [[*point["values"].values(), *(_value(point, name) for name in units)] for point in points]
    heading = [*(f"{n} [{axes[n]['unit']}]" for n in names), *(f"{n} [{unit}]" for n, unit in units.items())]
    tables = [Table(heading, rows, "One row for each point.")]
    failed = [[*p["values"].values(), p["failed"]] for p in points if p["failed"]]
    if failed:
        tables.append(Table([*names, "why it failed"], failed, "Points without a result."))
    text = f"{len(points)} points, {len(failed)} failed; {'complete' if data['complete'] else 'interrupted'}."
    figures = []
    for metric in list(units)[:MOST_FIGURES] if len(names) < 3 else ():
        varied = f"{names[0]} [{axes[names[0]]['unit']}]"
        figures.append(loop_figure(_lines(points, names, metric), metric, varied, units[metric]))
    return Section(f"Sweep of {data['system']}", text, tables, figures)


def _lines(points: list[Mapping[str, Any]], names: list[str], metric: str) -> list[Line]:
    """The metric over the first axis, one line for each value of the second."""
    groups: dict[str, list[tuple[float, float]]] = {}
    for point in points:
        value = _value(point, metric)
        others = ", ".join(f"{n} = {point['values'][n]:.5g}" for n in names[1:])
        groups.setdefault(others or metric, []).append(
            (point["values"][names[0]], float("nan") if value is None else value)
        )
    return [Line(name, *np.array(values).T) for name, values in groups.items()]


def _value(point: Mapping[str, Any], name: str) -> float | None:
    return point["metrics"].get(name, {}).get("value")
