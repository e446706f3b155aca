"""``tsm-fmu validate``: check FMU files with FMPy, fmu-manipulation-toolbox and checks of our own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..models.contract import InputError
from .app import AsJson, app, print_json


@app.command("validate")
def validate(
    fmus: Annotated[list[Path], typer.Argument(metavar="FMU ...", help="FMU files.")],
    as_json: AsJson = False,
) -> None:
    """Check FMU files; exit code 2 when one has a problem."""
    from ..fmu.validate import tools, validate_fmu  # heavy: FMPy

    problems = {str(fmu): validate_fmu(fmu) for fmu in fmus}
    if as_json:
        print_json({"problems": problems, "checked_by": tools()})
    else:
        for fmu, found in problems.items():
            typer.echo(f"{fmu}: {'no problem' if not found else f'{len(found)} problem(s)'}")
            for line in found:
                typer.echo(f"  {line}")
        typer.echo(f"checked by {', '.join(tools())}")
    if bad := [fmu for fmu, found in problems.items() if found]:
        raise InputError(
            f"{len(bad)} of {len(fmus)} FMU files with a problem ({', '.join(bad)}) -- expected none -- see the list"
        )
