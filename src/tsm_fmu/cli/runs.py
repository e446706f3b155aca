"""What every verb that reads measured runs shares: the options, and reading with unique names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..models.contract import InputError
from .app import settings

if TYPE_CHECKING:
    from ..logs.record import Record

__all__ = [
    "Cutoff", "Holdout", "Input", "Map", "Measured", "Run", "Scale", "Start", "Stop", "read_runs",
]  # fmt: skip

_RUN = "CSV, Parquet, Excel, MATLAB, HDF5, TDMS or ROS file with 'time [s]' and columns 'name [unit]' (else see --map)"
Run = Annotated[list[Path], typer.Argument(metavar="RUN...", help=f"Measured run: {_RUN}.", show_default=False)]
Measured = Annotated[list[Path], typer.Option("--measured", metavar="RUN", help=f"Run to fit: {_RUN}; repeatable.")]
Holdout = Annotated[list[Path], typer.Option("--holdout", metavar="RUN", help="Run to judge, not fitted; repeatable.")]
Input = Annotated[Path, typer.Option("--input", metavar="RUN", help=f"Run to replay: {_RUN}.")]
Start = Annotated[float | None, typer.Option("--from", metavar="S", help="Leave out what is before this time [s].")]
Stop = Annotated[float | None, typer.Option("--to", metavar="S", help="Leave out what is after this time [s].")]
Map = Annotated[
    list[str],
    typer.Option(
        "--map",
        metavar="LOG=NAME [UNIT]",
        help="What a column of the log is, with its unit if the log has none: 'angle_deg=x_in [deg]', "
        "'enc=x_out [360/4096 deg]'; repeatable. A log.toml beside the log holds the same.",
    ),
]
Scale = Annotated[
    list[str], typer.Option("--scale", metavar="NAME=FACTOR", help="Multiply a column (-1 turns it); repeatable.")
]


def _frequency(value: float | None) -> float | None:
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise InputError(
            f"--cutoff {value:g} -- expected a frequency above 0 Hz -- leave it out to take it from the data"
        )
    return value


Cutoff = Annotated[
    float | None,
    typer.Option(
        "--cutoff",
        metavar="HZ",
        callback=_frequency,
        help="Cut-off [Hz] where v and a are derived from x; else from the data.",
    ),
]


def read_runs(
    paths: Sequence[Path], start: float | None, stop: float | None, maps: Sequence[str], scales: Sequence[str]
) -> list[Record]:
    """Read the runs of a command, all with the same options.

    Parameters
    ----------
    paths : sequence of Path
    start, stop : float, optional
        Window [s].
    maps, scales : sequence of str
        ``LOG=NAME`` or ``LOG=NAME [UNIT]``, and ``NAME=FACTOR`` as they stand on the command line.

    Raises
    ------
    InputError
        If a text is not ``name=value``, repeats a name, or a factor is not a number; if a file is given twice or
        cannot be read.
    """
    from ..verbs.runs import ReadOptions, records_of

    factors = {}
    for name, text in settings(scales, "--scale").items():
        try:
            factors[name] = float(text)
        except ValueError:
            raise InputError(f"--scale {name}={text} -- expected a number -- for example {name}=-1") from None
    mapping = settings(maps, "--map")
    for log, name in mapping.items():
        if not name.strip():
            raise InputError(f"--map {log}= -- expected a name after '=' -- for example {log}=x_in")
    records = records_of(list(paths), ReadOptions(start, stop, mapping, factors))
    runs_of_note: dict[str, list[str]] = {}
    for record in records:
        for note in record.notes:
            runs_of_note.setdefault(note, []).append(record.name)
    for note, names in runs_of_note.items():  # once for all the runs that it is true of
        typer.echo(f"{', '.join(names)}: {note}", err=True)
    return records
