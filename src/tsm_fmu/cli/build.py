"""``tsm-fmu build``: FMUs of the models."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from ..kernels.kernel import kernel
from ..models import MODELS
from ..models.contract import InputError
from .app import app, print_json


class Flavour(StrEnum):
    """How the FMU runs its kernel."""

    PYTHON = "python"
    NATIVE = "native"


def check_flavour(flavour: Flavour, fmi: int) -> None:
    """Raise `InputError` for a flavour and FMI version that cannot be built."""
    if fmi not in (2, 3):
        raise InputError(f"--fmi {fmi} -- expected 2 or 3 -- choose one")
    if flavour is Flavour.NATIVE:
        raise InputError("--flavour native -- it is not available yet -- use --flavour python")
    if fmi == 3:
        raise InputError("--flavour python with --fmi 3 -- PythonFMU writes FMI 2.0 only -- use --fmi 2")


@app.command("build")
def build(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME ...]", help="Models; default all.")] = None,
    flavour: Annotated[Flavour, typer.Option(help="How the FMU runs.")] = Flavour.PYTHON,
    fmi: Annotated[int, typer.Option(help="FMI version, 2 or 3.")] = 2,
    out: Annotated[Path, typer.Option(help="Folder for the FMUs.")] = Path("fmus/dist"),
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Build the FMUs of models."""
    from ..fmu.build import build_fmu

    check_flavour(flavour, fmi)
    kernels = [kernel(name) for name in names or [module.NAME for module in MODELS]]
    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file -- expected a folder -- choose another")
    built = {k.name: str(build_fmu(k, out)) for k in kernels}
    if as_json:
        print_json({"fmus": built})
    else:
        for path in built.values():
            typer.echo(path)
