"""``tsm-fmu run``: co-simulate a scenario or an SSP."""

from __future__ import annotations

from .app import AsJson, app, print_result, settings
from .systems import (
    TIME_LIMIT,
    Case,
    Folder,
    Isolate,
    Jacobi,
    Loops,
    Step,
    StepError,
    StopTime,
    System,
    TimeLimit,
    Values,
)


@app.command("run")
def run(
    what: System,
    out: Folder,
    values: Values = [],  # noqa: B006  typer reads it
    case: Case = [],  # noqa: B006
    stop: StopTime = None,
    step: Step = None,
    jacobi: Jacobi = False,
    loops: Loops = None,
    isolate: Isolate = None,
    time_limit: TimeLimit = TIME_LIMIT,
    step_error: StepError = None,
    as_json: AsJson = False,
) -> None:
    """Co-simulate a scenario or an SSP: results, statistics, report, and the system as .ssp."""
    from ..verbs.run import run as run_system

    result = run_system(
        what, out=out, values=settings(values), case=case, stop=stop, step=step, jacobi=jacobi, loops=loops,
        isolate=isolate,
        time_limit=time_limit, step_error=step_error, progress=not as_json,
    )  # fmt: skip
    print_result(result, result.messages, as_json)
