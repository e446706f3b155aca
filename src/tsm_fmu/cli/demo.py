"""``tsm-fmu demo``: the whole story on shipped data."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .app import AsJson, app, print_json


@app.command("demo")
def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for all results.")] = Path("out/demo"),
    as_json: AsJson = False,
) -> None:
    """Build the FMUs, run the paper's loop, fit the sample log, replay its FMU, write a report."""
    from ..verbs.demo import run_demo

    report = run_demo(out, lambda line: typer.echo(f"demo: {line}", err=True))
    if as_json:
        print_json({"report": str(report)})
    else:
        typer.echo(report)
