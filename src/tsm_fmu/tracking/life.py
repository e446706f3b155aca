"""The runs of a drive in time order and what each value does over them, in numbers and in plain words."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..effects import about, id_of, words
from ..kernels.arrays import FloatArray
from ..kernels.kernel import Kernel
from ..logs.display import display
from ..models.contract import InputError, Variable
from .follow import TrackedRun
from .series import LEAST_RUNS, Drift, drifts

UNEXPLAINED = "error of "
"""Begins the name of the series that holds what the tracked parameters leave unexplained in a channel."""


@dataclass(frozen=True)
class Series:
    """One value over the runs.

    Attributes
    ----------
    name : str
        Public name of a parameter, or ``error of CHANNEL``.
    meaning : str
    unit : str
        SI.
    kind : {'parameter', 'offset', 'error'}
        Shared in the card and refitted in each run; each run's own; RMS error with the tracked parameters free.
    runs : tuple of str
        Those that have a value that counts.
    values, stderr : tuple of float
        At these, SI.
    drift : Drift or None
        None where fewer than five runs have a value that counts.
    text : str
        What it does, in a sentence.
    """

    name: str
    meaning: str
    unit: str
    kind: str
    runs: tuple[str, ...]
    values: tuple[float, ...]
    stderr: tuple[float, ...]
    drift: Drift | None
    text: str

    @property
    def moves(self) -> bool:
        """Whether a trend or a jump is shown."""
        return self.drift is not None and self.drift.form != "steady"


def check_count(count: int) -> None:
    """Refuse too few runs.

    Raises
    ------
    InputError
        Fewer than five.
    """
    if count < LEAST_RUNS:
        raise InputError(
            f"{count} run{'s' if count != 1 else ''} to track -- expected {LEAST_RUNS} or more in time order -- "
            "fewer tell no trend from chance"
        )


def series_of(
    kernel: Kernel, effects: Sequence[str], tracked: Sequence[str], runs: Sequence[TrackedRun], units: Mapping[str, str]
) -> tuple[Series, ...]:
    """What each tracked parameter, each run's offset, and the error of each channel do over the runs.

    Parameters
    ----------
    kernel : Kernel
    effects : sequence of str
        Of the card.
    tracked : sequence of str
        Public names of the parameters that are shared in the card.
    runs : sequence of TrackedRun
        In time order.
    units : mapping of str to str
        Of the fitted channels.
    """
    declared = kernel.by_name
    rows: list[tuple[str, str, str, str, list[tuple[str, float, float]]]] = []
    for name in runs[0].values:
        kind = "parameter" if name in tracked else "offset"
        counted = [(r.name, v.value, v.stderr) for r in runs if (v := r.values[name]).used]
        meaning = _meaning(declared[name], kernel, effects)
        rows.append((name, meaning, declared[name].quantity.unit, kind, counted))
    for channel, unit in units.items():
        errors = [(r.name, r.rmse[channel], 0.0) for r in runs]
        rows.append((UNEXPLAINED + channel, "RMS error that the refit leaves", unit, "error", errors))
    enough = [row for row in rows if len(row[-1]) >= LEAST_RUNS]
    found = iter(drifts([_column(row[-1], 1) for row in enough], [_column(row[-1], 2) for row in enough]))
    series = []
    for row in rows:
        name, meaning, unit, kind, counted = row
        names, values, stderr = zip(*counted, strict=True) if counted else ((), (), ())
        drift = next(found) if len(counted) >= LEAST_RUNS else None
        text = _text(name, meaning, unit, kind, names, drift, len(runs))
        series.append(Series(name, meaning, unit, kind, names, values, stderr, drift, text))
    return tuple(series)


def _column(counted: Sequence[tuple[str, float, float]], k: int) -> FloatArray:
    return np.array([row[k] for row in counted], dtype=float)


def _meaning(variable: Variable, kernel: Kernel, effects: Sequence[str]) -> str:
    """What a parameter is: of an effect, or of a law of the model that is one, that effect's words too."""
    own = re.sub(r", Eqs? .*|\s*\(ours\)", "", variable.quantity.meaning)
    for spec in effects:
        effect, _, channel = spec.partition("@")
        if variable.name.startswith((f"{effect}.", f"{channel}.{effect}.")):
            return f"{own}; {words(spec)}"
    for effect, parameters in kernel.roles.has.items():
        if variable.name in parameters:
            return f"{own}; {about(id_of(effect)).words}"
    return own


