"""A life as a page: what moves first, each value over the runs, the errors before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from .. import __version__
from ..logs.display import Display, display
from ..report import Band, Figure, Line, Section, Table, write_report
from ..report.panel import Panel, Points
from .follow import TrackedRun
from .life import Series
from .order import ORDERS


def life_figure(series: Sequence[Series], runs: Sequence[TrackedRun], title: str) -> Figure:
    """Values with 95 % intervals over the number of the run, and the form found; one panel a series."""
    return Figure(title, tuple(_panel(one, [run.name for run in runs]) for one in series))


def write_life(
    path: Path, title: str, series: Sequence[Series], runs: Sequence[TrackedRun], summary: str,
    by: str, provenance: Mapping[str, str],
) -> Path:  # fmt: skip
    """Write the page and return its path.

    Parameters
    ----------
    path : Path
    title : str
        What is tracked.
    series : sequence of Series
    runs : sequence of TrackedRun
        In time order.
    summary : str
        The answer in a sentence or two.
    by : str
        What the runs are ordered by.
    provenance : mapping of str to str
    """
    moving = [one for one in series if one.moves]
    first = next(iter(moving or series))
    rest = [one for one in series if one is not first]
    numbers = [
        (k, run.name, *(_cell(run, one) for one in series if one.kind != "error")) for k, run in enumerate(runs, 1)
    ]
    heading = ["", "run", *(f"{one.name} [{_show(one).unit}]" for one in series if one.kind != "error")]
    errors = [
        (k, run.name, *(shown for channel in run.rmse for shown in _errors(run, channel, series)))
        for k, run in enumerate(runs, 1)
    ]
    units = {one.name.removeprefix("error of "): _show(one).unit for one in series if one.kind == "error"}
    error_heading = ["", "run", *(f"{c} [{units[c]}], {side}" for c in runs[0].rmse for side in ("card", "refitted"))]
    order = ORDERS.get(by, f"of {by} at their beginning")
    text = (
        "Each point is a fit to one run alone with its 95 % interval, the line is the form found: steady, trend, "
        f"jumps, or both. Runs are numbered in the order {order}. A cause is what such a change is usual for, not "
        "proven by these runs."
    )
    sections = [
        Section("What each value does", "\n\n".join(f"{one.text}." for one in series)),
        Section("Over the runs", text, figures=[life_figure(rest, runs, "Over the runs")] if rest else ()),
        Section("Values", "Value ± 95 % half width.", (Table(heading, numbers),)),
        Section("Errors", "RMS with the card's values, and with the tracked parameters free.",
                (Table(error_heading, errors),)),
    ]  # fmt: skip
    proof = life_figure([first], runs, f"{first.name} over the runs")
    return write_report(path, title, summary, sections, {"tsm-fmu": __version__, **provenance}, proof)


def _show(one: Series) -> Display:
    return display(one.unit, max(map(abs, one.values), default=0.0))


def _panel(one: Series, names: Sequence[str]) -> Panel:
    show = _show(one)
    number = np.array([names.index(name) + 1.0 for name in one.runs])
    y, half = show.factor * np.array(one.values), show.factor * 1.96 * np.array(one.stderr)
    bands = (Band(one.name, number, y, y - half, y + half),) if y.size else ()
    lines, points = (), ()
    if one.drift is not None:
        lines = (Line(one.drift.form, number, show.factor * np.array(one.drift.fitted), dashed=True, colour=1),)
    if y.size:
        points = (Points("runs", number.tolist(), y.tolist()),)
    return Panel("run", f"{one.name} [{show.unit}]", one.name, lines=lines, bands=bands, points=points)


def _cell(run: TrackedRun, one: Series) -> str:
    found, show = run.values[one.name], _show(one)
    if not found.used:
        return f"{found.value * show.factor:.4g}, not used"
    return f"{found.value * show.factor:.4g} ± {(found.high - found.low) / 2.0 * show.factor:.2g}"


def _errors(run: TrackedRun, channel: str, series: Sequence[Series]) -> tuple[float, float]:
    show = next(_show(one) for one in series if one.name == f"error of {channel}")
    return run.rmse_card[channel] * show.factor, run.rmse[channel] * show.factor
