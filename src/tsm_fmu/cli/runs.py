"""What every verb that reads measured runs shares: the options, and reading with unique names."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from ..logs.record import Record, read_record
from ..logs.samples import check_size
from ..models.contract import InputError
from .app import settings

__all__ = [
    "Cutoff", "Holdout", "Input", "Map", "Measured", "ReadOptions", "Run", "Scale", "Start", "Stop", "read_runs",
]  # fmt: skip

_RUN = "CSV, CSV.gz or Parquet with header cells 'name [unit]', first column 'time [s]'"
Run = Annotated[Path, typer.Argument(metavar="RUN", help=f"Measured run: {_RUN}.", show_default=False)]
Measured = Annotated[list[Path], typer.Option("--measured", metavar="RUN", help=f"Run to fit: {_RUN}; repeatable.")]
Holdout = Annotated[list[Path], typer.Option("--holdout", metavar="RUN", help="Run to judge, not fitted; repeatable.")]
Input = Annotated[Path, typer.Option("--input", metavar="RUN", help=f"Run to replay: {_RUN}.")]
Start = Annotated[float | None, typer.Option("--from", metavar="S", help="Leave out what is before this time [s].")]
Stop = Annotated[float | None, typer.Option("--to", metavar="S", help="Leave out what is after this time [s].")]
Map = Annotated[list[str], typer.Option("--map", metavar="LOG=NAME", help="Rename a column of the log; repeatable.")]
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


@dataclass(frozen=True)
class ReadOptions:
    """Options that apply to every run of a command."""

    start: float | None = None
    stop: float | None = None
    renames: dict[str, str] = field(default_factory=dict)
    scales: dict[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls, start: float | None = None, stop: float | None = None, maps: Sequence[str] = (), scales: Sequence[str] = ()
    ) -> ReadOptions:
        """From the command line's texts.

        Raises
        ------
        InputError
            If a text is not ``name=value``, repeats a name, or a factor is not a number.
        """
        factors = {}
        for name, text in settings(scales, "--scale").items():
            try:
                factors[name] = float(text)
            except ValueError:
                raise InputError(f"--scale {name}={text} -- expected a number -- for example {name}=-1") from None
        renames = settings(maps, "--map")
        for log, name in renames.items():
            if not name.strip():
                raise InputError(f"--map {log}= -- expected a name after '=' -- for example {log}=x_in")
        return cls(start, stop, renames, factors)


def read_runs(paths: Sequence[Path], options: ReadOptions | None = None) -> list[Record]:
    """Read runs in order, with unique names: the stem, with as many folders as it takes to tell runs apart.

    Raises
    ------
    InputError
        If a file is given twice, or one cannot be read.
    """
    options = options or ReadOptions()
    whole = [path.expanduser().absolute() for path in paths]
    for path, times in Counter(p.resolve() for p in whole).items():
        if times > 1:
            raise InputError(f"run {path} is given {times} times -- expected each run once -- remove the repetition")
    records = [
        read_record(
            path, renames=options.renames, scales=options.scales, start=options.start, stop=options.stop, name=name
        )
        for path, name in zip(paths, _names(whole), strict=True)
    ]
    for record in records:
        check_size(str(record.source), record.time, record.columns, record.first_row)
    return records


def _names(paths: Sequence[Path]) -> list[str]:
    stems = [p.name.removesuffix(".gz").removesuffix(".csv").removesuffix(".parquet") for p in paths]
    names, depth = list(stems), 0
    while len(set(names)) < len(names) and depth < max(len(p.parts) for p in paths):
        depth += 1
        taken = Counter(names)
        names = [
            "/".join((*p.parts[-1 - depth : -1], stem)) if taken[name] > 1 else name
            for p, stem, name in zip(paths, stems, names, strict=True)
        ]
    return names if len(set(names)) == len(names) else [p.name for p in paths]
