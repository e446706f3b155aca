"""Panels given to the plot library (Bokeh, whose program for browsers is a quarter of Plotly's)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.embed import json_item
from bokeh.layouts import gridplot
from bokeh.models import (
    BasicTicker,
    BoxAnnotation,
    BoxZoomTool,
    ColorBar,
    ColumnDataSource,
    FixedTicker,
    HoverTool,
    LabelSet,
    LinearColorMapper,
    PanTool,
    ResetTool,
    SaveTool,
    Span,
    Title,
    WheelZoomTool,
)  # fmt: skip
from bokeh.plotting import figure
from bokeh.themes import Theme
from numpy.typing import ArrayLike, NDArray

from .panel import MARKED, Panel, colour

MOST_POINTS = 2000
"""Points drawn per line: enough for any screen, and the page stays small."""

MOST_NAMES = 8
"""Names along an axis of a map."""

ACCENT = 2
"""Number of the colour of bars that stand out."""

THEME = Theme(json={"attrs": {"Axis": {"axis_label_text_font_style": "normal", "axis_label_text_font_size": "13px",
                                       "major_label_text_font_size": "12px"}}})  # fmt: skip


def plot_item(panels: Sequence[Panel], most_points: int = MOST_POINTS) -> dict[str, Any]:
    """Panels below one another, their x axes common, as the object that ``Bokeh.embed.embed_item`` takes."""
    plots = [_plot(panel, most_points) for panel in panels]
    for below in plots[1:]:
        below.x_range = plots[0].x_range
    root = plots[0] if len(plots) == 1 else gridplot([[p] for p in plots], sizing_mode="stretch_width")
    Document().add_root(root)
    return dict(json_item(root, theme=THEME))


def thinned(x: ArrayLike, y: ArrayLike, most: int = MOST_POINTS) -> tuple[NDArray[Any], NDArray[Any]]:
    """At most so many points: the lowest and the highest value of each bin, so that spikes stay visible."""
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if x.size <= most:
        return x, y
    bins = (most - 2) // 2
    size, longer = divmod(x.size, bins)
    keep = [np.array([0, x.size - 1])]
    begin = 0
    for count, length in ((longer, size + 1), (bins - longer, size)):  # bins of the same length all at once
        values = y[begin : begin + count * length].reshape(count, length)
        first = begin + length * np.arange(count)
        begin += count * length
        some, unknown = np.isfinite(values).any(axis=1), np.isnan(values)
        lowest, highest = np.where(unknown, np.inf, values), np.where(unknown, -np.inf, values)
        keep += [(first + at)[some] for at in (lowest.argmin(axis=1), highest.argmax(axis=1))]
    order = np.unique(np.concatenate(keep))
    return x[order], y[order]


def _plot(panel: Panel, most_points: int) -> Any:
    axis: dict[str, Any] = {"y_range": list(panel.bars)[::-1]} if panel.bars else {}
    if panel.log_x:
        axis["x_axis_type"] = "log"
    drawn_at = [np.ravel(np.asarray(line.y, dtype=float)) for line in panel.lines]
    seen = np.concatenate(drawn_at) if drawn_at else np.empty(0)
    seen = seen[np.isfinite(seen)]
    if seen.size and np.ptp(seen) < panel.y_span:
        middle = float(seen.min() + seen.max()) / 2.0
        axis["y_range"] = (middle - panel.y_span / 2.0, middle + panel.y_span / 2.0)
    hover = HoverTool(tooltips=[("x", "$x"), ("y", "$y")])
    tools = [BoxZoomTool(), PanTool(), WheelZoomTool(), hover, ResetTool(), SaveTool()]
    plot = figure(
        height=panel.height, sizing_mode="stretch_width", tools=[] if panel.bars else tools, toolbar_location="right",
        active_drag=None, active_scroll=None, x_axis_label=panel.x_label or None,
        y_axis_label=panel.y_label or None, **axis,
    )  # fmt: skip
    plot.toolbar.logo = None
    plot.min_border_right, plot.output_backend = 12, "canvas"
    for number, line in enumerate(panel.lines):
        x, y = (_compact(values) for values in thinned(line.x, line.y, most_points))
        drawn = colour(number if line.colour is None else line.colour)
        plot.line(
            x, y, line_color=drawn, line_width=1.6, line_dash="dotted" if line.dashed else "solid", name=line.name
        )
        hover.renderers = "auto"
    for number, band in enumerate(panel.bands):
        x, low, mean, high = (np.asarray(v, dtype=float) for v in (band.x, band.low, band.mean, band.high))
        plot.varea(x, low, high, fill_color=colour(number), fill_alpha=0.22, name=band.name)
        plot.line(x, mean, line_color=colour(number), line_width=1.8, name=band.name)
        if band.marked:
            plot.scatter(x, mean, color=colour(number), size=5, name=band.name)
    if panel.bands:
        plot.add_layout(Span(location=0.0, dimension="width", line_color="#8a949c"))
    _bars(plot, panel)
    _steps(plot, panel)
    _cells(plot, panel)
    _marked(plot, panel)
    return plot


def _bars(plot: Any, panel: Panel) -> None:
    if not panel.bars:
        return
    names, values = list(panel.bars), list(panel.bars.values())
    source = ColumnDataSource({
        "y": names, "right": values, "text": [f"{value:.3g}" for value in values],
        "fill": [colour(ACCENT if name in panel.accent else 0) for name in names],
    })  # fmt: skip
    plot.hbar(y="y", right="right", height=0.7, color="fill", source=source)
    label = LabelSet(x="right", y="y", text="text", text_baseline="middle", x_offset=4, source=source)
    label.text_font_size = "13px"
    plot.add_layout(label)
    finite = [v for v in values if np.isfinite(v)]
    low, high = min([0.0, *finite]), max([0.0, *finite])
    plot.x_range.start, plot.x_range.end = 1.12 * low, 1.5 * high or 1.0  # room for the numbers
    plot.xaxis.ticker = BasicTicker(desired_num_ticks=4, num_minor_ticks=0)
    plot.ygrid.visible = False


def _steps(plot: Any, panel: Panel) -> None:
    if panel.steps is None:
        return
    edges, counts = np.asarray(panel.steps.edges, dtype=float), np.asarray(panel.steps.counts, dtype=float)
    plot.quad(left=edges[:-1], right=edges[1:], bottom=0.0, top=counts, fill_color=colour(0), line_color=None)
    plot.y_range.start = 0.0


def _cells(plot: Any, panel: Panel) -> None:
    """A map on the numbers of its columns and rows, so that uneven steps and names take equal room."""
    if panel.cells is None:
        return
    values = np.asarray(panel.cells.values, dtype=float)
    row, column = (index.ravel() for index in np.indices(values.shape))
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    mapper = LinearColorMapper(palette="Viridis256", low=low, high=high if high > low else low + 1.0, nan_color=MARKED)
    cells = {"x": column, "y": row, "value": values.ravel()}
    plot.rect(
        x="x", y="y", width=1.0, height=1.0, source=ColumnDataSource(cells), line_color=None,
        fill_color={"field": "value", "transform": mapper},
    )  # fmt: skip
    plot.add_layout(ColorBar(color_mapper=mapper, height=12, background_fill_color=None, padding=4), "above")
    for axis, names in ((plot.xaxis, panel.cells.columns), (plot.yaxis, panel.cells.rows)):
        some = range(0, len(names), -(-len(names) // MOST_NAMES))
        axis.ticker = FixedTicker(ticks=list(some))
        axis.major_label_overrides = {k: names[k] for k in some}
    plot.x_range.range_padding = plot.y_range.range_padding = 0.0
    plot.grid.visible = False
    plot.hover.tooltips = [("", "@value")]


def _marked(plot: Any, panel: Panel) -> None:
    for span in panel.spans:
        plot.add_layout(BoxAnnotation(left=span.begin, right=span.end, fill_color=MARKED, fill_alpha=0.18))
    if panel.spans:
        words = ", ".join(dict.fromkeys(span.word for span in panel.spans if span.word))
        plot.add_layout(Title(text=words, text_font_size="12px", text_font_style="normal"), "above")
    for level in panel.levels:
        if level.high > level.low:
            plot.add_layout(BoxAnnotation(bottom=level.low, top=level.high, fill_color=MARKED, fill_alpha=0.16))
        middle = 0.5 * (level.low + level.high)
        plot.add_layout(Span(location=middle, dimension="width", line_color=MARKED, line_dash="dashed"))
    for points in panel.points:
        x, y = np.asarray(points.x, dtype=float), np.asarray(points.y, dtype=float)
        plot.scatter(x, y, marker="diamond", size=11, color=MARKED, name=points.name)


def _compact(values: NDArray[Any]) -> NDArray[Any]:
    """In single precision where its steps are below a ten-thousandth of what is drawn."""
    finite = values[np.isfinite(values)]
    if finite.size and np.abs(finite).max() * 6e-8 < 1e-4 * np.ptp(finite) and np.abs(finite).max() < 1e38:
        return values.astype(np.float32)
    return values
