"""``tsm-fmu identify``: measured runs in, a model card out."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from ..models.contract import InputError, Variable
from .app import app, print_json, settings
from .model_argument import model_argument, number_settings
from .outputs import check_output_file
from .runs import Cutoff, Holdout, Map, Measured, ReadOptions, Scale, Start, Stop, read_runs

if TYPE_CHECKING:  # the library behind them takes a second to import: only this verb pays
    from ..identification.fit import Fit
    from ..logs.agreement import Agreement


class Method(StrEnum):
    """How the parameters are searched."""

    FAST = "fast"
    PAPER = "paper"


class IntervalMethod(StrEnum):
    """Where the 95 % intervals come from."""

    LINEAR = "linear"
    PROFILE = "profile"


@app.command("identify")
def identify(
    model: Annotated[str, typer.Argument(metavar="MODEL[:PRESET][+EFFECT...]|CARD", help="What to fit, from where.")],
    measured: Measured,
    out: Annotated[Path, typer.Option(metavar="CARD", help="Model card to write (TOML).")],
    holdout: Holdout = [],  # noqa: B006  typer copies it
    method: Annotated[Method, typer.Option(help="fast: least squares; paper: genetic, then simplex.")] = Method.FAST,
    single_start: Annotated[
        bool, typer.Option("--single-start", help="Refine the start values only; try no others.")
    ] = False,
    intervals: Annotated[
        IntervalMethod, typer.Option(help="linear: from standard errors; profile: of the error itself, slower.")
    ] = IntervalMethod.LINEAR,
    set_: Annotated[list[str], typer.Option("--set", metavar="P=V", help="Start value [SI]; repeatable.")] = [],  # noqa: B006
    fix: Annotated[list[str], typer.Option(metavar="P", help="Parameter that is not fitted; repeatable.")] = [],  # noqa: B006
    shared: Annotated[
        list[str], typer.Option(metavar="P", help="One value for all runs of an offset or initial state; repeatable.")
    ] = [],  # noqa: B006
    nuisance: Annotated[
        list[str],
        typer.Option(metavar="KIND@CHANNEL", help="delay@CHANNEL or offset@CHANNEL, fitted too; repeatable."),
    ] = [],  # noqa: B006
    report: Annotated[Path | None, typer.Option(metavar="HTML", help="Write a page with plots and tables.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same result.")] = 0,
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Fit a model's parameters to measured runs and write a model card."""
    from ..card import write_card
    from ..identification.fit import fit
    from ..identification.nuisance import limit_delays, with_nuisance
    from ..identification.result import as_json as json_of
    from ..identification.result import model_card
    from ..logs.record import cutoff_note, kernel_inputs
    from ..regression.specification import fit_parameters, fit_run, measured_channels, per_run_fields

    chosen = model_argument(model)
    extended = with_nuisance(chosen.kernel, chosen.effects, nuisance)
    kernel = extended.kernel
    values = number_settings(settings(set_))
    parameters = fit_parameters(kernel, chosen.preset or None, values, [*fix, *extended.fixed], chosen.card)
    check_output_file(out, (".toml",), [*measured, *holdout])
    if report is not None:
        check_output_file(report, (".html",), [*measured, *holdout], option="--report")
    if report is not None and report.suffix != ".html":
        raise InputError(f"--report {report} -- expected a name that ends in .html -- rename it")
    options = ReadOptions.of(start, stop, maps, scales)
    records = read_runs([*measured, *holdout], options)
    channels = measured_channels(kernel, records)
    runs = [fit_run(kernel, record, channels, cutoff) for record in records]
    limit_delays(parameters, extended.delays, runs)
    with _progress() as progress:
        result = fit(
            kernel,
            runs[: len(measured)],
            channels,
            parameters,
            per_run=per_run_fields(kernel, shared, extended.per_run),
            holdout=runs[len(measured) :],
            method=method,
            single_start=single_start,
            intervals=intervals,
            seed=seed,
            progress=progress,
        )
    used = (records[: len(measured)], records[len(measured) :])
    write_card(out, model_card(result, chosen.preset, *used, extended.effects))
    if report is not None:
        from ..identification.page import write_fit_report

        write_fit_report(report, result, runs, records, extended.effects)
    inputs = [v.name for v in kernel.inputs]
    notes = (*kernel_inputs(records[0], kernel, cutoff).notes, *cutoff_note(cutoff, records, inputs))
    if as_json:
        page = {} if report is None else {"report": str(report)}
        print_json({**json_of(result), "card": str(out), **page, "notes": list(notes)})
    else:
        _print(result, out, notes)
        if report is not None:
            typer.echo(f"report {report}")


