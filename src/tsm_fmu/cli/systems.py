"""The options of a co-simulation, for `run`, `sweep` and `simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..verbs import TIME_LIMIT as TIME_LIMIT

System = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO|FILE.ssp", help="Scenario by name, or a system: an archive, or its unpacked folder."
    ),
]
Folder = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for all results.")]
Values = Annotated[
    list[str], typer.Option("--set", metavar="COMPONENT.VARIABLE=VALUE", help="Start value; repeatable.")
]
Case = Annotated[list[str], typer.Option("--case", help="Run this case only; repeatable.")]
StopTime = Annotated[float | None, typer.Option("--stop", metavar="S", help="Stop time [s].")]
Step = Annotated[float | None, typer.Option("--step", metavar="S", help="Communication step [s].")]
Isolate = Annotated[
    bool | None,
    typer.Option(
        "--isolate/--no-isolate",
        help="A process for each FMU, which it may crash or hang, or none. Default: for those that are not ours.",
    ),
]
TimeLimit = Annotated[
    float, typer.Option("--time-limit", metavar="S", help="Longest time of one call of an FMU there [s].")
]
Loops = Annotated[
    str | None,
    typer.Option("--loops", metavar="HOW", help="Algebraic loops: refuse (default), delay by a step, or iterate."),
]
Jacobi = Annotated[bool, typer.Option("--jacobi", help="Exchange all values at once (default Gauss-Seidel).")]
Workers = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", min=1, help="Local processes; default one a processor."),
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Work on the workers of this Dask scheduler instead."),
]
StepError = Annotated[
    float | None,
    typer.Option(
        "--step-error",
        metavar="SHARE",
        help="Divide the step where its error is larger than this share of a signal (0.001), rolling FMUs back.",
    ),
]
