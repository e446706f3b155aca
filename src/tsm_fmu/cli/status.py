"""What a verb is doing, on stderr; on a terminal only."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console

__all__ = ["status"]


@contextmanager
def status(verb: str) -> Iterator[Callable[[str], None]]:
    """A line that changes with each text it is told; nothing where stderr is no terminal."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    with Console(stderr=True).status(verb) as line:
        yield lambda text: line.update(f"{verb}: {text}")
