"""A proposal of ``log.toml`` for a log that does not say what its columns are: from names, units and correlations."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..models.contract import InputError, Variable
from .header import is_stamp
from .table import Column, read_table
from .units import read_unit, same_quantity

__all__ = ["Guess", "Proposal", "propose_mapping"]

_ANGLES = (
    "angle", "pos", "position", "enc", "encoder", "winkel", "lage", "weg", "displacement", "theta", "phi", "x", "q",
)  # fmt: skip
_SPEEDS = ("speed", "vel", "velocity", "omega", "rpm", "drehzahl", "geschwindigkeit", "vitesse", "v")
_SENSES = {
    "rad": _ANGLES,
    "m": _ANGLES,
    "rad/s": _SPEEDS,
    "m/s": _SPEEDS,
    "N.m": ("torque", "moment", "drehmoment", "couple", "tau", "nm"),
    "N": ("force", "tension", "load", "kraft", "f"),
}  # fmt: skip
"""Words for a quantity, by its SI unit."""
_SIDES = {
    "in": ("in", "input", "motor", "moteur", "drive", "antrieb", "proximal", "prox", "actuator", "m", "motorside"),
    "out": (
        "out", "output", "joint", "distal", "tip", "end", "link", "load", "loadside", "last", "abtrieb", "gelenk",
        "sortie", "tool",
    ),
}  # fmt: skip
_UNITS = ("deg", "rad", "mm", "m", "N", "Nm", "mNm", "Nmm", "rpm", "ms", "us", "s")
_TIMES = ("time", "t", "timestamp", "zeit", "temps", "clock", "sec", "secs", "seconds", "stamp")
_ALIKE = 0.5
"""Least correlation with the drive's position of a column that is taken for the output's."""


@dataclass(frozen=True)
class Guess:
    """What one column seems to be.

    Attributes
    ----------
    column, name : str
        Of the log, and of the model (or ``time``).
    unit : str
        Empty where nothing says it.
    reasons : tuple of str
        What each part rests on.
    certain : bool
        Whether the log itself says name and unit.
    turned : bool
        Whether it falls when the drive's position grows.
    """

    column: str
    name: str
    unit: str
    reasons: tuple[str, ...]
    certain: bool = False
    turned: bool = False


@dataclass(frozen=True)
class Proposal:
    """Guesses, variables of the model without a column, and columns without a variable."""

    log: str
    model: str
    guesses: tuple[Guess, ...]
    missing: tuple[str, ...]
    unused: tuple[str, ...]

    def text(self) -> str:
        """The proposal as the text of a ``log.toml``; what is a guess is said in its line."""
        lines = [f"# Columns of {self.log} as variables of {self.model}: a proposal. Correct what is a guess.", "[map]"]
        for guess in self.guesses:
            origin = "the log says so" if guess.certain else f"a guess: {'; '.join(guess.reasons)}"
            unit = f" [{guess.unit}]" if guess.unit else ""
            line = f"{_toml(guess.column)} = {_toml(guess.name + unit)}  # {origin}"
            # without a unit the line would be refused: it waits for one
            stamps = guess.name == "time" and "time stamps" in guess.reasons
            lines.append(
                line
                if guess.unit or stamps
                else f"# {_toml(guess.column)} = {_toml(guess.name + ' [UNIT]')}  # {origin}; write its unit"
            )
        lines += [f"# no column seems to be {name}" for name in self.missing]
        lines += [f"# {column}: not known, left out" for column in self.unused]
        turned = [guess for guess in self.guesses if guess.turned]
        if turned:
            lines += ["", "[scale]"]
            lines += [f"# {guess.name} = -1  # a guess: it falls when the drive's position grows" for guess in turned]
        return "\n".join(" ".join(line.split("\n")) for line in lines) + "\n"


def propose_mapping(path: Path, model: str, variables: Sequence[Variable]) -> Proposal:
    """What the columns of a log may be for a model.

    Parameters
    ----------
    path : Path
        Any file that `read_record` reads; its units may be missing.
    model : str
        For the text.
    variables : sequence of Variable
        Inputs and outputs of the model.

    Raises
    ------
    InputError
        A file that cannot be read.
    """
    columns = read_table(path).columns
    guesses: list[Guess] = []
    unassigned = list(columns)
    time = max(unassigned, key=_time_score)
    if _time_score(time) > 0:
        guesses.append(_time_guess(time))
        unassigned.remove(time)
    unassigned = [
        column
        for column in unassigned
        if not column.is_text and np.isfinite(column.values).all() and column.values.size > 1
    ]
    scores = [(score, v.name, c.name) for v in variables for c in unassigned if (score := _score(v, c)) >= 2]
    scores.sort(key=lambda found: (-found[0], found[1].endswith("_out"), found[1:]))  # no side said: the drive's
    names = {column.name: column for column in unassigned}
    unmatched = {v.name: v for v in variables}
    for _, variable, column in scores:
        if variable in unmatched and column in names:
            guesses.append(_guess(unmatched.pop(variable), names.pop(column)))
    drive = next((c for g in guesses if g.name == "x_in" for c in columns if c.name == g.column), None)
    if drive is not None:
        guesses += _by_correlation(drive, unmatched, names)
        guesses = [_turned(guess, drive, columns) for guess in guesses]
    found = {guess.name for guess in guesses}
    missing = [name for name in ("time", *(v.name for v in variables)) if name not in found]
    return Proposal(path.name, model, tuple(guesses), tuple(missing), tuple(names))


def _by_correlation(drive: Column, unmatched: dict[str, Variable], names: dict[str, Column]) -> Iterable[Guess]:
    """The output's position, where no name says it: the column that follows the drive best."""
    variable = unmatched.get("x_out")
    fits = [(abs(_correlation(drive, c)), n) for n, c in names.items() if variable and _fits(variable, c) is not False]
    if variable is None or not fits or max(fits)[0] < _ALIKE:
        return []
    r, name = max(fits)
    unmatched.pop("x_out")
    column = names.pop(name)
    unit, reason = _unit_of(variable, column)
    return [Guess(name, "x_out", unit, (f"follows x_in (correlation {r:.2f})", reason))]


