"""What a plot shows, as data: lines, bands, bars and what is marked on common axes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from numpy.typing import ArrayLike

COLOURS = ("#2f7fd6", "#d9534f", "#2e9e63", "#b8860b", "#8e63c7", "#7b868f")
"""Of lines in their order; each stands out from white paper and from a dark screen (contrast over 3)."""

MARKED = "#d0453c"
"""Colour of what is marked or printed, in every figure."""


@dataclass(frozen=True)
class Line:
    """One line: name and values; ``dashed`` for what was measured or asked for; ``colour`` keeps one across figures."""

    name: str
    x: ArrayLike
    y: ArrayLike
    dashed: bool = False
    colour: int | None = None


@dataclass(frozen=True)
class Band:
    """Means with an interval, as a line with a shaded band; ``marked``: a point at each mean."""

    name: str
    x: ArrayLike
    mean: ArrayLike
    low: ArrayLike
    high: ArrayLike
    marked: bool = True


@dataclass(frozen=True)
class Points:
    """Single values, in the colour of what is marked."""

    name: str
    x: Sequence[float]
    y: Sequence[float]


@dataclass(frozen=True)
class Span:
    """A part of the x axis to shade, with a word."""

    begin: float
    end: float
    word: str = ""


@dataclass(frozen=True)
class Level:
    """A range of y to shade, dashed in its middle; a line where its ends meet. Without a name it is in no legend."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class Steps:
    """A histogram: counts between edges, one edge more than counts."""

    edges: ArrayLike
    counts: ArrayLike


@dataclass(frozen=True)
class Cells:
    """A map: a value for each column and row (shape rows x columns), NaN where there is none, and their names."""

    values: ArrayLike
    columns: Sequence[str]
    rows: Sequence[str]


@dataclass(frozen=True)
class Panel:
    """One pair of axes and what is drawn on them; bars lie, so that their names can be read, ``accent`` stands out."""

    x_label: str = ""
    y_label: str = ""
    title: str = ""
    lines: Sequence[Line] = ()
    bands: Sequence[Band] = ()
    bars: Mapping[str, float] = field(default_factory=dict)
    accent: Collection[str] = ()
    points: Sequence[Points] = ()
    spans: Sequence[Span] = ()
    levels: Sequence[Level] = ()
    steps: Steps | None = None
    cells: Cells | None = None
    height: int = 320
    y_span: float = 0.0
    """Least height of the vertical axis, in its unit: a smaller range is shown within it, not blown up."""
    log_x: bool = False


def colour(number: int) -> str:
    """Colour of the line with this number."""
    return COLOURS[number % len(COLOURS)]


def legend(panels: Sequence[Panel]) -> list[tuple[str, str, str]]:
    """Name, colour and stroke (``line``, ``dash``, ``point``) of what is drawn, where there is more than one thing.

    Of several panels only where they show the same things; else each is told by its axis.
    """
    entries: list[tuple[str, str, str]] = []
    for panel in panels:
        for number, line in enumerate(panel.lines):
            stroke = "dash" if line.dashed else "line"
            entries.append((line.name, colour(number if line.colour is None else line.colour), stroke))
        entries += [(band.name, colour(number), "line") for number, band in enumerate(panel.bands) if band.name]
        entries += [(level.name, MARKED, "dash") for level in panel.levels if level.name]
        entries += [(points.name, MARKED, "point") for points in panel.points]
    different = list(dict.fromkeys(entries))
    shared = len(panels) == 1 or len(different) < len(entries)
    return different if shared and len(different) > 1 else []
