"""``tsm-fmu simulate``: replay a measured run through an FMU, a model card or a model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .app import AsJson, app, number_settings, print_json, settings
from .outputs import check_output_file
from .runs import Cutoff, Input, Map, Scale, Start, Stop, read_runs
from .systems import TIME_LIMIT, Isolate, TimeLimit


@app.command("simulate")
def simulate(
    what: Annotated[str, typer.Argument(metavar="FMU|CARD|MODEL[:PRESET][+EFFECT...]", help="What to simulate.")],
    measured: Input,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Results: .csv, .csv.gz or .parquet.")],
    values: Annotated[list[str], typer.Option("--set", metavar="P=V", help="Parameter value, SI; repeatable.")] = [],  # noqa: B006
    start: Start = None,
    stop: Stop = None,
    maps: Map = [],  # noqa: B006
    scales: Scale = [],  # noqa: B006
    cutoff: Cutoff = None,
    isolate: Isolate = None,
    time_limit: TimeLimit = TIME_LIMIT,
    as_json: AsJson = False,
) -> None:
    """Replay a record; RMSE and peak-to-peak error of every output that was measured."""
    from ..cosim.trajectory import SimulationInterrupted, SimulationStopped
    from ..verbs.simulate import simulate as replay_run

    check_output_file(out, (".csv", ".csv.gz", ".parquet"), [measured], make_folder=True)
    (record,) = read_runs([measured], start, stop, maps, scales)
    settled = settings(values)
    try:
        result = replay_run(
            what,
            record,
            values=settled if what.endswith(".fmu") else number_settings(settled),
            cutoff=cutoff,
            isolate=isolate,
            time_limit=time_limit,
        )
    except (SimulationStopped, SimulationInterrupted) as early:
        raise early.keep(out) from early
    result.write(out)
    for line in result.trajectory.messages:
        typer.echo(line, err=True)
    if as_json:
        print_json(result.as_json())
    else:
        typer.echo(f"{result.summary()}\nresults {out}")
