"""``tsm-fmu run``: co-simulate a scenario or an SSP."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from .app import app, print_json, settings
from .systems import TIME_LIMIT, Case, Folder, Isolate, Jacobi, Step, StopTime, System, TimeLimit, Values, opened

DECIMATED_ROWS = 2000
"""The common results file of a scenario has about this many rows; statistics use all."""


@app.command("run")
def run(
    what: System,
    out: Folder,
    values: Values = [],  # noqa: B006  typer reads it
    case: Case = [],  # noqa: B006
    stop: StopTime = None,
    step: Step = None,
    jacobi: Jacobi = False,
    isolate: Isolate = None,
    time_limit: TimeLimit = TIME_LIMIT,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Co-simulate a scenario or an SSP: results, statistics, report, and the system as .ssp."""
    from ..cosim.cases import joined, run_cases, statistics
    from ..cosim.ssp import write_ssp
    from ..cosim.trajectory import SimulationInterrupted, SimulationStopped, write_trajectory

    with opened(what, out, settings(values), case, stop, step, jacobi, isolate, time_limit) as system:
        try:
            runs = run_cases(system.cases, record=system.record, progress=not as_json, simulate=system.simulate)
        except (SimulationStopped, SimulationInterrupted) as early:
            raise early.keep(out / "results.csv") from early
        rows = min(r.time.size for r in runs.values())
        decimation = max(1, rows // DECIMATED_ROWS) if len(runs) > 1 else 1
        results = write_trajectory(out / "results.csv", joined(runs, decimation))
        write_ssp(out / f"{system.name}.ssp", system.cases)
        metrics = statistics(system.cases, runs, system.quantities)
        if system.scenario is None:
            from ..cosim.system_report import write_system_report

            report, beside = write_system_report(out / "report.html", system.name, system.cases, runs), metrics
        else:
            beside = system.scenario.comparison(system.cases)
            report = system.scenario.write_scenario_report(out / "report.html", runs, metrics, beside)
            beside = {**metrics, **beside}
    for line in dict.fromkeys(message for r in runs.values() for message in r.messages):
        typer.echo(line, err=True)
    if as_json:
        print_json({"metrics": beside, "results": str(results), "report": str(report)})
        return
    _print(metrics)
    typer.echo(f"results {results}\nreport  {report}")


def _print(metrics: Mapping[str, Any]) -> None:
    console = Console()
    if signals := _rows(metrics, ()):
        table = Table("signal", "mean", "std", "peak to peak", "unit")
        for name, unit, spread in signals:
            table.add_row(name, *(f"{spread[k]:.5g}" for k in ("mean", "std", "peak_to_peak")), unit)
        console.print(table)
    if quantities := _quantities(metrics, ()):
        table = Table("case", "quantity", "value")
        for row in quantities:
            table.add_row(*row)
        console.print(table)


def _rows(metrics: Mapping[str, Any], path: tuple[str, ...]) -> list[tuple[str, str, Mapping[str, float]]]:
    """Tracking errors of the cases, or all signals of a case without any number of its own."""
    if "peak_to_peak_deg" in metrics:
        return [(".".join(path), "deg", {k: metrics[f"{k}_deg"] for k in ("mean", "std", "peak_to_peak")})]
    if "peak_to_peak" in metrics:
        return [(".".join(path), str(metrics["unit"]), metrics)]
    if "signals" in metrics:
        return []
    return [row for k, v in metrics.items() if isinstance(v, Mapping) for row in _rows(v, (*path, k))]


def _quantities(metrics: Mapping[str, Any], path: tuple[str, ...]) -> list[tuple[str, str, str]]:
    """Numbers that a scenario computes itself: case, name with unit, value."""
    if "signals" in metrics:
        own = {k: v for k, v in metrics.items() if isinstance(v, float) and not k.endswith(("_deg", "_s"))}
        return [(".".join(path), name, f"{value:.5g}") for name, value in own.items()]
    return [row for k, v in metrics.items() if isinstance(v, Mapping) for row in _quantities(v, (*path, k))]
