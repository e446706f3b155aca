"""Panels like those of the papers, with what the papers print drawn in: values as points, ranges as bands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..report import Figure, Line
from ..report.panel import Level, Panel, Points
from .printed import Printed


def plot(
    lines: Sequence[Line],
    title: str,
    x_label: str,
    y_label: str,
    *,
    bands: Iterable[tuple[str, float, float]] = (),
    points: Iterable[tuple[str, Sequence[float], Sequence[float]]] = (),
) -> Figure:
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
    panel = Panel(
        x_label,
        y_label,
        lines=lines,
        levels=[Level(*band) for band in bands],
        points=[Points(*values) for values in points],
    )
    return Figure(title, (panel,))


def half_width(print_: Printed, name: str = "") -> tuple[tuple[str, float, float], tuple[str, float, float]]:
    """Bands at half a printed peak-to-peak value either way, for an error that has no mean."""
    half = 0.5 * print_.span.lo, 0.5 * print_.span.hi
    label = name or f"printed: {print_.text} {print_.unit} peak to peak"
    return (label, *half), ("", -half[1], -half[0])
