"""Panels like those of the papers: several small plots of one run in one figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from ..report import Line, loop_figure
from ..report.figures import COLOURS


def plot(lines: Sequence[Line], title: str, x_label: str, y_label: str) -> go.Figure:
    """One panel; thinning and styles as everywhere in the reports."""
    return loop_figure(lines, title, x_label, y_label)


def panels(figures: Sequence[go.Figure], columns: int = 2) -> go.Figure:
    """Put plots side by side; a name has one colour and one entry of the legend in all of them."""
    rows = -(-len(figures) // columns)
    layouts: list[Any] = [figure.layout for figure in figures]
    together = make_subplots(
        rows,
        columns,
        subplot_titles=[layout.title.text for layout in layouts],
        horizontal_spacing=0.24 / columns,
        vertical_spacing=0.24 / rows,
    )
    colours: dict[str, str] = {}
    for k, (figure, layout) in enumerate(zip(figures, layouts, strict=True)):
        row, column = k // columns + 1, k % columns + 1
        traces: Any = figure.data
        for trace in traces:
            new = trace.name not in colours
            colours.setdefault(trace.name, COLOURS[len(colours) % len(COLOURS)])
            trace.update(x=np.asarray(trace.x, dtype=np.float32), y=np.asarray(trace.y, dtype=np.float32))  # half size
            trace.update(legendgroup=trace.name, showlegend=new, line={"color": colours[trace.name]})
            together.add_trace(trace, row=row, col=column)
        together.update_xaxes(title={"text": layout.xaxis.title.text, "standoff": 6}, row=row, col=column)
        together.update_yaxes(title={"text": layout.yaxis.title.text, "standoff": 4}, row=row, col=column)
    together.update_annotations(font_size=13)
    together.update_layout(
        height=330 * rows + 85,
        template="plotly_white",
        margin={"l": 55, "r": 15, "t": 65, "b": 60},
        legend={"orientation": "h", "yanchor": "top", "y": -60 / (330 * rows), "x": 0},
    )
    return together
