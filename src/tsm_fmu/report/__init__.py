"""Self-contained HTML reports: one file, works offline, readable on a phone."""

from .figures import Band, Line, band_figure, bar_figure, loop_figure, time_figure
from .page import Section, Table, write_report

__all__ = [
    "Band", "Line", "Section", "Table", "band_figure", "bar_figure", "loop_figure", "time_figure",
    "write_report",
]  # fmt: skip
