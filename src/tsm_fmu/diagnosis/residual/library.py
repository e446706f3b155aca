"""The functions of the motion that a missing law may be made of: what a residual is predicted with, and formulas of.

They are in physical units and have a text each. Lengths, speeds and times in them are parts of what the runs show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ...kernels.arrays import FloatArray
from ...logs.display import display
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
CENTRED = 0.02
"""A stroke whose middle is nearer to zero than this part of it is taken as centred."""
HOLD = 0.01
"""Stand-still, as a part of the longest run, that is more than the slow end of a stroke."""
TURNING_RAD = 2.0
"""Range of an angle from which on its sine and cosine are no polynomials."""
ALIKE = 0.98
"""A function that correlates more with a simpler one is left out."""
BLOCKS = 4
"""Contiguous folds of a run where there are fewer than three."""
MOST_FOLDS = 6


@dataclass(frozen=True)
class Term:
    """One function of the motion.

    Attributes
    ----------
    text : str
        As a user reads it, ``sgn(v) exp(-d/3.2 mm)``; empty for a constant.
    unit : str
        SI unit of its values.
    values : list of ndarray, shape (n,)
        One array a run.
    local : bool
        Whether it sits at one place of the stroke.
    """

    text: str
    unit: str
    values: list[FloatArray]
    local: bool = False


def library(places: Sequence[Coordinates], motion_unit: str, load_unit: str) -> list[Term]:
    """All functions that these runs can tell from nothing and from each other, simple ones first.

    Parameters
    ----------
    places : sequence of Coordinates
        One a run.
    motion_unit, load_unit : str
        SI units of x and of the load.
    """
    runs = _Runs(places, motion_unit, load_unit)
    groups = (_polynomials, _directions, _times, _after_reversals, _over_speed, _local, _turning, _lags, _rests, _loads)
    return _different([term for group in groups for term in group(runs)])


def folds(sizes: Sequence[int]) -> NDArray[np.int_]:
    """Fold 0, 1, ... of each sample of the runs: whole runs where there are three or more, else blocks of each run.

    Parameters
    ----------
    sizes : sequence of int
        Samples of each run.
    """
    if len(sizes) >= 3:
        return np.repeat(np.arange(len(sizes)) % MOST_FOLDS, sizes)
    return np.concatenate([np.arange(n) * BLOCKS // n + BLOCKS * k for k, n in enumerate(sizes)])


class _Runs:
    """Coordinates of all runs, and the sizes that the functions are scaled by."""

    def __init__(self, places: Sequence[Coordinates], motion_unit: str, load_unit: str) -> None:
        self.places, self.unit, self.load_unit = places, motion_unit, load_unit
        self.speed_unit = f"{motion_unit}/s"
        self.span = max(float(np.ptp(c.x)) for c in places) or 1.0
        self.range = float(np.ptp(np.concatenate([c.x for c in places])))
        self.speed = float(np.sqrt(np.mean(np.concatenate([c.v for c in places]) ** 2))) or 1.0
        self.length = max(float(np.ptp(c.time)) for c in places)
        middle = float(np.mean(np.concatenate([c.x for c in places])))
        self.middle = middle if abs(middle) > CENTRED * self.span else 0.0

    @cached_property
    def x(self) -> list[FloatArray]:
        return [c.x - self.middle for c in self.places]

    @property
    def x_text(self) -> str:
        if not self.middle:
            return "x"
        return f"(x {'-' if self.middle > 0 else '+'} {display(self.unit, abs(self.middle))(abs(self.middle))})"

    @property
    def s(self) -> list[FloatArray]:
        return [c.s for c in self.places]

    @property
    def v(self) -> list[FloatArray]:
        return [c.v for c in self.places]

    @property
    def a(self) -> list[FloatArray]:
        return [c.a for c in self.places]

    @cached_property
    def t(self) -> list[FloatArray]:
        return [c.time - c.time[0] for c in self.places]


def _product(text: str, unit: str, *factors: Sequence[FloatArray], local: bool = False) -> Term:
    values = [np.asarray(np.prod(np.vstack(parts), axis=0)) for parts in zip(*factors, strict=True)]
    return Term(text, unit, values, local)


def _polynomials(r: _Runs) -> list[Term]:
    u, x, v, a = r.unit, r.x, r.v, r.a
    return [
        _product("", "1", [np.ones(y.size) for y in x]),
        _product(r.x_text, u, x),
        _product(f"{r.x_text}^2", f"{u}2", x, x),
        _product(f"{r.x_text}^3", f"{u}3", x, x, x),
        _product("v", r.speed_unit, v),
        _product("|v|", r.speed_unit, r.s, v),
        _product("v |v|", f"({r.speed_unit})2", v, [np.abs(y) for y in v]),
        _product("a", f"{u}/s2", a),
    ]


def _directions(r: _Runs) -> list[Term]:
    u, s, x, a = r.unit, r.s, r.x, r.a
    return [
        _product("sgn(v)", "1", s),
        _product(f"sgn(v) {r.x_text}", u, s, x),
        _product(f"sgn(v) {r.x_text}^2", f"{u}2", s, x, x),
        _product(f"{r.x_text} v", f"{u}2/s", x, r.v),
        _product("sgn(v) sqrt(|v|)", f"({r.speed_unit})0.5", s, [np.sqrt(np.abs(y)) for y in r.v]),
        _product("sgn(v) a", f"{u}/s2", s, a),
        _product("sgn(v) |a|", f"{u}/s2", s, [np.abs(y) for y in a]),
        _product("sgn(a)", "1", [np.sign(y) for y in a]),
        _product("sgn(v) sgn(a)", "1", s, [np.sign(y) for y in a]),
    ]


def _times(r: _Runs) -> list[Term]:
    slow = 0.2 * r.length
    return [
        _product("t", "s", r.t),
        _product("sgn(v) t", "s", r.s, r.t),
        _product(f"{r.x_text} t", f"{r.unit}.s", r.x, r.t),
        _product(f"sgn(v) exp(-t/{slow:.2g} s)", "1", r.s, [np.exp(-y / slow) for y in r.t]),
    ]


def _after_reversals(r: _Runs) -> list[Term]:
    lengths = [part * r.span for part in DISTANCES]
    return [
        _product(f"sgn(v) exp(-d/{display(r.unit)(d, 2)})", "1", r.s, [np.exp(-c.since_reversal / d) for c in r.places])
        for d in lengths
    ]


def _over_speed(r: _Runs) -> list[Term]:
    speeds = [part * r.speed for part in SPEEDS]
    return [
        _product(f"sgn(v) exp(-|v|/{display(r.speed_unit)(w, 2)})", "1", r.s, [np.exp(-np.abs(y) / w) for y in r.v])
        for w in speeds
    ]


def _local(r: _Runs) -> list[Term]:
    """Something that sits at one place of the stroke, in every place."""
    low, found = min(float(c.x.min()) for c in r.places), []
    for wide in (part * r.span for part in WIDTHS):
        for centre in np.arange(low + 0.5 * wide, low + r.span, wide):
            near = [np.exp(-(((c.x - centre) / wide) ** 2)) for c in r.places]
            shape = f"exp(-((x - {display(r.unit)(centre, 2)})/{display(r.unit)(wide, 2)})^2)".replace("- -", "+ ")
            found.append(_product(shape, "1", near, local=True))
            found.append(_product(f"sgn(v) {shape}", "1", r.s, near, local=True))
    return found


def _turning(r: _Runs) -> list[Term]:
    """Harmonics of a drum's angle."""
    if r.unit != "rad" or r.range <= TURNING_RAD:
        return []
    return [
        _product(f"{name}({'' if k == 1 else k}x)", "1", [function(k * c.x) for c in r.places])
        for k in (1, 2, 3) for name, function in (("cos", np.cos), ("sin", np.sin))
    ]  # fmt: skip


