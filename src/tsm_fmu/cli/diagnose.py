"""``tsm-fmu diagnose``: where model and measurement disagree, and which effect is missing."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .app import AsJson, app, number_settings, settings
from .runs import Cutoff, Holdout, Map, Measured, Scale, Start, Stop, read_runs
from .status import status


@app.command("diagnose")
def diagnose(
    model: Annotated[str, typer.Argument(metavar="MODEL[:PRESET]|CARD", help="The model that disagrees.")],
    measured: Measured,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for diagnosis.json, card, FMU and report.")],
    reference: Annotated[
        list[Path], typer.Option("--reference", metavar="RUN", help="Run without the missing effect; repeatable.")
    ] = [],  # noqa: B006
    holdout: Holdout = [],  # noqa: B006
    set_: Annotated[list[str], typer.Option("--set", metavar="P=V", help="Parameter value [SI]; repeatable.")] = [],  # noqa: B006
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same result.")] = 0,
    drive: Annotated[
        list[str],
        typer.Option(
            metavar="COLUMN=ROLE", help="What a column drives: load, bend, temperature, position, none; repeatable."
        ),
    ] = [],  # noqa: B006
    improve: Annotated[
        bool,
        typer.Option(
            "--improve", help="Then add what makes runs left out come out better, named or not: improved.toml."
        ),
    ] = False,
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    as_json: AsJson = False,
) -> None:
    """Find the effect that a model misses; nothing, or "cannot tell", are answers too."""
    from ..verbs.diagnose import diagnose as find

    records = read_runs([*measured, *reference, *holdout], start, stop, maps, scales)
    split = len(measured) + len(reference)
    with status("diagnose") as progress:
        found = find(
            model,
            records[: len(measured)],
            reference=records[len(measured) : split],
            holdout=records[split:],
            values=number_settings(settings(set_)),
            cutoff=cutoff,
            seed=seed,
            drive=settings(drive, "--drive"),
            improve=improve,
            out=out,
            progress=progress,
        )
    if as_json:
        typer.echo((out / "diagnosis.json").read_text(encoding="utf-8"), nl=False)
    else:
        typer.echo(f"{found.summary()}\n\nreport {out / 'report.html'}")
    if not found.complete:
        raise KeyboardInterrupt(f"interrupted on the way to a better model; the diagnosis is kept in {out}")
