"""Plots inside a page: the plot library and all data packed into it, drawn when they come into sight."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from .panel import Panel, legend

POINTS_OF_A_PAGE = 70_000
"""Points of all lines of a page together, so that it stays below 1.5 MB; a line keeps `LEAST_POINTS`."""
LEAST_POINTS = 200


@dataclass(frozen=True)
class Plot:
    """Panels drawn as one piece, with the title above them."""

    title: str
    panels: Sequence[Panel]


class Plots:
    """The plots of one page: `place` gives each its frame, `scripts` what draws them all, at the end of the page."""

    def __init__(self) -> None:
        self._plots: list[Plot] = []

    def place(self, plot: Plot) -> Markup:
        """The frame of a plot, with its title and legend as text."""
        self._plots.append(plot)
        height = sum(panel.height for panel in plot.panels)
        return Markup(environment().get_template("plot.html").render(
            number=len(self._plots) - 1, title=plot.title, legend=legend(plot.panels), height=height,
            description=_description(plot),
        ))  # fmt: skip

    def scripts(self) -> Markup:
        """Library, data and the program that draws; nothing where nothing was placed."""
        if not self._plots:
            return Markup("")
        from .draw import MOST_POINTS, plot_item  # brings the plot library: only those who draw pay for it

        lines = sum(len(panel.lines) for plot in self._plots for panel in plot.panels)
        most = max(LEAST_POINTS, min(MOST_POINTS, POINTS_OF_A_PAGE // max(1, lines)))
        items = [plot_item(plot.panels, most) for plot in self._plots]
        return Markup(environment().get_template("plots.html").render(
            library=_library(), items=_packed(json.dumps(items, separators=(",", ":")).encode()),
            program=Markup(files("tsm_fmu.report").joinpath("plots.js").read_text(encoding="utf-8")),
        ))  # fmt: skip


def single_page(title: str, plots: Sequence[Plot]) -> str:
    """A page of plots alone."""
    placed = Plots()
    return (
        environment()
        .get_template("single.html")
        .render(title=title, placed=[placed.place(plot) for plot in plots], scripts=placed.scripts())
    )


@cache
def environment() -> Environment:
    """The templates of all pages; ``style.css`` is the one style."""
    made = Environment(
        loader=PackageLoader("tsm_fmu.report", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    made.globals["style"] = Markup(files("tsm_fmu.report").joinpath("style.css").read_text(encoding="utf-8"))
    return made


def _description(plot: Plot) -> str:
    """What a screen reader says of a plot."""
    parts = []
    for panel in plot.panels:
        axes = " over ".join(filter(None, (panel.y_label, panel.x_label)))
        bars = ", ".join(f"{name} {value:.3g}" for name, value in panel.bars.items())
        names = ", ".join(part.name for part in (*panel.lines, *panel.bands, *panel.points) if part.name)
        parts.append(": ".join(filter(None, (axes, bars or names))))
    return "; ".join(filter(None, (plot.title, *parts)))


def _packed(data: bytes) -> str:
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode("ascii")


@cache
def _library() -> str:
    return _packed(files("bokeh").joinpath("server/static/js/bokeh.min.js").read_bytes())


def rendered(template: str, **values: Any) -> str:
    """A page from its template."""
    return environment().get_template(template).render(**values)