def _lags(r: _Runs) -> list[Term]:
    found = []
    for tau in (part * r.length for part in LAGS):
        for text, unit, signal in ((r.x_text, r.unit, r.x), ("sgn(v)", "1", r.s)):
            late = [_lagged(y, c, tau) for y, c in zip(signal, r.places, strict=True)]
            found.append(_product(f"({text} - lag({text}, {tau:.2g} s))", unit, late))
    return found


def _rests(r: _Runs) -> list[Term]:
    if not any(np.ptp(c.dwell) > HOLD * r.length for c in r.places):
        return []
    d = 0.05 * r.span
    text = f"sgn(v) exp(-d/{display(r.unit)(d, 2)}) ln(1 + hold/1 s)"
    return [_product(text, "1", r.s, [np.exp(-c.since_reversal / d) * np.log1p(c.dwell) for c in r.places])]


def _loads(r: _Runs) -> list[Term]:
    loads, unit = [c.load for c in r.places if c.load is not None], r.load_unit
    if len(loads) < len(r.places):
        return []
    size = [np.abs(y) for y in loads]
    return [
        _product("L", unit, loads),
        _product("|L|", unit, size),
        _product("sgn(v) |L|", unit, r.s, size),
        _product("sgn(v) L", unit, r.s, loads),
        _product("L^2", f"({unit})2", loads, loads),
        _product("sgn(v) L^2", f"({unit})2", r.s, loads, loads),
        _product(f"{r.x_text} L", f"{r.unit}.{unit}", r.x, loads),
        _product("v L", f"{unit}.{r.speed_unit}", r.v, loads),
    ]


def _different(terms: Sequence[Term]) -> list[Term]:
    selected: list[Term] = []
    units: list[FloatArray] = []
    for term in terms:
        values = np.concatenate(term.values)
        norm = float(np.linalg.norm(values))
        if not np.isfinite(norm) or norm == 0.0:
            continue
        if all(abs(float(values @ other)) < ALIKE * norm for other in units):
            selected.append(term)
            units.append(values / norm)
    return selected


def _lagged(values: FloatArray, c: Coordinates, time_constant: float) -> FloatArray:
    """What a first-order lag has not followed yet."""
    keep = np.exp(-float(np.median(np.diff(c.time))) / time_constant)
    slow, _ = lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])
    return values - np.asarray(slow)
