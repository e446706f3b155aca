"""Model card: what was fitted, to what, how well it is known. A TOML file of plain data; reading one runs no code.

A card holds the base model, its preset, the effects in order, every parameter with value, unit, standard
error, bounds and fixed flag, the per-run values, how the errors are correlated (`Correlation`), and where it all came
from (`Provenance`).
"""

from __future__ import annotations

import datetime
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from . import __version__
from .kernels.kernel import Kernel, kernel
from .logs.plain_toml import read_toml
from .logs.whole_file import write_whole
from .models.contract import InputError, Variable
from .models.unit_text import simplified

__all__ = ["FORMAT", "CardParameter", "Correlation", "ModelCard", "Provenance", "RecordUsed", "read_card", "write_card"]

FORMAT = 2
READ = (1, 2)
"""Formats that are read; 1 has no correlation."""
_REMEDY = "correct the card, or write it again with 'tsm-fmu identify'"


@dataclass(frozen=True)
class CardParameter:
    """One parameter in SI; ``stderr`` is None where it is not estimated (fixed, or not determined by the log)."""

    value: float
    unit: str
    stderr: float | None = None
    lo: float = -math.inf
    hi: float = math.inf
    fixed: bool = False


@dataclass(frozen=True)
class Correlation:
    """How the errors of fitted parameters go together: with the standard errors it is the covariance of the fit.

    Attributes
    ----------
    names : tuple of str
        Parameters with a standard error, by public name.
    matrix : tuple of tuple of float
        Correlation of their errors.
    logarithm : tuple of str
        Those of `names` whose logarithm is taken as normal, with the standard error ``stderr / |value|``; the others
        are taken as normal themselves.
    """

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]
    logarithm: tuple[str, ...] = ()


@dataclass(frozen=True)
class RecordUsed:
    """A record the fit has seen: its name, the file's SHA-256 ('' in memory), and ``measured`` or ``holdout``."""

    name: str
    sha256: str
    role: str = "measured"


@dataclass(frozen=True)
class Provenance:
    """Where a card comes from: records, package version, random seed, date (UTC, ISO 8601) and method."""

    records: tuple[RecordUsed, ...] = ()
    package_version: str = __version__
    seed: int = 0
    date: str = ""
    method: str = ""


@dataclass(frozen=True)
class ModelCard:
    """A model with its parameters.

    Attributes
    ----------
    model : str
        Name of the base model.
    preset : str
        Parameter set the fit started from.
    effects : tuple of str
        Ids of the added effects, in order.
    parameters : mapping of str to CardParameter
        By public name; for a per-run parameter, the mean over the runs.
    per_run : mapping of str to mapping of str to float
        Values by record name and parameter name.
    provenance : Provenance
    version : int
        Format of the file.
    correlation : Correlation or None
        Of the fit's errors; None where nothing was fitted, or by a version that did not write it.
    """

    model: str
    preset: str = ""
    effects: tuple[str, ...] = ()
    parameters: Mapping[str, CardParameter] = field(default_factory=dict)
    per_run: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    provenance: Provenance = field(default_factory=Provenance)
    version: int = FORMAT
    correlation: Correlation | None = None

    def kernel(self) -> Kernel:
        """The model in kernel form.

        Raises
        ------
        InputError
            Unknown model or effect.
        """
        from .kernels.chain import chain  # imports every effect: a card without any does not pay

        return chain(self.model, self.effects) if self.effects else kernel(self.model)

    def params(self, run: str | None = None) -> Any:
        """Validated parameters of the kernel, with the values of one run where ``run`` names it.

        Raises
        ------
        InputError
            A value out of bounds, a joint condition violated, or a run the card does not hold.
        """
        values = {name: parameter.value for name, parameter in self.parameters.items()}
        if run is not None:
            if run not in self.per_run:
                known = ", ".join(self.per_run) or "(none)"
                raise InputError(f"run {run!r} -- expected one of {known} of the card -- correct the name or fit it")
            values.update(self.per_run[run])
        return self.kernel().params(self.preset or None, values)


