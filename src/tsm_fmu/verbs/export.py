"""``export``: a fitted model as an FMU."""

from __future__ import annotations

import os
from pathlib import Path

from ..fmu.build import build_fmu
from .models import ModelLike, resolve_model


def export(model: ModelLike, path: str | os.PathLike[str], *, flavour: str = "native", fmi: int = 2) -> Path:
    """Make an FMU whose start values are those of a fitted model.

    Parameters
    ----------
    model : str, path, ModelCard, Kernel or result
        A model card or what has one; a bare model gives its defaults.
    path : str or Path
        The ``.fmu`` file.
    flavour : str
        ``"native"``: C, which needs nothing of its host; ``"python"``: PythonFMU, which needs Python there.
    fmi : int
        2 or 3; the Python flavour has 2 only.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    InputError
        An unknown flavour or version, a card that cannot be read, a value out of bounds, or a file that cannot be
        written.
    """
    resolved = resolve_model(model)
    return build_fmu(
        resolved.kernel, Path(path), start_values=resolved.kernel.named(resolved.params()), flavour=flavour, fmi=fmi
    )