class _progress:
    """Current error on stderr, on a terminal only; a few times a second."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        self._status = self._console.status("identify") if sys.stderr.isatty() else None
        self._last = 0.0

    def __enter__(self) -> Callable[[int, float], None] | None:
        if self._status is None:
            return None
        self._status.start()
        return self._update

    def __exit__(self, *_: object) -> None:
        if self._status is not None:
            self._status.stop()

    def _update(self, simulations: int, error: float) -> None:
        now = time.monotonic()
        if self._status is not None and now - self._last > 0.2:
            self._last = now
            self._status.update(
                f"identify: {simulations} simulations, weighted error {error:.5g}  (Ctrl-C keeps the best)"
            )


def _print(result: Fit, out: Path, notes: tuple[str, ...]) -> None:
    console = Console()
    for note in notes:
        console.print(note)
    table = Table(title=f"{result.kernel.name}, method {result.method}", title_justify="left")
    for heading in ("parameter", "value", "standard error", "95 % interval", "unit", ""):
        table.add_column(heading)
    for variable in result.kernel.parameters:
        p = result.parameters[variable.field]
        error = "" if p.stderr is None else f"{p.stderr:.2g}"
        interval = " to ".join(f"{end:.4g}" for end in result.intervals.get(variable.field, ()))
        table.add_row(
            variable.name, f"{p.value:.6g}", error, interval, variable.quantity.unit, _remark(result, variable)
        )
    console.print(table)
    scores = Table("run", "role", "channel", "RMSE", "peak to peak of error", "RMSE/std")
    for name, run in result.runs.items():
        for channel, score in run.channels.items():
            scores.add_row(name, run.role, channel, *_score(score))
    for role, pooled in (("measured", result.measured), ("holdout", result.holdout)):
        for channel, score in pooled.items():
            scores.add_row("all", role, channel, *_score(score), style="bold")
    console.print(scores)
    if result.holdout:
        from ..identification.fit import SETTLING

        console.print(f"Held-out runs: the first {SETTLING:g} s give offset and initial state and are not scored.")
    for channel, floor in result.noise_floor.items():
        unit = result.measured[channel].unit
        value = f"{math.degrees(floor):.4g} deg" if unit == "rad" else f"{floor:.4g} {unit}"
        console.print(f"Noise floor of {channel}: {value}, the part that does not repeat from period to period.")
    for finding in result.findings:
        console.print(f"Note: {finding}.")
    console.print(f"{out}  ({result.evaluations} simulations, {result.wall_s:.2f} s)", soft_wrap=True)


def _remark(result: Fit, variable: Variable) -> str:
    remarks = {
        "fixed": not result.parameters[variable.field].vary,
        "per run, mean": variable.field in result.per_run and len(result.runs) > 1,
        "on a bound": variable.field in result.at_bound,
        "not determined": variable.field in result.undetermined,
    }
    return ", ".join(text for text, holds in remarks.items() if holds)


def _score(score: Agreement) -> tuple[str, str, str]:
    show, unit = (math.degrees, "deg") if score.unit == "rad" else (float, score.unit)
    return f"{show(score.rmse):.4g} {unit}", f"{show(score.peak_to_peak_error):.4g} {unit}", f"{score.nrmse:.3g}"
