"""``tsm-fmu app``: the local page."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from ..models.contract import InputError
from .app import app


@app.command("app")
def local_page(
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0 takes a free one.")] = 8765,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    """Open a local page: drop logs, map columns, fit, diagnose, compare, download. Nothing leaves this machine."""
    try:
        from ..local_page.serve import serve
    except ModuleNotFoundError as missing:
        raise InputError(
            f"tsm-fmu app: {missing.name} is not installed -- expected the extra app -- pip install 'tsm-fmu[app]'"
        ) from None
    with tempfile.TemporaryDirectory(prefix="tsm-fmu-app-") as folder:
        serve(Path(folder), port, lambda address: _tell(address, browser))


def _tell(address: str, browser: bool) -> None:
    typer.echo(f"{address}  (Ctrl-C ends it)")
    if browser:
        typer.launch(address)
