"""The two plots that every report uses: something over time, and a loop of output over input."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike, NDArray

MOST_POINTS = 2000
"""Points drawn per line: enough for any screen, and the file stays small."""

COLOURS = ("#0b5cad", "#d1495b", "#2a8f5b", "#b8860b", "#6a4c93", "#444444")


@dataclass(frozen=True)
class Line:
    """One line: name and values; ``dashed`` for what was measured or asked for."""

    name: str
    x: ArrayLike
    y: ArrayLike
    dashed: bool = False


def time_figure(lines: Sequence[Line], title: str, unit: str) -> go.Figure:
    """Lines over time [s]; ``unit`` is that of the vertical axis."""
    return _figure(lines, title, "time [s]", unit, height=320)


def loop_figure(lines: Sequence[Line], title: str, x_label: str, y_label: str) -> go.Figure:
    """Lines of one quantity over another, as in a hysteresis loop."""
    return _figure(lines, title, x_label, y_label, height=460)


def _figure(lines: Sequence[Line], title: str, x_label: str, y_label: str, height: int) -> go.Figure:
    figure = go.Figure()
    for number, line in enumerate(lines):
        x, y = _thinned(np.asarray(line.x, dtype=float), np.asarray(line.y, dtype=float))
        style = {"color": COLOURS[number % len(COLOURS)], "width": 1.6, "dash": "dot" if line.dashed else "solid"}
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
