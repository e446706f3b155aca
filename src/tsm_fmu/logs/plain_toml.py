"""TOML files within limits: the time that tomllib takes grows with the square of a key's depth."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

LARGEST = 1_000_000
"""Bytes; cards and mappings have some thousands."""
DEEPEST = 30
"""Dots in a key; ours have three."""
_TOO_DEEP = re.compile(rf"(?:[\w\"'-]{{1,80}}[ \t]{{0,4}}\.[ \t]{{0,4}}){{{DEEPEST}}}")


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a file.

    Raises
    ------
    OSError
        It cannot be read.
    ValueError
        It is no regular file, too large, nested too deep, not UTF-8 or not TOML.
    """
    size = path.stat().st_size
    if not path.is_file():
        raise ValueError("a folder, a pipe or a device")
    if size > LARGEST:
        raise ValueError(f"{size} bytes, more than {LARGEST}")
    text = path.read_text(encoding="utf-8-sig")
    if _TOO_DEEP.search(text):
        raise ValueError(f"a key of more than {DEEPEST} parts")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deep") from None
