"""What a log's columns are: names, units and factors given by options, in Python, or in ``log.toml`` beside the log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..models.contract import InputError
from .header import name_and_unit
from .plain_toml import read_toml
from .table import Column

__all__ = ["MAPPING_FILE", "LogMapping", "mapped", "mapping_beside", "scaled"]

MAPPING_FILE = "log.toml"
"""Read for every log of the folder it lies in."""


@dataclass(frozen=True)
class LogMapping:
    """What columns are.

    Attributes
    ----------
    names : mapping of str to str
        Column of the log to ``name`` or ``name [unit]``; the unit may have a factor, ``x_in [0.0314 deg]``.
    scales : mapping of str to float
        Factor by name, before or after renaming.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)


def mapping_beside(path: Path) -> LogMapping | None:
    """The folder's ``log.toml``; None where there is none.

    Raises
    ------
    InputError
        Not TOML, or other keys than ``map`` and ``scale``.
    """
    file = path.parent / MAPPING_FILE
    try:
        if not file.is_file():
            return None
        data = read_toml(file)
    except (OSError, ValueError) as failure:
        reason = " ".join(str(failure).split())[:120]
        raise InputError(
            f"{file}: {reason} -- expected TOML with tables map and scale -- correct or remove it"
        ) from None
    names, scales = data.pop("map", {}), data.pop("scale", {})
    if data:
        raise InputError(f"{file}: {next(iter(data))!r} -- expected the tables map and scale -- remove or rename it")
    _check_table(file, "map", names, str, "a text such as 'x_in [deg]'")
    _check_table(file, "scale", scales, (int, float), "a number such as -1")
    return LogMapping(names, scales)


def mapped(
    where: str, columns: list[Column], given: LogMapping, beside: LogMapping | None
) -> tuple[list[Column], list[str]]:
    """Columns under the names and units given; what was given counts before what lies beside the log.

    Raises
    ------
    InputError
        A column that was named and is not there, or two columns of one name.
    """
    known = {key for column in columns for key in (column.name, column.cell)}
    for log, text in given.names.items():
        if log not in known:
            names = ", ".join(column.name for column in columns[:20])
            raise InputError(
                f"--map {log}={text}: {where} has no column {log!r} -- expected one of {names} -- correct the name"
            )
    notes: list[str] = []
    merged = dict(given.names)
    if beside is not None:
        used = {log: text for log, text in beside.names.items() if log in known and log not in merged}
        merged.update(used)
        notes += [f"{MAPPING_FILE}: {log} is {text}" for log, text in used.items()]
        absent = [log for log in beside.names if log not in known]
        if absent:
            notes.append(f"{MAPPING_FILE} beside it names {', '.join(absent)}, which this log has not")
    new = []
    for column in columns:
        text = merged.get(column.name, merged.get(column.cell))
        if text is None:
            new.append(column)
            continue
        name, unit = name_and_unit(text)
        if not name or name.startswith("["):
            raise InputError(
                f"--map {column.name}={text} -- expected a name, or a name with a unit -- for example x_in [deg]"
            )
        if unit is not None and column.unit is not None and unit != column.unit:
            notes.append(f"{name}: unit {unit} as it was given, the header says {column.unit}")
        new.append(replace(column, name=name, unit=unit or column.unit))
    names = [column.name for column in new]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"--map: two columns of {where} are called {name!r} -- expected different names -- map the other away"
            )
    return new, notes


def scaled(
    where: str, columns: list[Column], given: LogMapping, beside: LogMapping | None
) -> tuple[dict[str, float], list[str]]:
    """Factors by new name.

    Raises
    ------
    InputError
        A channel that is not there, two factors for one, or a factor that is 0 or not finite.
    """
    by_log = {column.cell or column.name: column.name for column in columns}
    by_log |= {name_and_unit(cell)[0]: name for cell, name in by_log.items()}
    names = [column.name for column in columns]
    factors: dict[str, float] = {}
    for name, factor in given.scales.items():
        new = name if name in names else by_log.get(name, name)
        if new not in names:
            raise InputError(
                f"--scale {name}: {where} has no such channel -- expected one of {', '.join(names[:20])} "
                "-- correct the name"
            )
        if new in factors:
            raise InputError(f"--scale {name}: {new!r} has a factor already -- expected one -- remove the other")
        factors[new] = _factor(name, factor)
    notes = []
    for name, factor in (beside.scales if beside else {}).items():
        new = name if name in names else by_log.get(name, name)
        if new in names and new not in factors:
            factors[new] = _factor(name, factor)
            notes.append(f"{MAPPING_FILE}: {new} times {factor:g}")
    return factors, notes


def _factor(name: str, factor: float) -> float:
    if not np.isfinite(factor) or factor == 0.0:
        raise InputError(f"--scale {name}={factor} -- expected a finite number other than 0 -- for example -1")
    return float(factor)


def _check_table(file: Path, key: str, table: Any, kind: Any, expected: str) -> None:
    if not isinstance(table, dict):
        raise InputError(f"{file}: {key} is {table!r} -- expected a table [{key}] -- correct it")
    for name, value in table.items():
        if not isinstance(value, kind) or isinstance(value, bool):
            raise InputError(f"{file}: {key}.{name} = {str(value)[:40]} -- expected {expected} -- correct it")
