"""The bar of a running co-simulation or sweep."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter


@contextmanager
def bar(wanted: bool, title: str, steps: int, step: float | None = None) -> Iterator[Callable[[int], None]]:
    """Show a bar on stderr, if that is a terminal; the function that comes is told how many steps are done.

    With the length of a step [s] of simulated time it also says how many times faster than that time passes.
    """
    if not (wanted and sys.stderr.isatty()):
        yield lambda done: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = [TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()]
    if step is not None:
        columns.append(TextColumn("{task.fields[faster]}"))
    began, shown_at = perf_counter(), 0.0
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(title, total=steps, faster="")

        def advance(done: int) -> None:
            nonlocal shown_at
            now = perf_counter()
            if now - shown_at > 0.1:
                shown_at = now
                faster = f"{done * step / (now - began):.3g} x real time" if step is not None else ""
                shown.update(task, completed=done, faster=faster)

        yield advance
