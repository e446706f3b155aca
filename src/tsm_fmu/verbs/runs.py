"""What a verb takes as measured runs: files, records, DataFrames, or several of them."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ..logs.record import Record, read_record
from ..logs.samples import check_size
from ..logs.table import stem_of
from ..models.contract import InputError

if TYPE_CHECKING:
    import pandas as pd

RunLike: TypeAlias = "str | os.PathLike[str] | Record | pd.DataFrame"
"""A measured run: a file that `read_record` reads, a record, or a DataFrame with header cells ``name [unit]``."""


@dataclass(frozen=True)
class ReadOptions:
    """How files and DataFrames are read, see `read_record`; a `Record` is taken as it is."""

    start: float | None = None
    stop: float | None = None
    mapping: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)


def records_of(runs: RunLike | Sequence[RunLike], options: ReadOptions | None = None) -> list[Record]:
    """Records in the order given, with unique names.

    A file is called by its stem, with as many folders as it takes to tell files apart; a DataFrame by
    ``attrs["name"]``, or ``run N`` after its place.

    Parameters
    ----------
    runs : path, Record, DataFrame, or a sequence of them
    options : ReadOptions, optional
        For files and DataFrames.

    Raises
    ------
    InputError
        A file given twice, two runs of one name, or a run that cannot be read.
    """
    many = _listed(runs)
    files = [Path(run) for run in many if isinstance(run, (str, os.PathLike))]
    names = iter(_names_of(files))
    records = [_record(run, number, names, options or ReadOptions()) for number, run in enumerate(many, 1)]
    for name, times in Counter(record.name for record in records).items():
        if times > 1:
            raise InputError(f"{times} runs are called {name!r} -- expected a name each -- read_record(run, name=...)")
    for record in records:
        check_size(str(record.source or record.name), record.time, record.columns, record.first_row)
    return records


def grouped(*groups: RunLike | Sequence[RunLike]) -> list[list[Record]]:
    """Records of several groups of runs, with names that are unique over all of them."""
    sizes = [len(_listed(group)) for group in groups]
    records = iter(records_of([run for group in groups for run in _listed(group)]))
    return [list(islice(records, size)) for size in sizes]


def _listed(runs: Any) -> Sequence[Any]:
    return runs if isinstance(runs, Sequence) and not isinstance(runs, str) else [runs]


def _record(run: Any, number: int, names: Any, options: ReadOptions) -> Record:
    if isinstance(run, Record):
        return run
    name = next(names) if isinstance(run, (str, os.PathLike)) else str(getattr(run, "attrs", {}).get("name", ""))
    return read_record(
        run, mapping=options.mapping, scales=options.scales, start=options.start, stop=options.stop,
        name=name or f"run {number}",
    )  # fmt: skip


def _names_of(paths: Sequence[Path]) -> list[str]:
    whole = [Path(os.path.expanduser(path)).absolute() for path in paths]
    # not Path.resolve(), which raises for a loop of links and for a zero byte: reading says it better
    for path, times in Counter(str(p) if "\0" in str(p) else os.path.realpath(p) for p in whole).items():
        if times > 1:
            raise InputError(f"run {path} is given {times} times -- expected each run once -- remove the repetition")
    stems = [stem_of(p) for p in whole]
    names, depth = list(stems), 0
    while len(set(names)) < len(names) and depth < max(len(p.parts) for p in whole):
        depth += 1
        taken = Counter(names)
        names = [
            "/".join((*p.parts[-1 - depth : -1], stem)) if taken[name] > 1 else name
            for p, stem, name in zip(whole, stems, names, strict=True)
        ]
    return names if len(set(names)) == len(names) else [p.name for p in whole]
