"""``tsm-fmu check``: what is in measured runs, or what their columns may be."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..logs.whole_file import check_folder, write_whole
from ..models.contract import InputError
from .app import AsJson, app, print_json
from .runs import Cutoff, Map, Run, Scale, Start, Stop, read_runs


@app.command("check")
def check(
    runs: Run,
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    as_json: AsJson = False,
    model: Annotated[
        str | None,
        typer.Option("--model", metavar="MODEL", help="Propose a log.toml: what the columns are for a model."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="TOML", help="Write the proposal of --model here.")
    ] = None,
) -> None:
    """Columns, rate, gaps, glitches, quantisation, power sign, coverage: what is in these logs."""
    if model is not None:
        _propose(runs, model, out)
        return
    if out is not None:
        raise InputError(f"--out {out} -- expected --model with it, whose proposal it takes -- add --model MODEL")
    from ..verbs.check import check as check_runs

    result = check_runs(read_runs(runs, start, stop, maps, scales), cutoff=cutoff)
    for note in result.notes:
        typer.echo(note, err=True)
    if as_json:
        print_json(result.as_json())
    else:
        typer.echo(result.summary())


def _propose(runs: list[Path], model: str, out: Path | None) -> None:
    from ..verbs.check import propose

    if len(runs) != 1:
        raise InputError(f"--model with {len(runs)} runs -- expected one, for whose folder it is -- give one run")
    if out is not None:
        if out.exists():
            raise InputError(f"--out {out} exists -- expected a new file -- remove it or choose another name")
        check_folder(out.parent)
    text = propose(runs[0], model).text()
    typer.echo(text, nl=False)
    if out is not None:
        write_whole(out, text)
