"""Native units that are built to be run here need the library of this machine alone."""

import platform
import sys

from tsm_fmu.fmu.native.zig import PLATFORMS


def loaded_here(fmi: int = 2) -> tuple[str, ...]:
    """Folder of the library that this machine loads; empty, which means all of them, where there is none for it.

    Parameters
    ----------
    fmi : int
        2 or 3.
    """
    system = {"linux": "linux", "win32": "windows", "darwin": "macos"}.get(sys.platform)
    processor = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    return tuple(
        p.folders[fmi] for p in PLATFORMS if fmi in p.folders and p.target.split("-")[:2] == [processor, system]
    )
