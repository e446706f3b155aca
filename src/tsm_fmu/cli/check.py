"""``tsm-fmu check``: what is in measured runs."""

from __future__ import annotations

from typing import Annotated

import typer

from .app import app, print_json
from .runs import Cutoff, Map, Run, Scale, Start, Stop, read_runs


@app.command("check")
def check(
    runs: Run,
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Columns, rate, gaps, glitches, quantisation, power sign, coverage: what is in these logs."""
    from ..verbs.check import check as check_runs

    result = check_runs(read_runs(runs, start, stop, maps, scales), cutoff=cutoff)
    for note in result.notes:
        typer.echo(note, err=True)
    if as_json:
        print_json(result.as_json())
    else:
        typer.echo(result.summary())
