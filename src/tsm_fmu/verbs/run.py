"""``run``: co-simulate a scenario or an SSP."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..cosim.cases import joined, present, run_cases, statistics
from ..cosim.energy import BOND_HEADING, balance, bond_rows, recorded_too
from ..cosim.metric import CaseMetrics, Spread
from ..cosim.ssp import write_ssp
from ..cosim.step_study import compared
from ..cosim.system_report import commands_section, coupling_section, write_system_report
from ..cosim.trajectory import SimulationInterrupted, SimulationStopped, Trajectory, write_trajectory
from ..logs.display import display
from ..logs.plain_json import finite
from ..logs.whole_file import check_folder, remove_earlier
from ..models.contract import InputError
from ..report.text import preformatted, text_table
from . import TIME_LIMIT
from .systems import Opened, Settings, opened

if TYPE_CHECKING:
    import pandas as pd

    from ..report.figures import Figure

DECIMATED_ROWS = 2000
"""The common results file of a scenario has about this many rows; statistics use all."""


@dataclass(frozen=True)
class RunResult:
    """A co-simulation; see `run`.

    Attributes
    ----------
    name : str
        The scenario, or the name of the SSP.
    cases : mapping of str to Trajectory
        Recorded signals by case.
    metrics : mapping of str to CaseMetrics
        By case: statistics of every signal, and the numbers that a scenario computes itself.
    comparison : mapping
        What the paper of a scenario prints beside them; empty for an SSP.
    order : str
        Whether the order of exchange matters in the first case, a sentence; empty where there is nothing to compare.
    results, report : Path or None
        What was written into the folder; None without one.
    """

    name: str
    cases: Mapping[str, Trajectory]
    metrics: Mapping[str, CaseMetrics]
    comparison: Mapping[str, Any]
    order: str = ""
    results: Path | None = None
    report: Path | None = None

    @property
    def messages(self) -> tuple[str, ...]:
        """What the FMUs logged above the status OK, each once."""
        return tuple(dict.fromkeys(message for run in self.cases.values() for message in run.messages))

    def summary(self) -> str:
        """Statistics of the signals, and the numbers of the scenario, as text."""
        signals = [row for case, own in self.metrics.items() for row in _signals(case, own, len(self.metrics) == 1)]
        rows = [(name, *(f"{v:.5g}" for v in (s.mean, s.std, s.peak_to_peak)), s.unit) for name, s in signals]
        quantities = [
            (case, name, f"{metric.value:.5g}", metric.unit)
            for case, own in self.metrics.items()
            for name, metric in own.quantities.items()
        ]
        parts = [
            (("signal", "mean", "std", "peak to peak", "unit"), rows),
            (("case", "quantity", "value", "unit"), quantities),
            (BOND_HEADING, [(c, n, *(f"{v:.4g}" for v in own)) for c, n, *own in bond_rows(self.metrics)]),
        ]
        tables = [text_table(heading, table) for heading, table in parts if table]
        return "\n\n".join([*tables, *([self.order] if self.order else [])])

    def to_frame(self, case: str | None = None) -> pd.DataFrame:
        """Signals of a case over time, header cells ``component.variable [unit]``.

        Parameters
        ----------
        case : str, optional
            The first without it.
        """
        import pandas as pd

        run = self._case(case)
        columns = {f"{name} [{run.units[name]}]": values for name, values in run.columns.items()}
        return pd.DataFrame(columns, index=pd.Index(run.time, name="time [s]"))

    def figure(self, signal: str | None = None) -> Figure:
        """One signal over time, all cases in one picture.

        Parameters
        ----------
        signal : str, optional
            ``component.variable``; without it the first.
        """
        from ..report.figures import Line, time_figure

        name = signal or next(iter(self._case(None).columns))
        units = [run.units[name] for run in self.cases.values() if name in run.columns]
        if not units:
            raise InputError(f"signal {name!r} -- expected one of {', '.join(self._case(None).columns)} -- correct it")
        show = display(units[0])
        lines = [
            Line(case, run.time, show.factor * run.columns[name])
            for case, run in self.cases.items()
            if name in run.columns
        ]
        return time_figure(lines, name, show.unit)

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``run``."""
        written = {"results": str(self.results), "report": str(self.report)} if self.results else {}
        return finite({"metrics": self.metrics, "comparison": self.comparison, "order": self.order, **written})

    def _case(self, case: str | None) -> Trajectory:
        name = next(iter(self.cases)) if case is None else case
        if name not in self.cases:
            raise InputError(f"case {name!r} -- expected one of {', '.join(self.cases)} -- correct the name")
        return self.cases[name]

    def _repr_html_(self) -> str:
        return preformatted(self.summary())