def read_card(path: str | os.PathLike[str]) -> ModelCard:
    """Read and check a model card.

    Raises
    ------
    InputError
        File missing or not TOML (with the line), a key missing, unknown or of the wrong type (with its
        name), another format version, an unknown model, parameter or unit, a value out of bounds.
    """
    try:
        data = read_toml(Path(path))
    except OSError as failure:
        raise InputError(f"card {path} -- expected a readable file ({failure.strerror}) -- check the path") from failure
    except UnicodeDecodeError as failure:
        raise InputError(f"card {path} -- expected UTF-8 text (byte {failure.start}) -- {_REMEDY}") from failure
    except ValueError as failure:
        raise InputError(f"card {path}: {failure} -- expected TOML as a verb writes it -- {_REMEDY}") from failure
    source = f"card {path}"
    card = _card(_Table(data, source, ""))
    try:
        declared = card.kernel().by_name
        for name, parameter in card.parameters.items():
            _check_declared(name, parameter, declared)
        card.params()
    except InputError as wrong:
        raise InputError(f"{source}: {wrong}") from wrong
    for run in card.per_run:
        try:
            card.params(run)
        except InputError as wrong:
            raise InputError(f"{source}, per_run.{run}: {wrong}") from wrong
    return card


def write_card(path: str | os.PathLike[str], card: ModelCard) -> None:
    """Write a card; the file appears whole or not at all.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    write_whole(path, tomli_w.dumps(_plain(card), indent=2))


def utc_now() -> str:
    """Date of the provenance; ``SOURCE_DATE_EPOCH`` overrides the clock for reproducible cards."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    clock = datetime.datetime.fromtimestamp(int(epoch), datetime.UTC) if epoch else datetime.datetime.now(datetime.UTC)
    return clock.isoformat(timespec="seconds")


class _Table:
    """A TOML table with its place in the file, so that every complaint names the key."""

    def __init__(self, data: Any, source: str, place: str) -> None:
        self.source, self.place = source, place
        if not isinstance(data, dict):
            raise self.wrong("", data, "a table")
        self.data: dict[str, Any] = data

    def wrong(self, key: str, value: Any, expected: str) -> InputError:
        name = ".".join(part for part in (self.place, key) if part)
        return InputError(f"{self.source}: {name} = {value!r} -- expected {expected} -- {_REMEDY}")

    def get(self, key: str, kind: type, default: Any = None) -> Any:
        """Value of ``key`` with its type checked; no default means that the key must be there."""
        if key not in self.data:
            if default is not None:
                return default
            name = ".".join(part for part in (self.place, key) if part)
            raise InputError(f"{self.source}: no key {name} -- expected {_KINDS[kind]} -- {_REMEDY}")
        value = self.data[key]
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise self.wrong(key, value, _KINDS[kind])
        return value

    def table(self, key: str) -> _Table:
        place = f"{self.place}.{key}" if self.place else key
        return _Table(self.data.get(key, {}), self.source, place)

    def only(self, *known: str) -> None:
        for key, value in self.data.items():
            if key not in known:
                raise self.wrong(key, value, f"one of the keys {', '.join(known)}")


_KINDS: dict[type, str] = {
    float: "a number",
    int: "an integer",
    str: "a string",
    bool: "true or false",
    list: "a list",
}


def _card(root: _Table) -> ModelCard:
    version = root.get("format", int)
    if version not in READ:
        raise root.wrong("format", version, f"format {' or '.join(map(str, READ))}, which this version reads")
    root.only("format", "model", "preset", "effects", "parameters", "per_run", "provenance", "correlation")
    effects = root.get("effects", list, [])
    if not all(isinstance(effect, str) for effect in effects):
        raise root.wrong("effects", effects, "a list of effect ids")
    parameters, per_run = root.table("parameters"), root.table("per_run")
    runs = {name: per_run.table(name) for name in per_run.data}
    fitted = {name: _parameter(parameters.table(name)) for name in parameters.data}
    return ModelCard(
        model=root.get("model", str),
        preset=root.get("preset", str, ""),
        effects=tuple(effects),
        parameters=fitted,
        per_run={name: {key: run.get(key, float) for key in run.data} for name, run in runs.items()},
        provenance=_provenance(root.table("provenance")),
        correlation=_correlation(root.table("correlation"), fitted) if "correlation" in root.data else None,
    )


