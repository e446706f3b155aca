"""``tsm-fmu identify``: measured runs in, a model card out."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from ..verbs.models import resolve_model
from .app import AsJson, app, number_settings, print_json, settings
from .outputs import check_output_file
from .runs import Cutoff, Holdout, Map, Measured, Scale, Start, Stop, read_runs

if TYPE_CHECKING:
    from ..regression.solver import Progress


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
    as_json: AsJson = False,
) -> None:
    """Fit a model's parameters to measured runs and write a model card."""
    from ..verbs.identify import identify as fit_runs

    check_output_file(out, (".toml",), [*measured, *holdout])
    if report is not None:
        check_output_file(report, (".html",), [*measured, *holdout], option="--report")
    values = number_settings(settings(set_))
    resolve_model(model).params(values)  # what is wrong here is said before the runs are read
    records = read_runs([*measured, *holdout], start, stop, maps, scales)
    with _progress() as progress:
        result = fit_runs(
            model,
            records[: len(measured)],
            holdout=records[len(measured) :],
            values=values,
            fixed=fix,
            shared=shared,
            nuisance=nuisance,
            method=method,
            single_start=single_start,
            intervals=intervals,
            cutoff=cutoff,
            seed=seed,
            progress=progress,
        )
    result.write_card(out)
    page = {} if report is None else {"report": str(result.write_report(report))}
    if as_json:
        print_json({**result.as_json(), "card": str(out), **page, "notes": list(result.notes)})
    else:
        typer.echo(result.summary())
        typer.echo(f"{out}  ({result.fit.evaluations} simulations, {result.fit.wall_s:.2f} s)")
        for kind, path in page.items():
            typer.echo(f"{kind} {path}")
    if not result.complete:
        raise KeyboardInterrupt(f"interrupted; the best until then is kept in {out}")


class _progress:
    """Current error on stderr, on a terminal only; a few times a second."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        self._status = self._console.status("identify") if sys.stderr.isatty() else None
        self._last = 0.0

    def __enter__(self) -> Callable[[Progress], None] | None:
        if self._status is None:
            return None
        self._status.start()
        return self._update

    def __exit__(self, *_: object) -> None:
        if self._status is not None:
            self._status.stop()

    def _update(self, at: Progress) -> None:
        now = time.monotonic()
        if self._status is not None and now - self._last > 0.2:
            self._last = now
            self._status.update(
                f"identify {at.number}/{at.phases}: {at.phase}; weighted error {at.error:.5g} after {at.simulations} "
                "simulations  (Ctrl-C keeps the best)"
            )
