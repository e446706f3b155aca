"""``tsm-fmu sweep``: a scenario or an SSP at every point of a grid of start values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import typer

from ..models.contract import InputError
from .app import AsJson, app, print_result, refuse_failures, settings
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
)


@app.command("sweep")
def sweep(
    what: System,
    vary: Annotated[
        list[str],
        typer.Option(
            "--vary",
            metavar="NAME=VALUES",
            help="COMPONENT.VARIABLE=A:B:N (N values from A to B) or =V,W,...; COMPONENT=CARD.toml,... or "
            "=FILE.fmu,...; flavour=native,python; seed=1,2,... for all that have one; repeatable: a grid.",
        ),
    ],
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
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Co-simulate at every point of a grid: sweep.parquet, .csv and .json, and a report."""
    from ..verbs.sweep import sweep as sweep_system

    settled, varied = settings(values), _varied(vary)
    if both := [name for name in varied if name in settled]:
        raise InputError(f"--vary and --set {both[0]} -- expected one of them -- drop the --set")
    result = sweep_system(
        what, varied, out=out, values=settled, case=case, stop=stop, step=step, jacobi=jacobi, loops=loops,
        isolate=isolate, workers=workers, scheduler=scheduler,
        time_limit=time_limit, step_error=step_error, progress=not as_json,
        notes=lambda line: typer.echo(line, err=True),
    )  # fmt: skip
    print_result(result, result.failures, as_json)
    refuse_failures(result, result.points, "points")


def _varied(texts: Sequence[str]) -> dict[str, Sequence[float | str]]:
    """Values by name: ``name=a:b:n``, evenly spaced, both ends included, or ``name=v,w,...``."""
    return {name: _values(name, text) for name, text in settings(texts, "--vary").items()}


def _values(name: str, text: str) -> Sequence[float | str]:
    import numpy as np

    from ..cosim.sweep import MOST_POINTS

    example = "for example load.k=0.05:0.2:4 or load.k=0.05,0.1"
    if ":" not in text or text.endswith((".toml", ".fmu")):
        found: list[float | str] = [_number(part) for part in text.split(",")]
        if "" in found or len(set(found)) < len(found):
            raise InputError(f"--vary {name}={text} -- expected A:B:N, or values with commas, each once -- {example}")
        return found
    try:
        first, last, number = text.split(":")
        a, b, n = float(first), float(last), int(number)
    except ValueError:
        a, b, n = math.nan, math.nan, 0
    if not (math.isfinite(a) and math.isfinite(b) and n >= 2 and a != b):
        raise InputError(
            f"--vary {name}={text} -- expected A:B:N, two different finite numbers and 2 or more points -- {example}"
        )
    if n > MOST_POINTS:
        raise InputError(f"--vary {name}={text} -- expected at most {MOST_POINTS} points -- take fewer")
    return np.linspace(a, b, n).tolist()


def _number(text: str) -> float | str:
    try:
        value = float(text)
    except ValueError:
        return text.strip()
    if not math.isfinite(value):
        raise InputError(f"--vary value {text} -- expected a finite number -- correct it")
    return value
