"""Self-contained HTML reports: one file, works offline, readable on a phone, in the dark and on paper."""

from .figures import Figure, band_figure, bar_figure, histogram_figure, loop_figure, map_figure, time_figure
from .page import Section, Table, write_report
from .panel import Band, Line

__all__ = [
    "Band", "Figure", "Line", "Section", "Table", "band_figure", "bar_figure", "histogram_figure",
    "loop_figure", "map_figure", "time_figure", "write_report",
]  # fmt: skip
