"""``tsm-fmu batch``: identify, diagnose or track many rigs of one table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .app import AsJson, app, print_result, refuse_failures
from .systems import Scheduler, Workers


@app.command("batch")
def batch(
    verb: Annotated[str, typer.Argument(metavar="identify|diagnose|track", help="What is done for each rig.")],
    model: Annotated[str, typer.Argument(metavar="MODEL[:PRESET][+EFFECT...]|CARD", help="The same for all rigs.")],
    table: Annotated[
        Path,
        typer.Option("--table", metavar="CSV", help="A row a rig: rig, measured, holdout, reference."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for rigs.parquet, page, folders.")],
    fix: Annotated[list[str], typer.Option(metavar="P", help="identify: parameter not fitted; repeatable.")] = [],  # noqa: B006
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same results.")] = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Fit, diagnose or track every rig of a table: one table out; a rig that fails stops nothing."""
    from ..verbs.batch import batch as over_rigs

    options: dict[str, Any] = {} if verb == "track" else {"seed": seed}
    if verb == "identify":
        options["fixed"] = fix
    result = over_rigs(
        verb, model, table, out=out, workers=workers, scheduler=scheduler, progress=not as_json,
        notes=lambda line: typer.echo(line, err=True), **options,
    )  # fmt: skip
    print_result(result, result.failures, as_json)
    refuse_failures(result, result.rigs, "rigs")
