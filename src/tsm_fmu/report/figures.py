"""The plots that reports use: something over time, a loop of output over input, means with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike, NDArray
from plotly.subplots import make_subplots

from ..logs.display import display

MOST_POINTS = 2000
"""Points drawn per line: enough for any screen, and the file stays small."""

COLOURS = ("#0b5cad", "#d1495b", "#2a8f5b", "#b8860b", "#6a4c93", "#444444")


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
    """Means with an interval, as a line with a shaded band."""

    name: str
    x: ArrayLike
    mean: ArrayLike
    low: ArrayLike
    high: ArrayLike


def band_figure(bands: Sequence[Band], title: str, x_label: str, y_label: str) -> go.Figure:
    """Means over a coordinate with their intervals."""
    figure = _figure([], title, x_label, y_label, height=380)
    for number, band in enumerate(bands):
        colour = COLOURS[number % len(COLOURS)]
        x, low, high = (np.asarray(y, dtype=float) for y in (band.x, band.low, band.high))
        outline = {"x": np.concatenate([x, x[::-1]]), "y": np.concatenate([high, low[::-1]])}
        shade = {"fill": "toself", "fillcolor": colour, "opacity": 0.18, "line": {"width": 0}, "hoverinfo": "skip"}
        figure.add_trace(go.Scatter(**outline, **shade, showlegend=False, mode="lines"))
        style = {"mode": "lines+markers", "line": {"color": colour, "width": 1.8}, "marker": {"size": 5}}
        figure.add_trace(go.Scatter(x=x, y=band.mean, name=band.name, **style, showlegend=bool(band.name)))
    figure.add_hline(y=0.0, line={"color": "#8a949c", "width": 1})
    return figure


def bar_figure(groups: Mapping[str, Mapping[str, float]], title: str) -> go.Figure:
    """Bars side by side; a plot with an axis of its own for each group, whose name says its unit."""
    figure = make_subplots(1, max(len(groups), 1), subplot_titles=list(groups))
    for column, bars in enumerate(groups.values(), 1):
        colours = [COLOURS[k % len(COLOURS)] for k in range(len(bars))]
        labels = [f"{value:.3g}" for value in bars.values()]
        bar = go.Bar(x=list(bars), y=list(bars.values()), text=labels, marker={"color": colours}, showlegend=False)
        figure.add_trace(bar, row=1, col=column)
    figure.update_layout(title={"text": title, "font": {"size": 15}}, height=360, template="plotly_white")
    return figure


def time_figure(lines: Sequence[Line], title: str, unit: str) -> go.Figure:
    """Lines over time [s]; ``unit`` is that of the vertical axis."""
    return _figure(lines, title, "time [s]", unit, height=320)


def loop_figure(lines: Sequence[Line], title: str, x_label: str, y_label: str) -> go.Figure:
    """Lines of one quantity over another, as in a hysteresis loop."""
    return _figure(lines, title, x_label, y_label, height=460)


def channels_figure(
    time: ArrayLike,
    columns: Mapping[str, ArrayLike],
    units: Mapping[str, str],
    title: str,
    marked: Sequence[tuple[float, float, str, str]] = (),
) -> go.Figure:
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
    figure = make_subplots(rows=len(columns), cols=1, shared_xaxes=True, vertical_spacing=0.03)
    for row, (name, values) in enumerate(columns.items(), 1):
        show = display(units[name])
        x, y = _thinned(np.asarray(time, dtype=float), show.factor * np.asarray(values, dtype=float))
        style = {"color": COLOURS[(row - 1) % len(COLOURS)], "width": 1.4}
        figure.add_trace(go.Scatter(x=x, y=y, name=name, mode="lines", line=style, showlegend=False), row, 1)
        figure.update_yaxes(title_text=f"{name} [{show.unit}]", row=row, col=1)
        for begin, end, channel, word in marked:
            if channel not in columns or channel == name:
                shade = {"fillcolor": "#d1495b", "opacity": 0.18, "line_width": 0, "annotation_text": word}
                figure.add_vrect(x0=begin, x1=end, row=row, col=1, **shade)  # pyright: ignore[reportArgumentType]
    figure.update_xaxes(title_text="time [s]", row=len(columns), col=1)
    height = 90 + 170 * max(1, len(columns))
    figure.update_layout(title=title, height=height, template="plotly_white", margin={"l": 70, "r": 20, "t": 50})
    return figure


def _figure(lines: Sequence[Line], title: str, x_label: str, y_label: str, height: int) -> go.Figure:
    figure = go.Figure()
    for number, line in enumerate(lines):
        x, y = _thinned(np.asarray(line.x, dtype=float), np.asarray(line.y, dtype=float))
        colour = COLOURS[(number if line.colour is None else line.colour) % len(COLOURS)]
        style = {"color": colour, "width": 1.6, "dash": "dot" if line.dashed else "solid"}
        figure.add_trace(go.Scatter(x=x, y=y, name=line.name, mode="lines", line=style))
    figure.update_layout(
        title={"text": title, "font": {"size": 15}},
        xaxis_title=x_label,
        yaxis_title=y_label,
        height=height,
        template="plotly_white",
        modebar={"orientation": "v"},  # beside the plot, not over its title on a narrow screen
        margin={"l": 60, "r": 48, "t": 45, "b": 90},
        legend={"orientation": "h", "yanchor": "top", "y": -0.22, "x": 0},
    )
    return figure


def _thinned(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Keep the lowest and highest value of each bin, so that spikes stay visible."""
    if x.size <= MOST_POINTS:
        return x, y
    keep = {0, x.size - 1}
    for part in np.array_split(np.arange(x.size), MOST_POINTS // 2):
        keep.update((int(part[np.nanargmin(y[part])]), int(part[np.nanargmax(y[part])])))
    order = np.array(sorted(keep))
    return x[order], y[order]
