"""Columns of a log beyond the model's variables that may drive an effect: a tension, a load, an angle, a temperature.

Their units say what they may be (`kernels/drives.py`). A column that measures what is compared is no cause of it, and
one that follows the model's own load, or another column, says nothing new.
"""

from __future__ import annotations

import keyword
from collections.abc import Mapping, Sequence

import numpy as np

from ...kernels.arrays import FloatArray
from ...kernels.chain import chain
from ...kernels.drives import IMPLIED, ROLE_OF_UNIT, ROLES, Drive
from ...kernels.kernel import Kernel
from ...logs.record import Record
from ...models.contract import InputError
from ..criteria import COPY_SHARE, EFFECT_OF_CHANNEL_SHARE, POSITION_SHARE

NONE = "none"
"""What a user calls a column that is to drive nothing."""


def with_drives(
    model: Kernel, records: Sequence[Record], channels: Sequence[str], roles: Mapping[str, str] | None = None
) -> tuple[Kernel, tuple[str, ...]]:
    """The model with an input for each column that may drive an effect.

    Parameters
    ----------
    model : Kernel
    records : sequence of Record
        All runs: what one of them lacks cannot drive anything.
    channels : sequence of str
        Outputs that are compared.
    roles : mapping of str to str, optional
        Role by column, one of `ROLES` or ``none``, instead of what the unit says.

    Returns
    -------
    Kernel
    tuple of str
        What a user should know of it.

    Raises
    ------
    InputError
        A role of a column that there is not, a role that is none, or a sheath's angle in another unit.
    """
    roles = dict(roles or {})
    _check_roles(roles, model, records)
    of_model = {v.name for v in (*model.inputs, *model.outputs, *model.parameters)}
    taken, notes = list[Drive](), list[str]()
    for column in dict.fromkeys(name for record in records for name in record.columns):
        if column in of_model or roles.get(column) == NONE:
            continue
        lacking = [r.name for r in records if column not in r.columns]
        for drive in IMPLIED:
            if column == drive.column and column not in roles:
                for record in (r for r in records if column in r.columns):
                    record.require(column, drive.unit)
        units = {r.units[column] for r in records if column in r.columns}
        role = roles.get(column) or (_role(model, units.pop(), records, column, lacking) if len(units) == 1 else "")
        if not role:
            continue
        drive = Drive(role, column, next(r.units[column] for r in records if column in r.columns))
        why = _refusal(drive, lacking, model, records, channels, taken, by_user=column in roles)
        if why:
            notes.append(f"{column} drives no effect: {why}")
        else:
            taken.append(drive)
    if not taken:
        return model, tuple(notes)
    listed = ", ".join(f"{d.column} [{d.unit}] as {d.role}" for d in taken)
    notes.append(f"columns that may drive an effect: {listed}; --drive COLUMN=ROLE says otherwise")
    return chain(model.name, tuple(getattr(model.module, "EFFECTS", ())), tuple(taken)), tuple(notes)


def drives_of(model: Kernel) -> tuple[Drive, ...]:
    """Columns that a model of `with_drives` listens to."""
    return tuple(Drive(*one) for one in getattr(model.module, "DRIVES", ()))


def _check_roles(roles: Mapping[str, str], model: Kernel, records: Sequence[Record]) -> None:
    known = sorted({name for record in records for name in record.columns})
    for column, role in roles.items():
        if role not in (*ROLES, NONE):
            raise InputError(f"--drive {column}={role} -- expected a role of {', '.join((*ROLES, NONE))} -- choose one")
        if column not in known:
            raise InputError(
                f"--drive {column}={role} -- expected a column of the runs: {', '.join(known)} -- correct it"
            )
        if column in [v.name for v in (*model.inputs, *model.outputs)]:
            raise InputError(
                f"--drive {column}={role} -- expected no variable of {model.name} -- drop it, or rename the "
                "column with --map"
            )


