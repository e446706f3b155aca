"""Functions of the coordinates that a formula may be made of, in physical units and as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from ...logs.display import display
from ...regression.problem import FloatArray
from ..runs.motion_signals import Coordinates

LEGEND = (
    "x, v, a: position, speed and acceleration of the motion; sgn(v): its direction; "
    "d: travel since the last reversal; t: time since the start of the run; L: load; "
    "hold: length of the last stand-still; lag(y, T): y through a first-order lag of time constant T"
)
DISTANCES = (0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32)
"""Decay lengths after a reversal, as parts of the stroke."""
SPEEDS = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Decay speeds, as parts of the RMS speed."""
WIDTHS = (0.12, 0.06)
"""Widths of something that sits at one place of the stroke, as parts of it."""
LAGS = (0.003, 0.01, 0.03, 0.1)
"""Time constants, as parts of the longest run."""

HOLD = 0.01
"""Stand-still, as a part of the longest run, that is more than the slow end of a stroke."""
ALIKE = 0.98
"""A function that is as good as proportional to a simpler one is left out."""


@dataclass(frozen=True)
class Term:
    """One function.

    Attributes
    ----------
    text : str
        As a user reads it, ``sgn(v) exp(-d/3.2 mm)``.
    unit : str
        SI unit of its values.
    values : list of ndarray, shape (n,)
        One array a run.
    """

    text: str
    unit: str
    values: list[FloatArray]


def terms_of(places: Sequence[Coordinates], motion_unit: str, load_unit: str) -> list[Term]:
    """All functions that these runs can tell from nothing, simple ones first.

    Parameters
    ----------
    places : sequence of Coordinates
    motion_unit, load_unit : str
        SI units of x and of the load.
    """
    u, speed_unit = motion_unit, f"{motion_unit}/s"
    span = max(float(np.ptp(c.x)) for c in places) or 1.0
    middle = float(np.mean(np.concatenate([c.x for c in places])))
    middle = middle if abs(middle) > 0.02 * span else 0.0
    speed = float(np.sqrt(np.mean(np.concatenate([c.v for c in places]) ** 2))) or 1.0
    length = max(float(np.ptp(c.time)) for c in places)
    x = [c.x - middle for c in places]
    x_text = "x" if not middle else f"(x {'-' if middle > 0 else '+'} {display(u, abs(middle))(abs(middle))})"
    s, v, a = [c.s for c in places], [c.v for c in places], [c.a for c in places]
    t = [c.time - c.time[0] for c in places]
    found: list[Term] = []

    def put(text: str, unit: str, *factors: list[FloatArray]) -> None:
        found.append(Term(text, unit, [np.prod(np.vstack(parts), axis=0) for parts in zip(*factors, strict=True)]))

    one = [np.ones(c.x.size) for c in places]
    put("", "1", one)
    put(x_text, u, x)
    put(f"{x_text}^2", f"{u}2", x, x)
    put(f"{x_text}^3", f"{u}3", x, x, x)
    put("v", speed_unit, v)
    put("|v|", speed_unit, s, v)
    put("v |v|", f"({speed_unit})2", v, [np.abs(y) for y in v])
    put("a", f"{u}/s2", a)
    put("sgn(v)", "1", s)
    put(f"sgn(v) {x_text}", u, s, x)
    put(f"{x_text} v", f"{u}2/s", x, v)
    put("sgn(v) |a|", f"{u}/s2", s, [np.abs(y) for y in a])
    put("sgn(v) sgn(a)", "1", s, [np.sign(y) for y in a])
    put("t", "s", t)
    put("sgn(v) t", "s", s, t)
    for part in DISTANCES:
        put(
            f"sgn(v) exp(-d/{display(u)(part * span, 2)})",
            "1",
            s,
            [np.exp(-c.since_reversal / part / span) for c in places],
        )
    for part in SPEEDS:
        put(
            f"sgn(v) exp(-|v|/{display(speed_unit)(part * speed, 2)})",
            "1",
            s,
            [np.exp(-np.abs(y) / part / speed) for y in v],
        )
    put(f"sgn(v) exp(-t/{0.2 * length:.2g} s)", "1", s, [np.exp(-y / (0.2 * length)) for y in t])
    low = min(float(c.x.min()) for c in places)
    for wide in (part * span for part in WIDTHS):
        for centre in np.arange(low + 0.5 * wide, low + span, wide):
            near = [np.exp(-(((c.x - centre) / wide) ** 2)) for c in places]
            shape = f"exp(-((x - {display(u)(centre, 2)})/{display(u)(wide, 2)})^2)".replace("- -", "+ ")
            put(shape, "1", near)
            put(f"sgn(v) {shape}", "1", s, near)
    if u == "rad" and float(np.ptp(np.concatenate(x))) > 2.0:
        for k in (1, 2, 3):
            put(f"cos({'' if k == 1 else k}x)", "1", [np.cos(k * c.x) for c in places])
            put(f"sin({'' if k == 1 else k}x)", "1", [np.sin(k * c.x) for c in places])
    for part in LAGS:
        put(
            f"({x_text} - lag({x_text}, {part * length:.2g} s))",
            u,
            [_behind(y, c, part * length) for y, c in zip(x, places, strict=True)],
        )
        put(
            f"(sgn(v) - lag(sgn(v), {part * length:.2g} s))",
            "1",
            [_behind(y, c, part * length) for y, c in zip(s, places, strict=True)],
        )
    if any(np.ptp(c.dwell) > HOLD * length for c in places):
        put(
            f"sgn(v) exp(-d/{display(u)(0.05 * span, 2)}) ln(1 + hold/1 s)", "1", s,
            [np.exp(-c.since_reversal / (0.05 * span)) * np.log1p(c.dwell) for c in places],
        )  # fmt: skip
    loads = [c.load for c in places if c.load is not None]
    if len(loads) == len(places):
        put("L", load_unit, loads)
        put("sgn(v) |L|", load_unit, s, [np.abs(y) for y in loads])
        put("sgn(v) L", load_unit, s, loads)
        put("L^2", f"({load_unit})2", loads, loads)
        put(f"{x_text} L", f"{u}.{load_unit}", x, loads)
        put("v L", f"{load_unit}.{speed_unit}", v, loads)
    return _different(found)


def _different(terms: Sequence[Term]) -> list[Term]:
    kept: list[Term] = []
    units: list[FloatArray] = []
    for term in terms:
        values = np.concatenate(term.values)
        norm = float(np.linalg.norm(values))
        if not np.isfinite(norm) or norm == 0.0:
            continue
        if all(abs(float(values @ other)) < ALIKE * norm for other in units):
            kept.append(term)
            units.append(values / norm)
    return kept


def _behind(values: FloatArray, c: Coordinates, time_constant: float) -> FloatArray:
    keep = np.exp(-float(np.median(np.diff(c.time))) / time_constant)
    slow, _ = lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])
    return values - np.asarray(slow)
