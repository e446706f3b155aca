"""What every verb that writes one file asks of ``--out``, before the work begins."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ..logs.whole_file import nearest_folder
from ..models.contract import InputError

__all__ = ["check_output_file"]


def check_output_file(
    out: Path, endings: Sequence[str], runs: Sequence[Path] = (), *, make_folder: bool = False, option: str = "--out"
) -> None:
    """Refuse a file to write that could only fail at the end, or that would replace a measured run.

    Parameters
    ----------
    out : Path
        The file to write.
    endings : sequence of str
        How its name may end; a reader goes by it.
    runs : sequence of Path
        Measured runs of the same command.
    make_folder : bool
        Whether a missing folder is made later.
    option : str
        The option that names the file.

    Raises
    ------
    InputError
        Another ending, a folder, a file in a place that cannot be written, or one of the runs.
    """
    if any(out.resolve() == run.expanduser().resolve() for run in runs):
        raise InputError(f"{option} {out} is a measured run -- expected another file, it would be lost -- rename it")
    if not out.name.endswith(tuple(endings)):
        raise InputError(f"{option} {out} -- expected a name that ends in {', '.join(endings)} -- rename it")
    if out.is_dir():
        raise InputError(f"{option} {out} is a folder -- expected a file -- choose another name")
    folder = out.parent
    if not make_folder and not folder.is_dir():
        raise InputError(f"{option} {out} -- expected a folder that exists -- create {folder} first")
    folder = nearest_folder(folder)
    if not (folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)):
        raise InputError(f"{option} {out}: {folder} is no writable folder -- expected one -- choose another place")
