"""``tsm-fmu step-study``: what the communication step and the order of exchange cost."""

from __future__ import annotations

from typing import Annotated

import typer

from .app import AsJson, app, print_json, settings
from .systems import TIME_LIMIT, Case, Isolate, Loops, Step, StopTime, System, TimeLimit, Values


@app.command("step-study")
def step_study(
    what: System,
    halvings: Annotated[int, typer.Option("--halvings", min=1, max=10, help="How often the step is halved.")] = 3,
    values: Values = [],  # noqa: B006  typer reads it
    case: Case = [],  # noqa: B006
    stop: StopTime = None,
    step: Step = None,
    loops: Loops = None,
    isolate: Isolate = None,
    time_limit: TimeLimit = TIME_LIMIT,
    as_json: AsJson = False,
) -> None:
    """What the communication step and the order of exchange cost: differences of all signals, observed orders."""
    from ..verbs.step_study import step_study as study

    result = study(
        what, halvings=halvings, values=settings(values), case=case, stop=stop, step=step, loops=loops, isolate=isolate,
        time_limit=time_limit,
    )  # fmt: skip
    print_json(result.as_json()) if as_json else typer.echo(result.summary())
