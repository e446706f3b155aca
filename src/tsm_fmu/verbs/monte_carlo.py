"""``monte_carlo``: what the uncertainty of fitted models does to a closed loop."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..cosim import sweep as sweeping
from ..cosim.cases import with_values
from ..cosim.master import number_of_steps
from ..cosim.recorder import select
from ..cosim.ssp import Case
from ..cosim.sweep import Axis, Change, Point, Values
from ..cosim.sweep_report import SweepTable, sweep_table, worst_tables
from ..cosim.system import check_system
from ..cosim.tolerance import Bands, bands, bands_figure, tolerance_answer, tolerance_sections
from ..logs.table import write_table
from ..logs.whole_file import check_folder
from ..models.contract import InputError
from ..regression.draws import Draws, draw
from ..report import write_report
from ..report.text import text_table
from . import TIME_LIMIT
from .choices import card_change
from .models import ModelLike, resolve_model
from .points import How, run_points
from .systems import Opened, Settings, opened

if TYPE_CHECKING:
    import pandas as pd

    from ..report.figures import Figure

MOST_DRAWS = 20_000


@dataclass(frozen=True)
class MonteCarloResult:
    """A loop under uncertain parameters; see `monte_carlo`.

    Attributes
    ----------
    name : str
        The scenario, or the name of the SSP.
    signal : str
        What the bands are of.
    axes : tuple of Axis
        The number of the draw, and the drawn parameters.
    nominal : Point
        With the values of the cards.
    draws : tuple of Point
        In their order.
    bands : mapping of str to Bands
        By case.
    notes : tuple of str
        What was drawn, and what was not.
    results, report : Path or None
        What was written into the folder; None without one.
    """

    name: str
    signal: str
    axes: tuple[Axis, ...]
    nominal: Point
    draws: tuple[Point, ...]
    bands: Mapping[str, Bands]
    notes: tuple[str, ...]
    results: Path | None = None
    report: Path | None = None

    @property
    def failures(self) -> tuple[str, ...]:
        """One line for each draw that failed: which, and why."""
        return tuple(f"draw {p.values['draw']:g}: {p.failed}" for p in self.draws if p.failed)

    @property
    def answer(self) -> str:
        """The chief number with the values of the cards, over the draws, and what the worst draw covers."""
        nominal = {name: metric.value for name, metric in self.nominal.metrics.items()}
        return tolerance_answer(self._table(), nominal, len(self.draws))

    def summary(self) -> str:
        """Answer, and the spread of the chief numbers, as text."""
        spread = worst_tables(self._table())[0]
        rows = [row[:-1] for row in spread.rows]
        return "\n".join([*self.notes, text_table(spread.heading[:-1], rows), "", self.answer])

    def to_frame(self) -> pd.DataFrame:
        """One row a draw: its number, drawn parameters, all numbers, and why it failed (empty if it did not)."""
        import pandas as pd

        rows = [
            {axis.heading: point.values[axis.name] for axis in self.axes}
            | {f"{name} [{metric.unit}]": metric.value for name, metric in point.metrics.items()}
            | {"failed": point.failed}
            for point in self.draws
        ]
        return pd.DataFrame(rows)

    def figure(self, case: str | None = None) -> Figure:
        """The bands of a case; of the first without it.

        Raises
        ------
        InputError
            No such case.
        """
        name = next(iter(self.bands), "") if case is None else case
        if name not in self.bands:
            raise InputError(
                f"case {name!r} -- expected one of {', '.join(self.bands) or '(none)'} -- correct the name"
            )
        return bands_figure(self.bands[name], f"{self.signal}, {name}", self.signal)

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``monte-carlo``."""
        data = sweeping.as_json(self.name, self.axes, self.draws, True, self.results)
        spread = {
            name: dict(zip(("unit", "p5", "median", "p95", "worst"), row, strict=True))
            for name, *row in (r[:-1] for r in worst_tables(self._table())[0].rows)
        }
        numbers = {name: vars(metric) for name, metric in self.nominal.metrics.items()}
        return {
            **data, "signal": self.signal, "answer": self.answer, "nominal": numbers, "spread": spread,
            "notes": self.notes, "report": None if self.report is None else str(self.report),
        }  # fmt: skip

    def _table(self) -> SweepTable:
        return sweep_table(sweeping.as_json(self.name, self.axes, self.draws, True, None))

    def _repr_html_(self) -> str:
        return f"<p>{self.answer}</p>"


