"""``tsm-fmu reproduce``: every figure and number of the five papers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..logs.whole_file import check_folder
from .app import AsJson, app, print_json


@app.command("reproduce")
def reproduce(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for report and tables.")] = Path(
        "reproduction"
    ),
    paper: Annotated[
        list[str], typer.Option("--paper", metavar="KEY", help="This paper only, e.g. mmt2015; repeatable.")
    ] = [],  # noqa: B006  typer reads it
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Fewer values of what is open, short windows: a first look, verdicts are provisional."
        ),
    ] = False,
    flavour: Annotated[
        str, typer.Option(help="How the FMUs run: python (PythonFMU), or native (C): the same numbers in less time.")
    ] = "python",
    as_json: AsJson = False,
) -> None:
    """Every figure and number of the five papers: as printed, ours, verdict, why."""
    from ..reproduction import ReproductionInterrupted, write_reproduction
    from ..reproduction import reproduce as compute
    from ..reproduction.write import as_json as described

    check_folder(out)
    console = Console(stderr=True)

    def progress(what: str) -> None:
        if console.is_terminal:
            console.print(f"computing {escape(what)}")

    try:
        done = compute(paper, quick=quick, flavour=flavour, progress=progress)
    except ReproductionInterrupted as stopped:
        if not stopped.done.results:
            raise
        page = write_reproduction(out, stopped.done, complete=False)["report"]
        raise KeyboardInterrupt(f"interrupted; {', '.join(stopped.done.results)} kept in {page}") from None
    paths = write_reproduction(out, done)
    if as_json:
        print_json({**described(done), **{kind: str(path) for kind, path in paths.items()}})
        return
    table = Table("paper", "item", "quantity", "printed", "ours", "verdict", title_justify="left")
    for claim in done.claims:
        unit = "" if claim.unit in ("", "1") else f" [{claim.unit}]"
        cells = (claim.paper, claim.items[0], claim.quantity + unit, claim.printed, claim.ours, claim.verdict.value)
        table.add_row(*map(escape, cells))
    Console().print(table)
    for verdict, number in done.counts().items():
        typer.echo(f"{number:4d} {verdict}")
    typer.echo(f"{done.co_simulated:4d} of {len(done.claims)} from FMUs in co-simulation")
    typer.echo(f"report {paths['report']}\ntable  {paths['csv']}")
