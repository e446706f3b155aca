"""The plots that reports use: something over time, a loop of output over input, means with intervals."""

from __future__ import annotations

import html
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..logs.display import display
from ..logs.whole_file import write_whole
from .embed import Plot, single_page
from .panel import Band, Cells, Line, Panel, Span, Steps

BAR_PIXELS, AXIS_PIXELS = 30, 50
"""Height of a bar with the room about it, and of the axis below."""


@dataclass(frozen=True)
class Figure:
    """A plot of one or several panels. A notebook shows it as it is; `write` makes a page of it.

    Attributes
    ----------
    title : str
    panels : tuple of Panel
    common_x : bool
        Panels stand below one another and zoom along x together; else each is on its own, side by side where there
        is room.
    """

    title: str
    panels: tuple[Panel, ...]
    common_x: bool = False

    @property
    def lines(self) -> tuple[Line, ...]:
        """The lines of all panels."""
        return tuple(line for panel in self.panels for line in panel.lines)

    def plots(self) -> list[Plot]:
        """What is drawn as one piece each."""
        if self.common_x:
            return [Plot(self.title, self.panels)]
        return [Plot(panel.title or self.title, (panel,)) for panel in self.panels]

    def page(self) -> str:
        """A page of it alone, which needs no network."""
        return single_page(self.title, self.plots())

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write a page that needs no network and return its path."""
        return write_whole(path, self.page())

    def _repr_html_(self) -> str:
        height = 110 + sum(panel.height for panel in self.panels)
        page = html.escape(self.page())
        return f'<iframe srcdoc="{page}" title="{html.escape(self.title)}" width="100%" height="{height}"></iframe>'


def band_figure(bands: Sequence[Band], title: str, x_label: str, y_label: str) -> Figure:
    """Means over a coordinate with their intervals."""
    return Figure(title, (Panel(x_label, y_label, bands=bands, height=380),))


def bar_figure(groups: Mapping[str, Mapping[str, float]], title: str, accent: Collection[str] = ()) -> Figure:
    """Bars one below the other; a plot with an axis of its own for each group, whose name says its unit.

    Parameters
    ----------
    groups : mapping of str to mapping of str to float
        Heights by the bars' names.
    title : str
    accent : collection of str
        Names of bars that stand out.
    """
    panels = [
        Panel(title=f"{title}: {name}", bars=bars, accent=accent, height=BAR_PIXELS * len(bars) + AXIS_PIXELS)
        for name, bars in groups.items()
    ]
    return Figure(title, tuple(panels))


def time_figure(lines: Sequence[Line], title: str, unit: str) -> Figure:
    """Lines over time [s]; ``unit`` is that of the vertical axis."""
    return Figure(title, (Panel("time [s]", unit, lines=lines),))


def loop_figure(lines: Sequence[Line], title: str, x_label: str, y_label: str) -> Figure:
    """Lines of one quantity over another, as in a hysteresis loop."""
    return Figure(title, (Panel(x_label, y_label, lines=lines, height=420),))


def histogram_figure(values: ArrayLike, title: str, x_label: str, y_label: str) -> Figure:
    """How often values occur."""
    counts, edges = np.histogram(np.asarray(values, dtype=float), bins="auto")
    return Figure(title, (Panel(x_label, y_label, steps=Steps(edges, counts), height=260),))


def map_figure(
    values: ArrayLike, title: str, x_label: str, y_label: str, columns: Sequence[str], rows: Sequence[str]
) -> Figure:
    """A value for each column and row as a colour; ``values`` has shape (rows, columns), NaN where there is none."""
    return Figure(title, (Panel(x_label, y_label, cells=Cells(values, columns, rows), height=420),))


def channels_figure(
    time: ArrayLike,
    columns: Mapping[str, ArrayLike],
    units: Mapping[str, str],
    title: str,
    marked: Sequence[tuple[float, float, str, str]] = (),
) -> Figure:
    """Channels over time [s], one below the other on a common axis.

    Parameters
    ----------
    time : array_like, shape (n,)
    columns : mapping of str to array_like, shape (n,)
    units : mapping of str to str
        SI unit of each column; angles are drawn in degrees, lengths in millimetres.
    title : str
    marked : sequence of (float, float, str, str)
        Spans to shade: begin and end [s], channel (all where it is none of the columns), word.
    """
    panels = []
    for number, (name, values) in enumerate(columns.items()):
        show = display(units[name])
        line = Line(name, time, show.factor * np.asarray(values, dtype=float), colour=number)
        spans = tuple(Span(a, b, word) for a, b, channel, word in marked if channel not in columns or channel == name)
        panels.append(Panel("", f"{name} [{show.unit}]", lines=(line,), spans=spans, height=170))
    if panels:
        last = panels.pop()
        panels.append(Panel("time [s]", last.y_label, lines=last.lines, spans=last.spans, height=210))
    return Figure(title, tuple(panels), common_x=True)
