"""Sections of text, tables and figures, written as one HTML file that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from ..logs.whole_file import write_whole
from .embed import Plots, rendered
from .figures import Figure


@dataclass(frozen=True)
class Table:
    """A table; cells are text or numbers, numbers are right-aligned and shown as given by `format_number`."""

    heading: Sequence[str]
    rows: Sequence[Sequence[Any]]
    caption: str = ""


@dataclass(frozen=True)
class Section:
    """One heading with a text (paragraphs split at blank lines), tables and figures in this order."""

    title: str
    text: str = ""
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()


def write_report(
    path: Path,
    title: str,
    summary: str,
    sections: Sequence[Section],
    provenance: Mapping[str, Any] | None = None,
    proof: Figure | None = None,
) -> Path:
    """Write the report and return its path.

    Parameters
    ----------
    path : Path
        The HTML file; its folder is made.
    title, summary : str
        Heading and the answer in one or two sentences, shown on top.
    sections : sequence of Section
        In reading order.
    provenance : mapping, optional
        What produced the numbers: version, inputs with hashes, seed; shown at the end.
    proof : Figure, optional
        The picture that proves the answer, shown below it; without it the first figure of the sections, which is then
        not shown twice.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    first = proof or next((figure for section in sections for figure in section.figures), None)
    plots = Plots()
    page = rendered(
        "page.html",
        title=title,
        summary=summary,
        proof=_placed(plots, first) if first else [],
        sections=[
            {
                "title": section.title,
                "paragraphs": [p for p in section.text.split("\n\n") if p.strip()],
                "tables": [cells(table) for table in section.tables],
                "figures": [_placed(plots, figure) for figure in section.figures if figure is not first],
            }
            for section in sections
            if section.text or section.tables or any(figure is not first for figure in section.figures)
        ],
        provenance=dict(provenance or {}),
        scripts=plots.scripts(),
    )
    return write_whole(path, page)


def format_number(value: Any) -> str:
    """Text of a cell: floats to five significant digits, everything else as it is."""
    if isinstance(value, float):
        return f"{value:.5g}"
    return "" if value is None else str(value)


def cells(table: Table) -> dict[str, Any]:
    """A table as ``table.html`` draws it."""
    rows = [[(format_number(c), isinstance(c, (int, float))) for c in row] for row in table.rows]
    return {"heading": table.heading, "rows": rows, "caption": table.caption}


def _placed(plots: Plots, figure: Figure) -> list[Markup]:
    return [plots.place(plot) for plot in figure.plots()]