def monte_carlo(
    what: str | os.PathLike[str],
    cards: Mapping[str, ModelLike],
    *,
    draws: int = 200,
    seed: int = 0,
    signal: str | None = None,
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
) -> MonteCarloResult:
    """Co-simulate a loop with parameters drawn from what fits know of them: tolerance bands of its error.

    Each card's parameters are drawn from the normal distribution of the fit's errors, those with an open bound at zero
    in their logarithm; draws that bounds or joint conditions refuse are drawn again. Cards are drawn independently.

    Parameters
    ----------
    what : str or Path
        Name of a scenario, or a file that ends in ``.ssp``.
    cards : mapping of str to path, ModelCard or result
        Model cards that `identify` wrote, by the component whose model they are.
    draws : int
        How many; 59 show what 95 % of drives do not exceed, 299 what 99 % do not.
    seed : int
        Same seed, same draws.
    signal : str, optional
        ``component.variable`` for the bands; without it the tracking error that the system names.
    out, values, case, stop, step, jacobi, loops, isolate, time_limit, step_error, workers, scheduler, progress, notes
        As in `sweep`.

    Returns
    -------
    MonteCarloResult

    Raises
    ------
    InputError
        As in `sweep`; a card without the correlation of its errors, or that is not of the component's model.
    """
    if not 2 <= draws <= MOST_DRAWS:
        raise InputError(f"draws {draws} -- expected 2 to {MOST_DRAWS} -- choose another number")
    if not cards:
        raise InputError("no card -- expected one or more -- give COMPONENT=CARD.toml")
    folder = None if out is None else check_folder(out)
    how = How(workers, scheduler, isolate, time_limit, progress, notes)
    settings = {name: str(value) for name, value in (values or {}).items()}
    with ExitStack() as stack:
        system = stack.enter_context(
            opened(what, folder, Settings(settings, case, stop, step, jacobi, loops, False, time_limit, step_error))
        )
        place = folder or Path(stack.enter_context(TemporaryDirectory(prefix="tsm-fmu-")))
        change, axes, points, draw_notes = _drawn(system, cards, draws, seed, settings, place)
        traced = _traced(system.cases, system.record, signal)
        found = run_points(
            system, axes, points, folder, how, changes={(): change}, settings=settings, traced=traced, kind="draws"
        )
        nominal, drawn = found[0], found[1:]
        if nominal.failed or all(point.failed for point in drawn):
            wrong = nominal.failed or drawn[0].failed
            raise InputError(f"the card's own values or all draws failed, the first: {wrong}")
        shown = {
            name: made
            for name, (one, experiment) in system.cases.items()
            if (made := bands(name, _times(experiment), _unit(one, traced), nominal, drawn)) is not None
        }
        result = MonteCarloResult(system.name, traced, axes, nominal, tuple(drawn), shown, draw_notes)
    return result if folder is None else _written(result, folder)


