"""The C compiler: `ziglang`, a package that brings clang and the libraries of every platform along."""

from __future__ import annotations

import shutil
import sys


def c_compiler() -> tuple[str, ...]:
    """Command of a C compiler for this machine: its own, else zig's."""
    own = shutil.which("gcc") or shutil.which("cc")
    return (own,) if own else (sys.executable, "-m", "ziglang", "cc")
