"""``tsm-fmu sweep``: a scenario or an SSP at every point of a grid of start values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import typer

from ..models.contract import InputError
from .app import AsJson, app, print_json, settings
from .systems import TIME_LIMIT, Case, Folder, Isolate, Jacobi, Loops, Step, StopTime, System, TimeLimit, Values


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
    loops: Loops = None,
    isolate: Isolate = None,
    time_limit: TimeLimit = TIME_LIMIT,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Run on the workers of this Dask scheduler.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Co-simulate at every point of a grid: sweep.csv, sweep.json and a report."""
    from ..verbs.sweep import sweep as sweep_system

    settled, varied = settings(values), _varied(vary)
    if both := [name for name in varied if name in settled]:
        raise InputError(f"--vary and --set {both[0]} -- expected one of them -- drop the --set")
    result = sweep_system(
        what, varied, out=out, values=settled, case=case, stop=stop, step=step, jacobi=jacobi, loops=loops,
        isolate=isolate, scheduler=scheduler,
        time_limit=time_limit, progress=not as_json, notes=lambda line: typer.echo(line, err=True),
    )  # fmt: skip
    for line in result.failures:
        typer.echo(line, err=True)
    if as_json:
        print_json(result.as_json())
    else:
        typer.echo(f"{result.summary()}\nresults {result.results}\nreport  {result.report}")
    if result.failures:
        raise InputError(
            f"{len(result.failures)} of {len(result.points)} points failed -- expected none -- see the lines above; "
            f"the others are in {result.results}"
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