def run(
    what: str | os.PathLike[str],
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
    progress: bool = False,
) -> RunResult:
    """Co-simulate a scenario or an SSP.

    Parameters
    ----------
    what : str or Path
        Name of a scenario, or a file that ends in ``.ssp``.
    out : str or Path, optional
        Folder for results, report and the system as ``.ssp``; nothing is written without it.
    values : mapping of str to value, optional
        Start values by ``component.variable``.
    case : sequence of str
        Cases to run; all without it.
    stop, step : float, optional
        Stop time and communication step [s]; those of the system without them.
    jacobi : bool
        Exchange all values at once, not in order of the signals (Gauss-Seidel).
    loops : {"refuse", "delay", "iterate"}, optional
        What becomes of algebraic loops; as the system says without it.
    isolate : bool, optional
        Give every FMU a process of its own, or none; without it those that are not ours.
    time_limit : float
        Longest time of one call of an FMU there [s].
    step_error : float, optional
        Largest error of a step, relative to each signal's largest value: steps are divided where it is larger, by
        rolling FMUs back; ``step`` is the longest. Fixed steps without it.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    RunResult

    Raises
    ------
    InputError
        No such scenario, file, case or start value, or times that do not fit.
    SimulationStopped, SimulationInterrupted
        With the rows until then, kept in ``out`` if that is given.
    """
    folder = None if out is None else check_folder(out)
    settings = Settings(values or {}, case, stop, step, jacobi, loops, isolate, time_limit, step_error)
    with opened(what, folder, settings) as system:
        record = recorded_too(system.cases.values(), system.record)
        try:
            whole = run_cases(system.cases, record=record, progress=progress, simulate=system.simulate)
        except (SimulationStopped, SimulationInterrupted) as early:
            raise (early if folder is None else early.keep(folder / "results.csv")) from early
        order = _order(system, whole, folder)
        runs = {name: run.only(system.record) for name, run in whole.items()}
        metrics = {
            name: replace(own, bonds=balance(system.cases[name], whole[name]))
            for name, own in statistics(system.cases, runs, system.quantities).items()
        }
        comparison = {} if system.scenario is None else system.scenario.comparison(system.cases)
        result = RunResult(system.name, runs, metrics, comparison, order)
        return result if folder is None else _written(result, system, folder)


def _order(system: Opened, whole: Mapping[str, Trajectory], folder: Path | None) -> str:
    """`compared` on the first case; Ctrl-C then keeps the cases, which are complete."""
    first = next(iter(system.cases.values()))
    try:
        return compared(first, record=present(first[0], system.record), simulate=system.simulate)
    except SimulationInterrupted:
        early = SimulationInterrupted(joined({name: run.only(system.record) for name, run in whole.items()}))
        raise (early if folder is None else early.keep(folder / "results.csv")) from None


def _written(result: RunResult, system: Opened, folder: Path) -> RunResult:
    rows = min(run.time.size for run in result.cases.values())
    decimation = max(1, rows // DECIMATED_ROWS) if len(result.cases) > 1 else 1
    remove_earlier(folder, ("results.csv", "report.html"))
    results = write_trajectory(folder / "results.csv", joined(result.cases, decimation))
    for name, case in system.cases.items():
        single = len(system.cases) == 1
        write_ssp(folder / (f"{system.name}.ssp" if single else f"systems/{name.replace('.', '_')}.ssp"), case)
    page = folder / "report.html"
    if system.scenario is None:
        report = write_system_report(page, system.name, system.cases, result.cases, result.metrics, result.order)
    else:
        ending = [*commands_section(result.cases), *coupling_section(result.metrics, result.order)]
        beside = {**result.comparison, "ending": ending}
        report = system.scenario.write_scenario_report(page, result.cases, result.metrics, beside)
    return replace(result, results=results, report=report)


def _signals(case: str, own: CaseMetrics, alone: bool) -> list[tuple[str, Spread]]:
    """The tracking error of a case, or all its signals if it has no number of its own."""
    if own.tracking_error is not None:
        return [(f"{case}: tracking error", own.tracking_error)]
    if own.quantities:
        return []
    return [(name if alone else f"{case}.{name}", signal) for name, signal in own.signals.items()]
