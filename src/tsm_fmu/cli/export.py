"""``tsm-fmu export``: a model card in, an FMU out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..card import read_card
from .app import app, print_json
from .build import Flavour, check_flavour
from .outputs import check_output_file


@app.command("export")
def export(
    card: Annotated[Path, typer.Argument(metavar="CARD", help="Model card (TOML).")],
    out: Annotated[Path, typer.Option(metavar="X.fmu", help="FMU to write.")],
    flavour: Annotated[Flavour, typer.Option(help="How the FMU runs.")] = Flavour.PYTHON,
    fmi: Annotated[int, typer.Option(help="FMI version, 2 or 3.")] = 2,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Make an FMU whose start values are those of a model card."""
    from ..verbs.export import export as write_fmu

    check_flavour(flavour, fmi)
    check_output_file(out, (".fmu",))
    model = read_card(card)
    path = write_fmu(model, out)
    if as_json:
        kernel = model.kernel()
        print_json({"fmu": str(path), "model": kernel.name, "parameters": kernel.named(model.params())})
    else:
        typer.echo(path)
