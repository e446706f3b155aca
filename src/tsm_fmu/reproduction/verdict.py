"""The rules that turn what is printed and what is computed into a verdict.

Two rules, no verdict is written beside a claim:

* numbers (`judge_number`): reported interval against computed interval, with the accuracy of the reported one;
* statements (`judge_readings`): one computed condition for every reading that the print allows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal


class Verdict(StrEnum):
    """Outcome of a comparison, from best to worst."""

    REPRODUCED = "reproduced"
    CONSISTENT = "consistent"
    NOT_DETERMINED = "not determined by the paper"
    CONTRADICTS = "contradicts the paper's own equations"


@dataclass(frozen=True)
class Span:
    """Values from ``lo`` to ``hi``; over what the paper leaves open where it is computed. One value: lo = hi."""

    lo: float
    hi: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.lo) and math.isfinite(self.hi) and self.lo <= self.hi):
            raise ValueError(f"span {self.lo} to {self.hi} -- expected finite numbers in order")

    @classmethod
    def of(cls, *values: float) -> Span:
        """The smallest span that holds the values."""
        if not all(map(math.isfinite, values)):
            raise ValueError(f"span of {values} -- expected finite numbers")
        return cls(float(min(values)), float(max(values)))

    @property
    def width(self) -> float:
        return self.hi - self.lo

    @property
    def ends(self) -> tuple[float, float]:
        return self.lo, self.hi

    def distance(self, other: Span) -> float:
        """Gap to another span, 0 where they meet."""
        return max(0.0, self.lo - other.hi, other.lo - self.hi)

    def __str__(self) -> str:
        return number(self.lo) if self.lo == self.hi else f"{number(self.lo)} to {number(self.hi)}"


@dataclass(frozen=True)
class Reported:
    """A number or range as printed.

    Attributes
    ----------
    value : Span
        In ``unit``.
    where : str
        Figure, table, equation or section.
    accuracy : float
        How far a computed value may be off and still be what was printed.
    because : str
        Why this accuracy.
    """

    value: Span
    unit: str
    where: str
    accuracy: float
    because: str


@dataclass(frozen=True)
class Condition:
    """What a reading must fulfil for a statement to hold: ``value`` in relation to ``limit``."""

    value: float
    relation: Literal["<=", ">="]
    limit: float

    def __post_init__(self) -> None:
        if math.isnan(self.value) or math.isnan(self.limit):
            raise ValueError(f"condition {self.value} {self.relation} {self.limit} -- expected numbers")

    @property
    def holds(self) -> bool:
        return self.value <= self.limit if self.relation == "<=" else self.value >= self.limit

    def __str__(self) -> str:
        return f"{number(self.value)} ({'holds' if self.holds else 'violates'} {self.relation} {number(self.limit)})"


def judge_number(reported: Reported | None, ours: Span | None, missing: str = "") -> Verdict:
    """Verdict on a number.

    Not determined: nothing printed, something ``missing`` that the comparison needs, or what the paper leaves open
    spans at least the reported value itself, so that nearly any number would have agreed. Contradicts: the intervals
    are further apart than the accuracy. Reproduced: one number on both sides. Consistent: an interval on either side.
    """
    if reported is None or ours is None or missing:
        return Verdict.NOT_DETERMINED
    if reported.value.distance(ours) > reported.accuracy:
        return Verdict.CONTRADICTS
    if max(ours.width, reported.value.width) <= reported.accuracy:
        return Verdict.REPRODUCED
    return Verdict.CONSISTENT if ours.width < _magnitude(reported.value) else Verdict.NOT_DETERMINED


def judge_readings(readings: Mapping[str, Condition]) -> Verdict:
    """Verdict on a statement: it holds in all readings (reproduced), in none (contradicts), or in some."""
    held = [condition.holds for condition in readings.values()]
    if all(held):
        return Verdict.REPRODUCED
    return Verdict.NOT_DETERMINED if any(held) else Verdict.CONTRADICTS


def number(value: float) -> str:
    """Four significant digits; rounding errors are 0."""
    return f"{value:.4g}" if abs(value) >= 1e-12 else "0"


def _magnitude(span: Span) -> float:
    return max(abs(span.lo), abs(span.hi))
