"""The rules that turn what is printed and what is computed into a verdict; none is written beside a claim.

What is compared is one of three (`Kind`), and that alone decides what a disagreement is called:

* **print**: both sides follow from the paper alone, its equations and numbers. They disagree: *internal error*.
* **measurement**: a measured number against the equations, over all that the paper does not print but that they need.
  No admissible value gives it: *not explained by its equations*.
* **reading**: one reading, ours, of a print that can be read in several ways. It fails: *reading excluded*.

Where they agree, the verdict counts. With nothing left open, the number is *reproduced*. If every admissible value of
what is open gives it, it is *consistent*. If some do and others do not, that is no test: *not determined*; unless more
printed numbers are met at once than there are open values, which is one: *consistent*.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal


class Verdict(StrEnum):
    """Outcome of a comparison."""

    REPRODUCED = "reproduced"
    CONSISTENT = "consistent"
    NOT_DETERMINED = "not determined"
    READING_EXCLUDED = "reading excluded"
    NOT_EXPLAINED = "not explained by its equations"
    INTERNAL_ERROR = "internal error"


class Kind(StrEnum):
    """What is compared with what; see the module."""

    PRINT = "print against print"
    MEASUREMENT = "measured against equations"
    READING = "reading of an ambiguous print"


FAILED = {
    Kind.PRINT: Verdict.INTERNAL_ERROR,
    Kind.MEASUREMENT: Verdict.NOT_EXPLAINED,
    Kind.READING: Verdict.READING_EXCLUDED,
}


@dataclass(frozen=True)
class Span:
    """Values from ``lo`` to ``hi``; one value: lo = hi."""

    lo: float
    hi: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.lo) and math.isfinite(self.hi) and self.lo <= self.hi):
            raise ValueError(f"span {self.lo} to {self.hi} -- expected finite numbers in order")

    @classmethod
    def of(cls, *values: float) -> Span:
        """The smallest span that holds the values."""
        if not values or not all(map(math.isfinite, values)):
            raise ValueError(f"span of {values} -- expected finite numbers")
        return cls(float(min(values)), float(max(values)))

    @property
    def width(self) -> float:
        return self.hi - self.lo

    @property
    def middle(self) -> float:
        return 0.5 * (self.lo + self.hi)

    @property
    def ends(self) -> tuple[float, float]:
        return self.lo, self.hi

    def meets(self, other: Span) -> bool:
        """Whether a value lies in both."""
        return self.lo <= other.hi and other.lo <= self.hi

    def holds(self, other: Span) -> bool:
        """Whether all of the other lies in this one."""
        return self.lo <= other.lo and other.hi <= self.hi

    def distance(self, other: Span) -> float:
        """Gap to another span, 0 where they meet."""
        return max(0.0, self.lo - other.hi, other.lo - self.hi)

    def __str__(self) -> str:
        return number(self.lo) if self.lo == self.hi else f"{number(self.lo)} to {number(self.hi)}"


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


def judge_numbers(kind: Kind, printed: Sequence[Span], ours: Sequence[Span], free: int) -> Verdict:
    """Verdict on printed numbers, each beside the span of values that the equations give it.

    Parameters
    ----------
    kind : Kind
        What a disagreement is called.
    printed, ours : sequence of Span
        One pair a number.
    free : int
        How many values the paper leaves open; the spans are over their admissible ranges.
    """
    if any(not a.meets(b) for a, b in zip(printed, ours, strict=True)):
        return FAILED[kind]
    if free == 0:
        return Verdict.REPRODUCED
    if all(a.holds(b) for a, b in zip(printed, ours, strict=True)):
        return Verdict.CONSISTENT
    return Verdict.NOT_DETERMINED


def judge_together(kind: Kind, printed: Sequence[Span], best: Sequence[float], free: int) -> Verdict:
    """Verdict on printed numbers met at once by one set of values: ``best`` is what the best admissible set gives."""
    if any(not a.holds(Span.of(b)) for a, b in zip(printed, best, strict=True)):
        return FAILED[kind]
    if free == 0:
        return Verdict.REPRODUCED
    return Verdict.CONSISTENT if len(printed) > free else Verdict.NOT_DETERMINED


def judge_readings(kind: Kind, readings: Mapping[str, Condition], free: int) -> Verdict:
    """Verdict on a statement: it holds in all readings that the print allows, in none, or in some."""
    held = [condition.holds for condition in readings.values()]
    if all(held):
        return Verdict.REPRODUCED if free == 0 and kind is not Kind.READING else Verdict.CONSISTENT
    return Verdict.NOT_DETERMINED if any(held) else FAILED[kind]


def number(value: float) -> str:
    """Four significant digits; rounding errors are 0."""
    return f"{value:.4g}" if abs(value) >= 1e-12 else "0"
