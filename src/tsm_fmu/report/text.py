"""Tables as text: for summaries, logs and pipes, with every name whole, and for notebooks as they are."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

from tabulate import tabulate


def preformatted(text: str) -> str:
    """A text as HTML that shows it line by line, as a terminal does."""
    return f"<pre>{html.escape(text, quote=False)}</pre>"


def text_table(heading: Sequence[str], rows: Sequence[Sequence[Any]], title: str = "") -> str:
    """A table in plain text.

    Parameters
    ----------
    heading : sequence of str
    rows : sequence of sequence
        Numbers are shown with five significant digits and aligned to the right; None is an empty cell.
    title : str
        A line above; none without it.
    """
    cells = [[_cell(value) for value in row] for row in rows]
    numeric = [all(isinstance(row[k], (int, float, type(None))) for row in rows) for k in range(len(heading))]
    align = ["right" if is_number else "left" for is_number in numeric]
    table = tabulate(cells, list(heading), tablefmt="simple", disable_numparse=True, colalign=align if rows else None)
    return f"{title}\n{table}" if title else table


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.5g}" if isinstance(value, float) else str(value)
