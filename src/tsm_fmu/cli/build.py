"""``tsm-fmu build``: FMUs of the models."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from ..kernels.kernel import kernel
from ..logs.whole_file import check_folder
from ..models import MODELS
from ..models.contract import InputError
from .app import AsJson, app, print_json


class Flavour(StrEnum):
    """How the FMU runs its kernel."""

    NATIVE = "native"
    PYTHON = "python"
    BOTH = "both"


FLAVOUR_HELP = (
    "How the FMU runs: native (C, nothing needed of the host), python (PythonFMU), or both beside each other."
)


def flavours(flavour: Flavour, fmi: int) -> tuple[str, ...]:
    """Flavours to build.

    Raises
    ------
    InputError
        For a flavour and FMI version that cannot be built.
    """
    if fmi not in (2, 3):
        raise InputError(f"--fmi {fmi} -- expected 2 or 3 -- choose one")
    if fmi == 3 and flavour is not Flavour.NATIVE:
        raise InputError(
            f"--flavour {flavour.value} with --fmi 3 -- PythonFMU writes FMI 2.0 only -- use --flavour native"
        )
    return ("native", "python") if flavour is Flavour.BOTH else (flavour.value,)


def placed(out: Path, flavour: str, among: tuple[str, ...]) -> Path:
    """File of one flavour: beside a native FMU the Python one has its flavour in its name."""
    return out.with_stem(f"{out.stem}_python") if len(among) > 1 and flavour == "python" else out


@app.command("build")
def build(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME ...]", help="Models; default all.")] = None,
    flavour: Annotated[Flavour, typer.Option(help=FLAVOUR_HELP)] = Flavour.PYTHON,
    fmi: Annotated[int, typer.Option(help="FMI version, 2 or 3.")] = 2,
    out: Annotated[Path, typer.Option(help="Folder for the FMUs.")] = Path("fmus/dist"),
    as_json: AsJson = False,
) -> None:
    """Build the FMUs of models."""
    from ..fmu.build import build_fmu

    wanted = flavours(flavour, fmi)
    kernels = [kernel(name) for name in names or [module.NAME for module in MODELS]]
    check_folder(out)
    built: dict[str, list[str]] = {}
    for k in kernels:
        for one in wanted:
            path = build_fmu(k, placed(out / f"{k.name}.fmu", one, wanted), flavour=one, fmi=fmi)
            built.setdefault(k.name, []).append(str(path))
    if as_json:
        print_json({"fmus": {name: paths[0] if len(paths) == 1 else paths for name, paths in built.items()}})
    else:
        for paths in built.values():
            typer.echo("\n".join(paths))