def _correlation(table: _Table, parameters: Mapping[str, CardParameter]) -> Correlation:
    table.only("names", "matrix", "logarithm")
    names, logarithm = table.get("names", list), table.get("logarithm", list, [])
    known = [name for name, p in parameters.items() if p.stderr is not None]
    if len(set(map(str, names))) < len(names) or not all(name in known for name in names):
        raise table.wrong(
            "names", names, f"parameters that have a stderr ({', '.join(known) or 'none here'}), each once"
        )
    if not all(name in names and parameters[name].value != 0.0 for name in logarithm):
        raise table.wrong("logarithm", logarithm, "some of its names, of values that are not 0")
    matrix, size = table.get("matrix", list), len(names)
    rows = [row if isinstance(row, list) else [] for row in matrix]
    if len(rows) != size or not all(
        len(row) == size and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in row) for row in rows
    ):
        raise table.wrong("matrix", matrix, f"{size} rows of {size} numbers")
    values = np.array(rows, dtype=float).reshape(size, size)
    proper = np.isfinite(values).all() and np.allclose(values, values.T, atol=1e-6)
    if not (
        proper and np.allclose(np.diag(values), 1.0, atol=1e-6) and np.linalg.eigvalsh(values).min(initial=0) > -1e-6
    ):
        raise table.wrong("matrix", matrix, "a correlation: symmetric, 1 on the diagonal, no negative eigenvalue")
    return Correlation(tuple(names), tuple(tuple(map(float, row)) for row in rows), tuple(logarithm))


def _parameter(table: _Table) -> CardParameter:
    table.only("value", "unit", "stderr", "lo", "hi", "fixed")
    stderr = table.get("stderr", float) if "stderr" in table.data else None
    if stderr is not None and not stderr >= 0.0:
        raise table.wrong("stderr", stderr, "a number that is not negative")
    lo, hi = table.get("lo", float, -math.inf), table.get("hi", float, math.inf)
    value = table.get("value", float)
    if not lo <= value <= hi:
        raise table.wrong("value", value, f"a value in its own bounds [{lo:g}, {hi:g}]")
    return CardParameter(value, table.get("unit", str), stderr, lo, hi, table.get("fixed", bool, False))


def _provenance(table: _Table) -> Provenance:
    table.only("records", "package_version", "seed", "date", "method")
    records = []
    for index, entry in enumerate(table.get("records", list, [])):
        record = _Table(entry, table.source, f"provenance.records[{index}]")
        record.only("name", "sha256", "role")
        role = record.get("role", str, "measured")
        if role not in ("measured", "holdout"):
            raise record.wrong("role", role, "'measured' or 'holdout'")
        sha256 = record.get("sha256", str)
        if sha256 and (len(sha256) != 64 or set(sha256) - set("0123456789abcdef")):
            raise record.wrong("sha256", sha256, "64 hexadecimal digits")
        records.append(RecordUsed(record.get("name", str), sha256, role))
    return Provenance(
        tuple(records),
        table.get("package_version", str, ""),
        table.get("seed", int, 0),
        table.get("date", str, ""),
        table.get("method", str, ""),
    )


def _check_declared(name: str, parameter: CardParameter, declared: Mapping[str, Variable]) -> None:
    if name not in declared:
        raise InputError(f"parameters.{name} -- expected one of {', '.join(declared)} -- {_REMEDY}")
    unit = declared[name].quantity.unit
    if simplified(parameter.unit) != unit:
        raise InputError(
            f"parameters.{name}.unit = {parameter.unit!r} -- expected {unit!r}, cards are in SI -- {_REMEDY}"
        )


def _plain(card: ModelCard) -> dict[str, Any]:
    made, errors = card.provenance, card.correlation
    return {
        "format": card.version,
        "model": card.model,
        "preset": card.preset,
        "effects": list(card.effects),
        "parameters": {
            name: {key: value for key, value in vars(parameter).items() if value is not None}
            for name, parameter in card.parameters.items()
        },
        "per_run": {run: dict(values) for run, values in card.per_run.items()},
        **({} if errors is None else {"correlation": {key: list(value) for key, value in vars(errors).items()}}),
        "provenance": {
            "package_version": made.package_version,
            "seed": made.seed,
            "date": made.date,
            "method": made.method,
            "records": [vars(record) for record in made.records],
        },
    }