def _drawn(
    system: Opened, cards: Mapping[str, ModelLike], draws: int, seed: int, settings: Mapping[str, str], folder: Path
) -> tuple[Change, tuple[Axis, ...], list[Values], tuple[str, ...]]:
    """What the cards put into the systems, the axes, the points (the cards' own values first), and notes."""
    fmus: dict[str, Path] = {}
    own: dict[str, str] = {}
    columns: dict[str, np.ndarray] = {"draw": np.arange(draws + 1.0)}
    units, notes = {"draw": "1"}, []
    for number, (component, model) in enumerate(cards.items()):
        card = resolve_model(model).card
        if card is None:
            raise InputError(f"{component}={model} -- expected a model card -- fit one with 'tsm-fmu identify'")
        change = card_change(system, component, card, folder)
        fmus, own = {**fmus, **change.fmus}, {**own, **change.values}
        one = draw(card, draws, (seed, number))
        if both := [name for name in settings if name.removeprefix(f"{component}.") in one.names]:
            raise InputError(f"{both[0]} is set and drawn -- expected one of them -- leave --set {both[0]} out")
        for name, values in zip(one.names, one.values.T, strict=True):
            columns[f"{component}.{name}"] = np.concatenate([[card.parameters[name].value], values])
            units[f"{component}.{name}"] = card.parameters[name].unit
        notes += _notes_of_draws(component, one, draws)
    rows = np.column_stack(list(columns.values())).tolist()
    points: list[Values] = [dict(zip(columns, row, strict=True)) for row in rows]
    axes = tuple(Axis(name, units[name], tuple(values[1:].tolist())) for name, values in columns.items())
    with_values(system.cases, {k: repr(v) for k, v in points[0].items() if k != "draw"})
    return Change(fmus, own), axes, points, tuple(notes)


def _notes_of_draws(component: str, one: Draws, draws: int) -> list[str]:
    notes = [f"{component}: {', '.join(one.names)} drawn from the fit's covariance."]
    if one.held:
        notes.append(f"{component}: {', '.join(one.held)} stay at the card's values, the fit knows no error of them.")
    if one.refused:
        share = 100.0 * one.refused / (one.refused + draws)
        notes.append(f"{component}: {share:.3g} % of the draws were outside bounds or conditions and drawn again.")
    return notes


def _traced(cases: Mapping[str, Case], record: Sequence[str] | None, signal: str | None) -> str:
    """The signal of the bands, checked before the simulations."""
    name = signal or next((e.tracking_error for _, e in cases.values() if e.tracking_error), "")
    known: dict[str, None] = {}
    for system, _ in cases.values():
        present = {c.name for c in system.components}
        wanted = None if record is None else [r for r in record if r.partition(".")[0] in present]
        known |= dict.fromkeys(select(check_system(system), wanted))
    if name not in known:
        what = f"signal {name!r}" if name else "the system names no tracking error"
        raise InputError(f"{what} -- expected one of {', '.join(known)} -- give --signal COMPONENT.VARIABLE")
    return name


def _times(experiment: Any) -> np.ndarray:
    steps = number_of_steps(experiment.start, experiment.stop, experiment.step)
    return experiment.start + experiment.step * np.arange(steps + 1)[sweeping.trace_rows(steps + 1)]


def _unit(system: Any, signal: str) -> str:
    component, _, variable = signal.partition(".")
    known = check_system(system).descriptions
    return (known[component].ports[variable].unit or "1") if component in known else "1"


def _written(result: MonteCarloResult, folder: Path) -> MonteCarloResult:
    data = sweeping.write_sweep(folder, result.name, result.axes, result.draws, kind="draws")
    header, columns = ["time [s]"], [next(iter(result.bands.values())).time] if result.bands else []
    for case, made in result.bands.items():
        if made.time.size == columns[0].size:
            prefix = "" if len(result.bands) == 1 else f"{case}."
            header += [f"{prefix}{name} [{made.unit}]" for name in ("nominal", "p2.5", "p25", "p50", "p75", "p97.5")]
            columns += [made.nominal, *made.quantiles]
    if columns:
        write_table(folder / "bands.csv", header, columns)
    figures = [result.figure(case) for case in result.bands]
    sections = tolerance_sections(result._table(), [a.name for a in result.axes[1:]], figures, result.notes)
    title = f"Tolerance of {result.name}"
    page = write_report(folder / "report.html", title, result.answer, sections, {"tsm-fmu": __version__})
    return MonteCarloResult(**{**vars(result), "results": Path(data["results"]), "report": page})
