"""``tsm-fmu export``: a model card in, an FMU out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..card import read_card
from .app import AsJson, app, print_json
from .build import FLAVOUR_HELP, Flavour, flavours, placed
from .outputs import check_output_file


@app.command("export")
def export(
    card: Annotated[Path, typer.Argument(metavar="CARD", help="Model card (TOML).")],
    out: Annotated[Path, typer.Option(metavar="X.fmu", help="FMU to write.")],
    flavour: Annotated[Flavour, typer.Option(help=FLAVOUR_HELP)] = Flavour.NATIVE,
    fmi: Annotated[int, typer.Option(help="FMI version, 2 or 3.")] = 2,
    as_json: AsJson = False,
) -> None:
    """Make an FMU whose start values are those of a model card."""
    from ..verbs.export import export as write_fmu

    wanted = flavours(flavour, fmi)
    check_output_file(out, (".fmu",))
    model = read_card(card)
    paths = [str(write_fmu(model, placed(out, one, wanted), flavour=one, fmi=fmi)) for one in wanted]
    if as_json:
        kernel = model.kernel()
        print_json(
            {
                "fmu": paths[0] if len(paths) == 1 else paths,
                "model": kernel.name,
                "parameters": kernel.named(model.params()),
            }
        )
    else:
        typer.echo("\n".join(paths))