def _role(model: Kernel, unit: str, records: Sequence[Record], column: str, lacking: Sequence[str]) -> str:
    """What a column may be by its unit; a position only of a model that is driven by its speed."""
    role = ROLE_OF_UNIT.get(unit, "")
    if model.motion == "v" and not lacking and unit == _unit_of(model, "v").removesuffix("/s"):
        return "position" if _is_integral(model, records, column) else ("bend" if role == "bend" else "")
    return "" if role == "position" else role


def _refusal(
    drive: Drive, lacking: Sequence[str], model: Kernel, records: Sequence[Record], channels: Sequence[str],
    taken: Sequence[Drive], *, by_user: bool,
) -> str:  # fmt: skip
    """Why a column cannot drive an effect; empty if it can."""
    if lacking:
        return f"it is not in {', '.join(lacking)}"
    name = drive.column
    if not name.isidentifier() or keyword.iskeyword(name) or name.endswith("_") or "__" in name:
        return "its name is no name of a variable, rename it with --map"
    if drive.role in ("bend", "position") and any(d.role == drive.role for d in taken) and not by_user:
        return f"{next(d.column for d in taken if d.role == drive.role)} is taken for it"
    if drive.role == "temperature" and drive.unit != "K":
        return f"it is in {drive.unit}, and a temperature is in K or degC"
    if by_user or drive.role not in ("load", "temperature"):
        return ""
    values = _joined(records, name)
    units = {v.name: v.quantity.unit for v in model.outputs}
    for channel in channels if drive.role == "load" else ():
        if ROLE_OF_UNIT.get(units[channel]) != "load":
            continue
        if _common_variance(values, _joined(records, channel)) > EFFECT_OF_CHANNEL_SHARE:
            return f"it follows {channel}, which is compared: another measurement of it, no cause"
    known = [model.roles.load] if drive.role == "load" and model.roles.load in records[0].columns else []
    for other in (*known, *(d.column for d in taken if d.role == drive.role)):
        if all(other in r.columns for r in records) and _common_variance(values, _joined(records, other)) > COPY_SHARE:
            return f"it follows {other}"
    return ""


def _joined(records: Sequence[Record], column: str) -> FloatArray:
    """The column in all runs, one after the other."""
    return np.concatenate([r.columns[column] for r in records])


def _common_variance(one: FloatArray, other: FloatArray) -> float:
    """Share of the variance of one that is a multiple of the other."""
    a, b = one - one.mean(), other - other.mean()
    size = float(a @ a) * float(b @ b)
    return float(a @ b) ** 2 / size if size > 0.0 else 0.0


def _is_integral(model: Kernel, records: Sequence[Record], column: str) -> bool:
    """Whether a column is the position of the speed that drives the model."""
    moves = [np.diff(r.columns[column]) for r in records]
    if all("v" not in r.columns for r in records):
        return column == "x"  # the speed is derived from it
    if any("v" not in r.columns for r in records):
        return False
    ways = [
        np.diff(np.cumsum(r.columns["v"] * np.gradient(r.time))) for r in records
    ]  # steps of both over the same samples
    step = max(1, min(m.size for m in moves) // 200)
    coarse = [(np.add.reduceat(m, np.arange(0, m.size, step)), np.add.reduceat(w, np.arange(0, w.size, step)))
              for m, w in zip(moves, ways, strict=True)]  # fmt: skip
    return (
        _common_variance(np.concatenate([m for m, _ in coarse]), np.concatenate([w for _, w in coarse]))
        > POSITION_SHARE
    )


def position_column(model: Kernel, records: Sequence[Record]) -> str | None:
    """Column of all records that is the position of the speed which drives the model; None without."""
    unit = _unit_of(model, "v").removesuffix("/s")
    for name in records[0].columns:
        everywhere = all(name in r.columns and r.units[name] == unit for r in records)
        if everywhere and _is_integral(model, records, name):
            return name
    return None


def _unit_of(model: Kernel, name: str) -> str:
    return next(v.quantity.unit for v in model.inputs if v.name == name)
