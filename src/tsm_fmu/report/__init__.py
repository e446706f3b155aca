"""Self-contained HTML reports: one file, works offline, readable on a phone."""

from .figures import Line, loop_figure, time_figure
from .page import Section, Table, write_report

__all__ = ["Line", "Section", "Table", "loop_figure", "time_figure", "write_report"]
