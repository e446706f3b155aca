"""``tsm-fmu linearize``: a unit or a loop about a working point."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .app import AsJson, app, print_json, settings
from .systems import TIME_LIMIT, Case, Isolate, Jacobi, Loops, Step, TimeLimit, Values


@app.command("linearize")
def linearize(
    what: Annotated[str, typer.Argument(metavar="SCENARIO|FILE.ssp|FILE.fmu", help="Scenario, system or unit.")],
    at: Annotated[float, typer.Option("--at", metavar="S", help="When the working point is reached [s].")],
    source: Annotated[
        list[str],
        typer.Option("--input", metavar="COMPONENT.VARIABLE", help="Input; of an FMU VARIABLE; repeatable."),
    ] = [],  # noqa: B006  typer reads it
    output: Annotated[
        list[str],
        typer.Option("--output", metavar="COMPONENT.VARIABLE", help="Output that is looked at; repeatable."),
    ] = [],  # noqa: B006
    closed: Annotated[bool, typer.Option("--closed", help="Leave the loop closed at the input.")] = False,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for a page.")] = None,
    values: Values = [],  # noqa: B006  typer reads it
    case: Case = [],  # noqa: B006
    step: Step = None,
    jacobi: Jacobi = False,
    loops: Loops = None,
    amplitude: Annotated[
        float | None, typer.Option("--amplitude", help="Of the impulse, in the unit of the input.")
    ] = None,
    horizon: Annotated[
        float | None, typer.Option("--horizon", metavar="S", help="How long the response is looked at [s].")
    ] = None,
    order: Annotated[int | None, typer.Option("--order", min=1, max=100, help="Order; found without it.")] = None,
    isolate: Isolate = None,
    time_limit: TimeLimit = TIME_LIMIT,
    as_json: AsJson = False,
) -> None:
    """Linearise a unit or a loop about a working point: state space, Bode plot, margins beside the design's."""
    from ..verbs.linearize import linearize as linearize_system

    result = linearize_system(
        what, at, input=source, output=output, closed=closed, out=out, values=settings(values), case=case, step=step,
        jacobi=jacobi, loops=loops, amplitude=amplitude, horizon=horizon, order=order, isolate=isolate,
        time_limit=time_limit,
    )  # fmt: skip
    if as_json:
        print_json(result.as_json())
    else:
        typer.echo(result.summary())
        if result.report is not None:
            typer.echo(f"report  {result.report}")
