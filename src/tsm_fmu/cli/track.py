"""``tsm-fmu track``: a card and many runs in, what drifts out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..logs.whole_file import check_folder
from .app import AsJson, app, print_json
from .runs import Cutoff, Map, Run, Scale, Start, Stop, read_runs
from .status import status


@app.command("track")
def track(
    card: Annotated[Path, typer.Argument(metavar="CARD", help="The fitted model (TOML).")],
    runs: Run,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for track.json, track.csv and the page.")],
    free: Annotated[
        list[str],
        typer.Option("--free", metavar="P", help="Parameter to follow; repeatable. Else those that single runs tell."),
    ] = [],  # noqa: B006
    by: Annotated[
        str,
        typer.Option(
            "--by",
            metavar="ORDER",
            help="Order in time: 'given'; 'name', day_2 before day_10; 'start', the dates in the logs; or a column, by "
            "its first value.",
        ),
    ] = "given",
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    as_json: AsJson = False,
) -> None:
    """Follow a model's parameters over the runs of a life: which drift or jump, and when."""
    from ..verbs.track import track as follow

    check_folder(out)
    records = read_runs(runs, start, stop, maps, scales)
    with status("track") as progress:
        found = follow(card, records, free=free, by=by, cutoff=cutoff, out=out, progress=progress)
    if as_json:
        print_json(found.as_json())
    else:
        typer.echo(f"{found.summary()}\n\nresults {out / 'track.json'}\nreport  {out / 'report.html'}")
