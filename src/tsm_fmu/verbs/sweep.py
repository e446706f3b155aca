"""``sweep``: a scenario or an SSP at every point of a grid of start values."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..cosim import sweep as sweeping
from ..cosim.sweep import Axis, Point
from ..cosim.sweep_report import chief_numbers, sweep_answer, sweep_section
from ..logs.whole_file import check_folder
from ..models.contract import InputError
from ..report import write_report
from ..report.text import text_table
from . import TIME_LIMIT
from .choices import Varied, choices
from .points import How, run_points
from .systems import Settings, opened

if TYPE_CHECKING:
    import pandas as pd

    from ..report.figures import Figure

SHOWN = 4
"""Columns of numbers that a summary shows; the table has all."""


@dataclass(frozen=True)
class SweepResult:
    """A grid of co-simulations; see `sweep`.

    Attributes
    ----------
    name : str
        The scenario, or the name of the SSP.
    axes : tuple of Axis
        What was varied.
    points : tuple of Point
        The last axis fastest.
    results, report : Path or None
        What was written into the folder; None without one.
    """

    name: str
    axes: tuple[Axis, ...]
    points: tuple[Point, ...]
    results: Path | None = None
    report: Path | None = None

    @property
    def failures(self) -> tuple[str, ...]:
        """One line for each point that failed: where, and why."""
        return tuple(f"{sweeping.in_words(point.values)}: {point.failed}" for point in self.points if point.failed)

    def summary(self) -> str:
        """The points with their first numbers as text."""
        found = sweeping.units(self.points)
        units = {name: found[name] for name in chief_numbers(list(found))[:SHOWN]}
        rows = [
            [sweeping.shown(v) for v in point.values.values()]
            + [f"{point.metrics[name].value:.5g}" if name in point.metrics else "failed" for name in units]
            for point in self.points
        ]
        return text_table(
            [*(axis.name for axis in self.axes), *(f"{name} [{unit}]" for name, unit in units.items())], rows
        )

    def to_frame(self) -> pd.DataFrame:
        """One row a point: varied values, all numbers, and why it failed (empty if it did not)."""
        import pandas as pd

        rows = [
            {axis.heading: point.values[axis.name] for axis in self.axes}
            | {f"{name} [{metric.unit}]": metric.value for name, metric in point.metrics.items()}
            | {"failed": point.failed}
            for point in self.points
        ]
        return pd.DataFrame(rows)

    def figure(self, metric: str | None = None) -> Figure:
        """One number over the first axis.

        Parameters
        ----------
        metric : str, optional
            Its name, without the unit; the first number without it.

        Raises
        ------
        InputError
            No such number, or no point that did not fail.
        """
        from ..report.figures import Line, loop_figure

        good = [point for point in self.points if not point.failed]
        if not good:
            raise InputError(f"sweep of {self.name} -- expected a point that did not fail -- see its failures")
        units, axis = sweeping.units(good), self.axes[0]
        name = next(iter(units)) if metric is None else metric
        if name not in units:
            raise InputError(f"number {name!r} -- expected one of {', '.join(units)} -- correct it")
        there = [point for point in good if name in point.metrics]
        lines = [Line(name, [p.values[axis.name] for p in there], [p.metrics[name].value for p in there])]
        return loop_figure(lines, f"{self.name}: {name}", f"{axis.name} [{axis.unit}]", f"{name} [{units[name]}]")

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``sweep``."""
        data = sweeping.as_json(self.name, self.axes, self.points, True, self.results)
        return data if self.report is None else {**data, "report": str(self.report)}

    def _repr_html_(self) -> str:
        return self.to_frame().to_html(index=False)


def sweep(
    what: str | os.PathLike[str],
    vary: Varied,
    *,
    out: str | os.PathLike[str] | None = None,
    values: Mapping[str, object] | None = None,
    case: Sequence[str] = (),
    stop: float | None = None,
    step: float | None = None,
    jacobi: bool = False,
    loops: str | None = None,
    isolate: bool | None = None,
    time_limit: float = TIME_LIMIT,
    step_error: float | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
    notes: Callable[[str], object] = lambda _: None,
) -> SweepResult:
    """Co-simulate at every point of a grid; a point that fails says why, and the rest goes on.

    Parameters
    ----------
    what : str or Path
        Name of a scenario, or a file that ends in ``.ssp``.
    vary : mapping of str to sequence
        The grid is their product: numbers by ``component.variable``; model cards (``.toml``) or FMUs (``.fmu``) by
        ``component``, which take its place; ``"flavour"``: ``"native"`` and ``"python"``, of a scenario; ``"seed"``:
        numbers for every component with a variable of that name.
    out : str or Path, optional
        Folder for table and report; points are kept there as they are found, so that a killed sweep goes on.
    values, case, stop, step, jacobi, loops, isolate, time_limit, step_error, progress
        As in `run`.
    workers : int, optional
        Local processes that do the points; one a processor without it, 1: this one.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the points, as in ``tcp://host:8786``; they see the same folders.
    notes : callable
        Told how many points were kept from before.

    Returns
    -------
    SweepResult

    Raises
    ------
    InputError
        As in `run`; an axis that no system has, or a card that does not fit; all points failed.
    """
    folder = None if out is None else check_folder(out)
    how = How(workers, scheduler, isolate, time_limit, progress, notes)
    settings = {name: str(value) for name, value in (values or {}).items()}
    with ExitStack() as stack:
        system = stack.enter_context(
            opened(what, folder, Settings(settings, case, stop, step, jacobi, loops, False, time_limit, step_error))
        )
        place = folder or Path(stack.enter_context(TemporaryDirectory(prefix="tsm-fmu-")))
        found = choices(system, vary, place)
        points = run_points(
            system, found.axes, sweeping.grid(found.axes), folder, how, changes=dict(found.changes), settings=settings
        )
        name = system.name
    if folder is None:
        return SweepResult(name, found.axes, tuple(points))
    data = sweeping.write_sweep(folder, name, found.axes, points)
    section, answer = sweep_section(data), sweep_answer(data)
    page = replace(section, title="Over what was varied", text="sweep.parquet has every number of every point.")
    report = write_report(folder / "report.html", section.title, answer, [page], {"tsm-fmu": __version__})
    return SweepResult(name, found.axes, tuple(points), Path(data["results"]), report)