def _text(name: str, meaning: str, unit: str, kind: str, names: Sequence[str], drift: Drift | None, total: int) -> str:
    if drift is None:
        return f"{name}: only {len(names)} of {total} runs have a value that no bound holds; {LEAST_RUNS} tell a trend"
    show = display(unit, max(map(abs, drift.fitted)))
    count = f"{len(names)} runs"
    if drift.form == "steady":
        slope, jump = _shown(drift.unseen_slope, unit), _shown(drift.unseen_jump, unit)
        return (
            f"{name}: no drift shown over the {count}; a drift of less than {slope} per run, or a jump in the middle "
            f"of less than {jump}, would not be seen"
        )
    total_change = drift.end - drift.begin
    parts = []
    if drift.form in ("trend", "trend and jump"):
        low, high = sorted(drift.slope_interval)
        whole = drift.slope * (len(names) - 1) if drift.form == "trend and jump" else total_change
        each = f"{show(drift.slope, 2)} per run, 95 % interval {show(low, 2)} to {show(high, 2)}"
        parts.append(f"{_change(whole, drift.begin, kind, unit, ('grows', 'falls'))} over the {count} ({each})")
    for jump in drift.jumps:
        before, after = (names[k] for k in jump.between)
        low, high = sorted(jump.interval)
        parts.append(
            f"{_change(jump.size, drift.fitted[jump.between[0]], kind, unit, ('jumps up', 'jumps down'))} between "
            f"{before} and {after} (95 % interval {show(low, 2)} to {show(high, 2)})"
        )
    up = (drift.slope if drift.form == "trend" else sum(jump.size for jump in drift.jumps)) * drift.begin > 0.0
    cause = _cause(kind, meaning, drift.form, up)
    what = " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))
    return f"{name} ({meaning}) {what}{': ' if cause else ''}{cause}"


def _shown(value: float, unit: str) -> str:
    return display(unit, value)(value, 2)


def _change(change: float, begin: float, kind: str, unit: str, words: tuple[str, str]) -> str:
    """A change in words: of a parameter as a part of its value before, of its size where it is negative."""
    if kind == "offset" or abs(begin) < abs(change) * 1e-2:
        return f"{words[change < 0.0]} by {_shown(abs(change), unit)}"
    return f"{words[change * begin < 0.0]} by {100.0 * abs(change / begin):.2g} %"


_KINDS = (
    ("friction", r"friction|Coulomb|static level|Stribeck|damping"),
    ("stiffness", r"stiff|elastic|compliance"),
    ("play", r"backlash|slack|play|ratio of output|slope change at a reversal|travel that forgets"),
    ("load path", r"torque per|gain"),
)
"""What a parameter is about, by words of its meaning and of its effect; the first that fits."""

_CAUSES = {
    ("offset", "trend"): "the zero creeps, as of a tendon that stretches or a sensor that drifts",
    ("offset", "jump"): "the zero moved, as after re-engagement, re-tensioning or a slip",
    ("error", "trend"): "something that the tracked parameters cannot take up changes; 'diagnose' a late run",
    ("error", "jump"): "something that the tracked parameters cannot take up has changed; 'diagnose' a run after it",
    ("friction", "trend up"): "as of wear, dirt or lost lubricant",
    ("friction", "trend down"): "as of running-in, or a tendon that loses its tension",
    ("friction", "jump"): "as after re-tensioning, new lubricant or an exchanged part",
    ("stiffness", "trend"): "as of a tendon that frays, stretches or settles",
    ("stiffness", "jump"): "as after re-tensioning, a broken strand or an exchanged tendon",
    ("play", "trend"): "lost motion changes, as of wear or a tendon that stretches",
    ("play", "jump"): "lost motion changed at once, as after re-tensioning or an exchanged part",
    ("load path", "trend"): "the transmission changes, as of wear of the sheath or a sensor whose gain drifts",
    ("load path", "jump"): "the transmission changed at once, as after re-tensioning or a new calibration",
}


def _cause(kind: str, meaning: str, form: str, up: bool) -> str:
    """What such a change is usual for; a log of this kind cannot prove a cause."""
    about_it = kind
    if kind == "parameter":
        about_it = next((word for word, pattern in _KINDS if re.search(pattern, meaning)), "")
    how = "trend" if form == "trend" else "jump"
    return _CAUSES.get((about_it, how)) or _CAUSES.get((about_it, f"{how} {'up' if up else 'down'}"), "")
