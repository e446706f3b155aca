"""Measured columns that drive effects: a tension, a load, a sheath's angle, a temperature without an input in a model.

An effect says with ``~`` what drives it: ``load_dependence~T_in[N]``, ``bend_angle~Theta_2[rad],F_tip[N]``. The chain
gains an input for each such column. What a column is for follows from its unit and the signals that the effect takes;
where it does not, the role stands before it: ``load_dependence~load=pressure[V]``.
"""

from __future__ import annotations

import keyword
from collections.abc import Sequence
from functools import cache
from types import ModuleType
from typing import NamedTuple

from ..models import MODELS
from ..models.contract import InputError, variables

ROLES = {"load": "load", "bend": "bend", "temperature": "temperature", "position": "x"}
"""What a column may be, in the words of users, with the signal of an effect that it is then."""
MEANINGS = {
    "load": "load or tension", "bend": "total bending angle of the sheath", "temperature": "temperature",
    "position": "position of the drive",
}  # fmt: skip
STARTS = {"temperature": 293.15}
"""Start values of inputs whose zero is no state that a rig is in."""
ROLE_OF_UNIT = {
    "N": "load", "N.m": "load", "Pa": "load", "A": "load", "rad": "bend", "K": "temperature", "m": "position",
}  # fmt: skip
"""What a column is for, by its unit. A current is the load of a motor, as far as its torque follows it."""


class Drive(NamedTuple):
    """A column and what it is for.

    Attributes
    ----------
    role : str
        Of `ROLES`.
    column : str
        Its name, the name of the input.
    unit : str
        SI.
    """

    role: str
    column: str
    unit: str

    @property
    def signal(self) -> str:
        """Field of an effect's inputs."""
        return ROLES[self.role]


ANGLE = Drive("bend", "Theta", "rad")
IMPLIED = (ANGLE, Drive("temperature", "temperature", "K"))
"""What an effect of the sheath's angle, or of a temperature, is driven by where nothing is said."""


def implied_role(unit: str, asked: Sequence[str]) -> str:
    """What a column of a unit is for an effect that takes some signals; empty if the unit does not say."""
    role = ROLE_OF_UNIT.get(unit, "")
    if role == "bend" and "bend" not in asked:
        role = "position"
    return role if role and ROLES[role] in asked else ""


def read_drives(text: str, module: ModuleType) -> tuple[Drive, ...]:
    """Drives of an effect from the part of its spec behind ``~``.

    Raises
    ------
    InputError
        A column without a unit or a role, a role that the effect does not take, or one taken twice.
    """
    asked, found = module.Inputs._fields, {}
    for item in filter(None, text.split(",")):
        role, _, rest = item.rpartition("=")
        column, _, unit = rest.partition("[")
        unit = unit.removesuffix("]") or _known_units().get(column, "")
        if not unit:
            raise InputError(f"column {column!r} that drives {module.NAME} -- expected its unit -- write {column}[N]")
        role = role or implied_role(unit, asked)
        if ROLES.get(role) not in asked:
            takes = " or ".join(r for r, signal in ROLES.items() if signal in asked) or "nothing measured"
            raise InputError(
                f"column {column}[{unit}] drives {module.NAME}{f' as {role}' if role else ''} -- it takes {takes} "
                f"-- say which: {module.NAME}~ROLE={column}[{unit}]"
            )
        if role == "temperature" and unit != "K":
            raise InputError(
                f"column {column}[{unit}] as temperature of {module.NAME} -- expected K, to which degC is "
                f"brought -- give its unit with --map"
            )
        if not column.isidentifier() or keyword.iskeyword(column) or column.endswith("_") or "__" in column:
            raise InputError(f"column {column!r} -- expected a name of letters, digits and _ -- rename it with --map")
        if role in found:
            raise InputError(f"{module.NAME}~{text} -- expected one column as {role} -- drop one")
        found[role] = Drive(role, column, unit)
    for drive in IMPLIED:
        if drive.signal in asked:
            found.setdefault(drive.role, drive)
    return tuple(found[role] for role in ROLES if role in found)


def text_of(drives: Sequence[Drive], module: ModuleType) -> str:
    """The inverse of `read_drives`."""
    asked = module.Inputs._fields
    return ",".join(
        f"{'' if implied_role(d.unit, asked) == d.role else f'{d.role}='}{d.column}[{d.unit}]"
        for d in drives
        if d not in IMPLIED
    )


@cache
def _known_units() -> dict[str, str]:
    """Units of the columns that a model has a name for."""
    found = {d.column: d.unit for d in IMPLIED}
    for module in MODELS:
        for fields in (module.Inputs, module.Outputs):
            found |= {v.name: v.quantity.unit for v in variables(fields)}
    return found
