"""The C host of the tests and benchmarks: its program compiled, the Python that it brings along, and a run of it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import fmpy


class Missing(Exception):
    """What this machine lacks for a host in C, one line."""


def compiled(folder: Path) -> Path:
    """Compile the host and return the program."""
    compiler = shutil.which("cc")
    if not compiler:
        raise Missing("no C compiler here: install gcc")
    flags = ["-O2", "-Wall", "-Wextra", "-Werror"]
    source = Path(__file__).with_name("c_host.c")
    subprocess.run([compiler, *flags, "-o", folder / "c_host", source, "-ldl", "-lpthread"], check=True)
    return folder / "c_host"


def libpython() -> Path:
    """Shared library of the Python that runs this."""
    found = Path(sysconfig.get_config_var("LIBDIR") or "", sysconfig.get_config_var("INSTSONAME") or "none")
    if not found.is_file() or ".so" not in found.name:
        raise Missing(f"this Python has no shared library ({found})")
    return found


def run(
    program: Path, unpacked: Path, *calls: str, python: str | None = None, uri: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Make the calls, as ``c_host.c`` describes them, on an unpacked FMU.

    Parameters
    ----------
    program : Path
        From `compiled`.
    unpacked : Path
        Folder of the FMU.
    python : str, optional
        Shared library of Python; default the one that runs this, ``"-"`` for none.
    uri : str, optional
        Resource location; default that of the folder.
    """
    described = fmpy.read_model_description(str(unpacked), validate=False)
    library = unpacked / f"binaries/linux64/{described.coSimulation.modelIdentifier}.so"  # type: ignore[union-attr]
    location = f"file://{unpacked}/resources" if uri is None else uri
    command = [str(program), python or str(libpython()), str(library), str(described.guid), location, *calls]
    environment = {**os.environ, "PYTHONHOME": sys.base_prefix}
    return subprocess.run(command, capture_output=True, text=True, env=environment)
