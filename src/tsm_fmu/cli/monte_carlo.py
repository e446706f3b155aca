"""``tsm-fmu monte-carlo``: tolerance bands of a loop from the uncertainty of fitted models."""

from __future__ import annotations

from typing import Annotated

import typer

from .app import AsJson, app, print_result, settings
from .systems import (
    TIME_LIMIT,
    Case,
    Folder,
    Isolate,
    Jacobi,
    Loops,
    Scheduler,
    Step,
    StepError,
    StopTime,
    System,
    TimeLimit,
    Values,
    Workers,
)  # fmt: skip


@app.command("monte-carlo")
def monte_carlo(
    what: System,
    card: Annotated[
        list[str],
        typer.Option("--card", metavar="COMPONENT=CARD", help="Model card of 'identify' to draw from; repeatable."),
    ],
    out: Folder,
    draws: Annotated[int, typer.Option(metavar="N", help="How many parameter sets are drawn.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same draws.")] = 0,
    signal: Annotated[
        str | None,
        typer.Option(metavar="COMPONENT.VARIABLE", help="What the bands are of; default the tracking error."),
    ] = None,
    values: Values = [],  # noqa: B006  typer reads it
    case: Case = [],  # noqa: B006
    stop: StopTime = None,
    step: Step = None,
    jacobi: Jacobi = False,
    loops: Loops = None,
    isolate: Isolate = None,
    time_limit: TimeLimit = TIME_LIMIT,
    step_error: StepError = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Draw parameters from model cards and co-simulate each set: tolerance bands of the closed loop's error."""
    from ..verbs.monte_carlo import monte_carlo as drawn

    result = drawn(
        what, settings(card, "--card"), draws=draws, seed=seed, signal=signal, out=out, values=settings(values),
        case=case, stop=stop, step=step, jacobi=jacobi, loops=loops, isolate=isolate, time_limit=time_limit,
        step_error=step_error, workers=workers, scheduler=scheduler, progress=not as_json,
        notes=lambda line: typer.echo(line, err=True),
    )  # fmt: skip
    print_result(result, result.failures, as_json)
