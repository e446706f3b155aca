"""``tsm-fmu report``: one page on a folder of results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .app import AsJson, app, print_json


@app.command("report")
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of identify, simulate, run, sweep, diagnose.")],
    as_json: AsJson = False,
) -> None:
    """Write DIR/index.html: the cards, runs, sweep and diagnosis of a folder on one page."""
    from ..verbs.report import write_folder_report

    page = write_folder_report(folder)
    if as_json:
        print_json({"report": str(page)})
    else:
        typer.echo(page)
