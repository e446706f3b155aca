"""Sections of text, tables and figures, written as one HTML file that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
from jinja2 import Environment, StrictUndefined
from plotly.offline import get_plotlyjs

from ..models.contract import InputError


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
    figures: Sequence[go.Figure] = ()


def write_report(
    path: Path, title: str, summary: str, sections: Sequence[Section], provenance: Mapping[str, Any] | None = None
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

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    page = _template().render(
        title=title,
        summary=summary,
        sections=[
            {
                "title": section.title,
                "paragraphs": [p for p in section.text.split("\n\n") if p.strip()],
                "tables": [_cells(table) for table in section.tables],
                "figures": [_figure_html(figure) for figure in section.figures],
            }
            for section in sections
        ],
        provenance=dict(provenance or {}),
        plotly_js=get_plotlyjs() if any(section.figures for section in sections) else "",
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page, encoding="utf-8")
    except OSError as failure:
        raise InputError(
            f"report {path} -- could not be written ({failure.strerror}) -- choose another --out"
        ) from None
    return path


def format_number(value: Any) -> str:
    """Text of a cell: floats to five significant digits, everything else as it is."""
    if isinstance(value, float):
        return f"{value:.5g}"
    return "" if value is None else str(value)


def _cells(table: Table) -> dict[str, Any]:
    rows = [[(format_number(c), isinstance(c, (int, float))) for c in row] for row in table.rows]
    return {"heading": table.heading, "rows": rows, "caption": table.caption}


def _figure_html(figure: go.Figure) -> str:
    return figure.to_html(
        full_html=False, include_plotlyjs=False, config={"responsive": True, "displaylogo": False}, default_width="100%"
    )


@cache
def _template() -> Any:
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(files("tsm_fmu.report").joinpath("page.html").read_text(encoding="utf-8"))
