"""Panels like those of the papers, with what the papers print drawn in: values as points, ranges as bands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ..report import Line, loop_figure
from .printed import Printed

PRINT = "#b3261e"
"""Colour of what is printed, in every figure."""


def plot(
    lines: Sequence[Line],
    title: str,
    x_label: str,
    y_label: str,
    *,
    bands: Iterable[tuple[str, float, float]] = (),
    points: Iterable[tuple[str, Sequence[float], Sequence[float]]] = (),
) -> go.Figure:
    """One panel.

    Parameters
    ----------
    lines : sequence of Line
        Computed, thinned as everywhere in the reports.
    title, x_label, y_label : str
        Axes with their units.
    bands : iterable of (name, low, high)
        Printed ranges of y; those without a name are not in the legend.
    points : iterable of (name, x, y)
        Printed values.
    """
    figure = loop_figure(lines, title, x_label, y_label)
    traces: Any = figure.data
    for trace in traces:
        trace.update(x=np.asarray(trace.x, dtype=np.float32), y=np.asarray(trace.y, dtype=np.float32))  # half the size
    for name, low, high in bands:
        middle, width = 0.5 * (low + high), abs(high - low)
        style = {"fillcolor": PRINT, "opacity": 0.16, "line_width": 0} if width > 0.0 else {}
        if style:
            figure.add_hrect(y0=low, y1=high, **style)
        figure.add_hline(y=middle, line={"color": PRINT, "width": 1, "dash": "dash"})
        if name:
            key = {"mode": "lines", "line": {"color": PRINT, "width": 2, "dash": "dash"}}
            figure.add_trace(go.Scatter(x=[None], y=[None], name=name, **key))
    for name, x, y in points:
        figure.add_trace(
            go.Scatter(
                x=list(x), y=list(y), mode="markers", name=name, marker={"color": PRINT, "size": 9, "symbol": "diamond"}
            )
        )
    figure.update_layout(
        height=330,
        showlegend=True,
        title={"font": {"size": 14}, "x": 0.02, "xanchor": "left"},
        margin={"l": 58, "r": 12, "t": 40, "b": 40},
        legend={"orientation": "h", "yanchor": "top", "y": -0.2, "x": 0, "font": {"size": 11}},
        modebar={"orientation": "h", "remove": ["lasso2d", "select2d", "autoScale2d"]},
        font={"size": 12},
    )
    return figure


def half_width(print_: Printed, name: str = "") -> tuple[tuple[str, float, float], tuple[str, float, float]]:
    """Bands at half a printed peak-to-peak value either way, for an error that has no mean."""
    half = 0.5 * print_.span.lo, 0.5 * print_.span.hi
    label = name or f"printed: {print_.text} {print_.unit} peak to peak"
    return (label, *half), ("", -half[1], -half[0])