def _turned(guess: Guess, drive: Column, columns: Sequence[Column]) -> Guess:
    column = next(c for c in columns if c.name == guess.column)
    turned = guess.name == "x_out" and not column.is_text and _correlation(drive, column) < -_ALIKE
    return Guess(guess.column, guess.name, guess.unit, guess.reasons, guess.certain, turned)


def _correlation(a: Column, b: Column) -> float:
    with np.errstate(all="ignore"):
        r = float(np.corrcoef(a.values, b.values)[0, 1])
    return r if np.isfinite(r) else 0.0


def _words(name: str) -> list[str]:
    found = [word.casefold() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[^\W\d_]+", name)]
    return [part for word in found for part in _parts(word)]


def _parts(word: str) -> tuple[str, ...]:
    """Side and sense of a word made of two, ``motorwinkel``, ``antriebslage``; any other as it is."""
    senses = {sense for names in _SENSES.values() for sense in names if len(sense) > 2}
    for side in (s for names in _SIDES.values() for s in names if len(s) > 2 and word.startswith(s)):
        rest = word[len(side) :]
        for sense in (rest, rest.removeprefix("s")):
            if sense in senses:
                return side, sense
    return (word,)


def _fits(variable: Variable, column: Column) -> bool | None:
    """Whether the column's unit measures what the variable does; None without a unit."""
    unit = column.unit or _suffix(column.name)
    if not unit:
        return None
    try:
        return same_quantity(read_unit(unit).si, variable.quantity.unit)
    except InputError:
        return None


def _score(variable: Variable, column: Column) -> int:
    """How much speaks for a column: 2 from its name's sense, 2 from its side, 1 from its unit; 9 for the same name."""
    if _fits(variable, column) is False:
        return 0
    if column.name == variable.name:
        return 9
    symbol, _, side = variable.name.partition("_")
    words = _words(column.name)
    if side and side not in _SIDES and side.casefold() not in words:  # a part of another, such as x_h of x_out
        return 0
    sides = {name for name, names in _SIDES.items() if any(word in names for word in words)}
    if side in _SIDES and sides and side not in sides:
        return 0
    senses = (*_SENSES.get(variable.quantity.unit, ()), symbol.casefold())
    by_sense = 2 * any(word in senses for word in words)
    by_side = 2 * (side in sides)
    by_unit = int(_fits(variable, column) is True)
    return by_sense + by_side + by_unit if by_sense or (by_side and by_unit) else 0


def _guess(variable: Variable, column: Column) -> Guess:
    unit, reason = _unit_of(variable, column)
    same = column.name == variable.name
    return Guess(
        column.name,
        variable.name,
        unit,
        (f"the name {column.name!r}", reason),
        certain=same and column.unit is not None,
    )


def _unit_of(variable: Variable, column: Column) -> tuple[str, str]:
    if column.unit is not None:
        return column.unit, "the unit of the header"
    if (unit := _suffix(column.name)) and _fits(variable, column):
        return unit, f"the unit from the end of {column.name!r}"
    return "", f"nothing says its unit, of the sort of {variable.quantity.unit}"


def _suffix(name: str) -> str:
    """A unit at the end of a name, ``angle_deg``."""
    last = re.split(r"[_\s/.-]", name)[-1]
    return next((unit for unit in _UNITS if last == unit and last != name), "")


def _time_score(column: Column) -> int:
    if column.is_text:
        first = next((str(cell) for cell in column.values if cell is not None), "")
        return 4 if is_stamp(first) else 0
    grows = column.values.size > 1 and bool((np.diff(column.values) > 0.0).all())
    named = any(word in _TIMES for word in _words(column.name))
    return (
        (1 + 2 * named + (column.name.casefold() == "time")) if grows and (named or column.unit in ("s", "ms")) else 0
    )


def _time_guess(column: Column) -> Guess:
    if column.is_text:
        return Guess(column.name, "time", "", ("time stamps",))
    unit = column.unit or (_suffix(column.name) if _suffix(column.name) in ("s", "ms", "us") else "")
    reason = "the unit of the header" if column.unit else "the unit from its end" if unit else "nothing says its unit"
    sure = column.name.casefold() == "time" and column.unit is not None
    return Guess(column.name, "time", unit, (f"the name {column.name!r}, and it only grows", reason), certain=sure)


def _toml(text: str) -> str:
    import tomli_w

    return tomli_w.dumps({"k": text}).partition(" = ")[2].strip()
