"""``tsm-fmu diagnose``: where model and measurement disagree, and which effect is missing."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from ..logs.record import cutoff_note
from ..models.contract import InputError
from ..verbs.models import chosen_model
from .app import app, number_settings, print_json, settings
from .runs import Cutoff, Holdout, Map, Measured, Scale, Start, Stop, read_runs

if TYPE_CHECKING:
    from ..diagnosis.result import Diagnosis


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
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Find the effect that a model misses; nothing, or "cannot tell", are answers too."""
    from ..diagnosis.report.write import write_diagnosis
    from ..diagnosis.workflow import diagnose as find

    chosen = chosen_model(model)
    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out} -- expected a folder, this is a file -- choose another name")
    values = chosen.values | number_settings(settings(set_))
    chosen.kernel.params(chosen.preset or None, values)
    records = read_runs([*measured, *reference, *holdout], start, stop, maps, scales)
    split = len(measured) + len(reference)
    used, references, held = records[: len(measured)], records[len(measured) : split], records[split:]
    console = Console(stderr=True)
    status = console.status("diagnose") if sys.stderr.isatty() else None

    def progress(text: str) -> None:
        if status is not None:
            status.update(f"diagnose: {text}")

    if status is not None:
        status.start()
    try:
        found = find(
            chosen.kernel, used, values=values, preset=chosen.preset or None, fixed=chosen.fixed, reference=references,
            holdout=held, cutoff=cutoff, seed=seed, progress=progress,
        )  # fmt: skip
        progress("card, FMU, report")
        data = write_diagnosis(out, found)
    finally:
        if status is not None:
            status.stop()
    for note in cutoff_note(cutoff, records, [v.name for v in chosen.kernel.inputs]):
        typer.echo(note, err=True)
    if as_json:
        print_json(data)
    else:
        _print(found, data)


def _print(found: Diagnosis, data: dict[str, Any]) -> None:
    console = Console()
    console.print(data["answer"], soft_wrap=True)
    if found.candidates:
        table = Table("effect", "score [dB]", "closes, measured", "closes, held out")
        table.title, table.title_justify = "Each candidate alone: what it closes of what a refit leaves", "left"
        for c in found.candidates:
            closes = ["" if x is None else f"{x:.3f}" for x in (c.closure_measured, c.closure_holdout)]
            table.add_row(c.spec, f"{c.score:.1f}", *closes)
        console.print(table)
    if found.hidden:
        console.print(f"These runs could not show: {', '.join(found.hidden)}.")
    if found.unplaced:
        console.print(f"No place in the model with these channels: {', '.join(found.unplaced)}.")
    for note in found.notes:
        console.print(f"Note: {note}.")
    console.print(f"report {data['report']}", soft_wrap=True)
