"""``tsm-fmu sample``: a log that comes with the package, to try the other verbs on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .app import AsJson, app, print_json
from .outputs import check_output_file


@app.command("sample")
def sample(
    name: Annotated[str, typer.Argument(metavar="sine|multisine", help="Which motion.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="CSV, CSV.gz or Parquet to write.")],
    as_json: AsJson = False,
) -> None:
    """Write a sample log of a paired tendon-sheath drive."""
    from ..logs.record import write_record
    from ..verbs.samples import sample as read_sample

    check_output_file(out, (".csv", ".csv.gz", ".parquet"))
    run = read_sample(name)
    write_record(out, run.time, run.columns, run.units)
    if as_json:
        print_json({"run": str(out)})
    else:
        typer.echo(out)
