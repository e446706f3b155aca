"""``tsm-fmu sweep``: a scenario or an SSP at every point of a grid of start values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Column, Table

from .. import __version__
from ..models.contract import InputError
from .app import app, print_json, settings
from .systems import TIME_LIMIT, Case, Folder, Isolate, Jacobi, Step, StopTime, System, TimeLimit, Values, opened

SHOWN = 4
"""Columns of numbers that the terminal shows; the files have all."""


@app.command("sweep")
def sweep(
    what: System,
    vary: Annotated[
        list[str],
        typer.Option("--vary", metavar="COMPONENT.VARIABLE=A:B:N", help="N values from A to B; repeatable: a grid."),
    ],
    out: Folder,
    values: Values = [],  # noqa: B006  typer reads it
    case: Case = [],  # noqa: B006
    stop: StopTime = None,
    step: Step = None,
    jacobi: Jacobi = False,
    isolate: Isolate = None,
    time_limit: TimeLimit = TIME_LIMIT,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Not available yet: runs are in this process.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Co-simulate at every point of a grid: sweep.csv, sweep.json and a report."""
    from ..cosim import sweep as sweeping
    from ..cosim.master import bar
    from ..cosim.point_file import PointFile
    from ..cosim.sweep_report import sweep_section
    from ..report import write_report
    from ..reproduction.write import make_folder

    if scheduler is not None:
        raise InputError(f"--scheduler {scheduler} -- expected none, it is not available yet -- leave it out")
    settled, varied = settings(values), _varied(vary)
    if both := [name for name in varied if name in settled]:
        raise InputError(f"--vary and --set {both[0]} -- expected one of them -- drop the --set")
    with opened(what, out, settled, case, stop, step, jacobi, isolate, time_limit) as system:
        axes = sweeping.grid(system.cases, varied)
        make_folder(out)
        file = PointFile(out / "sweep.points.jsonl", system.cases, axes, system.record)
        points = file.points
        if points:
            typer.echo(f"{len(points)} of {sweeping.size(axes)} points kept from a sweep that did not end", err=True)
        try:
            with bar(not as_json, f"sweep {system.name}", sweeping.size(axes)) as advance:
                for point in sweeping.sweep(
                    system.cases,
                    axes,
                    record=system.record,
                    quantities=system.quantities,
                    simulate=system.simulate,
                    begin=len(points),
                ):
                    file.add(point)
                    advance(len(points))
        except KeyboardInterrupt:
            if not points:
                raise
            kept = sweeping.write_sweep(out, system.name, axes, points)
            raise KeyboardInterrupt(f"interrupted; {len(points)} points kept in {kept['results']}") from None
    file.finish()
    failed = [point for point in points if point.failed]
    if len(failed) == len(points):
        raise InputError(f"all {len(points)} points failed, the first: {points[0].failed}")
    data = sweeping.write_sweep(out, system.name, axes, points)
    section = sweep_section(data)
    report = write_report(out / "report.html", section.title, section.text, [section], {"tsm-fmu": __version__})
    for point in failed:
        at = ", ".join(f"{name} = {value:g}" for name, value in point.values.items())
        typer.echo(f"{at}: {point.failed}", err=True)
    if as_json:
        print_json({**data, "report": str(report)})
    else:
        _print(data)
        typer.echo(f"results {data['results']}\nreport  {report}")
    if failed:
        raise InputError(
            f"{len(failed)} of {len(points)} points failed -- expected none -- see the lines above; the others are in "
            f"{data['results']}"
        )


def _varied(texts: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """Values by name from ``name=a:b:n``, evenly spaced, both ends included."""
    import numpy as np

    from ..cosim.sweep import MOST_POINTS

    found = {}
    for name, text in settings(texts, "--vary").items():
        try:
            first, last, number = text.split(":")
            a, b, n = float(first), float(last), int(number)
        except ValueError:
            a, b, n = math.nan, math.nan, 0
        if not (math.isfinite(a) and math.isfinite(b) and n >= 2 and a != b):
            raise InputError(
                f"--vary {name}={text} -- expected A:B:N, two different finite numbers and 2 or more points -- for "
                "example load.k=0.05:0.2:4"
            )
        if n > MOST_POINTS:
            raise InputError(f"--vary {name}={text} -- expected at most {MOST_POINTS} points -- take fewer")
        found[name] = tuple(np.linspace(a, b, n).tolist())
    return found


def _print(data: Mapping[str, Any]) -> None:
    metrics = list(dict.fromkeys(key for point in data["points"] for key in point["metrics"]))
    table = Table(*(Column(heading, overflow="fold") for heading in (*data["vary"], *metrics[:SHOWN])))
    for point in data["points"]:
        numbers = [f"{point['metrics'][key]:.5g}" if key in point["metrics"] else "failed" for key in metrics[:SHOWN]]
        table.add_row(*(f"{v:.5g}" for v in point["values"].values()), *numbers)
    Console().print(table)
