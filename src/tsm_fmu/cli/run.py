"""``tsm-fmu run``: co-simulate a scenario or an SSP."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from ..models.contract import InputError
from .app import app, print_json, settings

DECIMATED_ROWS = 2000
"""The common results file of a scenario has about this many rows; statistics use all."""


@app.command("run")
def run(
    what: Annotated[str, typer.Argument(metavar="SCENARIO|FILE.ssp", help="Scenario by name, or a system.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for results, report and .ssp.")],
    values: Annotated[
        list[str], typer.Option("--set", metavar="COMPONENT.VARIABLE=VALUE", help="Start value; repeatable.")
    ] = [],  # noqa: B006  typer reads it
    case: Annotated[list[str], typer.Option("--case", help="Run this case only; repeatable.")] = [],  # noqa: B006
    stop: Annotated[float | None, typer.Option("--stop", metavar="S", help="Stop time [s].")] = None,
    step: Annotated[float | None, typer.Option("--step", metavar="S", help="Communication step [s].")] = None,
    jacobi: Annotated[
        bool, typer.Option("--jacobi", help="Exchange all values at once (default Gauss-Seidel).")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Co-simulate a scenario or an SSP: results, statistics, report, and the system as .ssp."""
    from ..cosim.cases import chosen, joined, run_cases, statistics, with_values
    from ..cosim.scenarios import SCENARIOS
    from ..cosim.ssp import open_ssp, write_ssp
    from ..cosim.trajectory import SimulationInterrupted, SimulationStopped, write_trajectory

    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file -- expected a folder -- choose another")
    settled = settings(values)
    scenario = SCENARIOS.get(what)
    with ExitStack() as stack:
        if scenario is not None:
            cases, record = scenario.cases(_built(scenario.FMUS, out / "fmus")), scenario.RECORD
        elif what.endswith(".ssp"):
            cases, record = stack.enter_context(open_ssp(Path(what))), None
        else:
            raise InputError(f"{what!r} -- expected one of {', '.join(SCENARIOS)} or a file that ends in .ssp")
        cases = with_values(chosen(cases, case), settled)
        timing: dict[str, Any] = {k: v for k, v in (("stop", stop), ("step", step)) if v is not None}
        if jacobi:
            timing["method"] = "jacobi"
        cases = {name: (system, replace(experiment, **timing)) for name, (system, experiment) in cases.items()}
        name = what if scenario is not None else Path(what).name.removesuffix(".ssp")
        try:
            runs = run_cases(cases, record=record, progress=not as_json)
        except (SimulationStopped, SimulationInterrupted) as early:
            raise early.kept(write_trajectory(out / "results.csv", early.trajectory)) from early
        rows = min(r.time.size for r in runs.values())
        decimation = max(1, rows // DECIMATED_ROWS) if len(runs) > 1 else 1
        results = write_trajectory(out / "results.csv", joined(runs, decimation))
        write_ssp(out / f"{name}.ssp", cases)
        metrics = statistics(cases, runs, getattr(scenario, "quantities", None))
        if scenario is None:
            from ..cosim.system_report import write_system_report

            report, beside = write_system_report(out / "report.html", name, cases, runs), metrics
        else:
            beside = scenario.comparison(cases)
            report = scenario.write_scenario_report(out / "report.html", runs, metrics, beside)
            beside = {**metrics, **beside}
    for line in dict.fromkeys(message for r in runs.values() for message in r.messages):
        typer.echo(line, err=True)
    if as_json:
        print_json({"metrics": beside, "results": str(results), "report": str(report)})
        return
    _print(metrics)
    typer.echo(f"results {results}\nreport  {report}")


def _built(models: tuple[str, ...], folder: Path) -> dict[str, Path]:
    from ..fmu.build import build_fmu
    from ..kernel import kernel

    return {model: build_fmu(kernel(model), folder) for model in models}


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
