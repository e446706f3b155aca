"""Claims of the papers as rows of one table: one row a fact.

A reason is the computed comparison in words; the explanation that follows it is given for one verdict and is left
out if the run comes to another.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, TypedDict, Unpack

from .printed import Printed
from .verdict import (
    Condition,
    Kind,
    Span,
    Verdict,
    judge_numbers,
    judge_readings,
    judge_together,
    number,
)

NOTHING = "-"
"""Shown where the paper prints no number."""


class Method(StrEnum):
    """How ours was computed."""

    CO_SIMULATION = "FMUs in co-simulation"
    MODEL = "model equations"
    PRINT = "the print alone"


@dataclass(frozen=True)
class Open:
    """Something that the comparison needs and the paper does not print.

    Attributes
    ----------
    what, values, source : str
        Its name, the admissible range that was computed, and where that range is from.
    """

    what: str
    values: str
    source: str

    def __str__(self) -> str:
        return f"{self.what} {self.values} ({self.source})"


@dataclass(frozen=True)
class Claim:
    """One row of the table.

    Attributes
    ----------
    key : str
        ``paper.name``; stable.
    items : tuple of str
        Labels of the paper's items that it covers, the first is where it is shown.
    quantity, unit : str
        What is compared.
    printed, ours : str
        As shown; ``printed`` is the paper's own text.
    kind, method : Kind, Method
        What is compared with what, and how ours was computed.
    assumed : tuple of Open
        What the paper leaves open.
    code : str
        ``module:function`` that computed it.
    numbers : mapping
        The compared numbers, for machines.
    """

    key: str
    items: tuple[str, ...]
    quantity: str
    unit: str
    printed: str
    ours: str
    verdict: Verdict
    reason: str
    kind: Kind
    method: Method
    assumed: tuple[Open, ...] = ()
    code: str = ""
    numbers: Mapping[str, Any] = field(default_factory=dict)

    @property
    def paper(self) -> str:
        return self.key.partition(".")[0]


Why = Mapping[Verdict, str]
Items = str | tuple[str, ...]


class About(TypedDict, total=False):
    """What may be said of any row.

    Attributes
    ----------
    kind, method : Kind, Method
        What is compared with what, and how ours was computed.
    assumed : tuple of Open
        What the paper leaves open.
    why : mapping of Verdict to str
        Explanation by verdict, left out if the run comes to another.
    """

    kind: Kind
    method: Method
    assumed: tuple[Open, ...]
    why: Why


def number_claim(
    key: str, items: Items, quantity: str, print_: Printed, ours: Span | float, **about: Unpack[About]
) -> Claim:
    """A printed number, beside what the equations give over all that is open."""
    span = _span(ours)
    verdict = judge_numbers(about.get("kind", Kind.MEASUREMENT), [print_.span], [span], len(about.get("assumed", ())))
    gap = print_.span.distance(span)
    compared = (
        f"{span} misses {print_.text} by {number(gap)}{_unit(print_.unit)}"
        if gap > 0.0
        else f"{span} {'is' if print_.span.holds(span) else 'reaches'} what is printed as {print_.text}"
    )
    numbers = {"printed": list(print_.span.ends), "ours": list(span.ends), "where": print_.where}
    return _row(key, items, quantity, print_.unit, (print_.text, str(span)), (verdict, compared), numbers, about)


def together_claim(
    key: str,
    items: Items,
    quantity: str,
    prints: Mapping[str, Printed],
    best: Mapping[str, float],
    **about: Unpack[About],
) -> Claim:
    """Several printed numbers at once, beside what the best admissible set of values gives for all of them."""
    names, free = list(prints), len(about.get("assumed", ()))
    spans, kind = [prints[n].span for n in names], about.get("kind", Kind.MEASUREMENT)
    verdict = judge_together(kind, spans, [best[n] for n in names], free)
    units = {p.unit for p in prints.values()}
    missed = [n for n in names if not prints[n].span.holds(Span.of(best[n]))]
    compared = f"{len(names) - len(missed)} of {len(names)} numbers are met at once" + (
        "; missed: " + ", ".join(f"{_words(n)} ({number(best[n])} for {prints[n].text})" for n in missed)
        if missed
        else ""
    )
    sides = (
        "; ".join(f"{_words(n)} {prints[n].text}" for n in names),
        "; ".join(f"{_words(n)} {number(best[n])}" for n in names),
    )
    numbers = {
        "printed": {n: list(prints[n].span.ends) for n in names},
        "ours": {n: best[n] for n in names},
        "free": free,
    }
    unit = units.pop() if len(units) == 1 else ""
    return _row(key, items, quantity, unit, sides, (verdict, compared), numbers, about)


def open_claim(
    key: str,
    items: Items,
    quantity: str,
    missing: str,
    *,
    ours: Span | float | None = None,
    unit: str = "",
    prints: Sequence[Printed] = (),
    **about: Unpack[About],
) -> Claim:
    """A fact that cannot be compared because the paper does not publish what that needs: ``missing`` says what.

    ``ours`` is what the equations give where that can be said at all; it is no counterpart of a measured number.
    """
    span = None if ours is None else _span(ours)
    sides = ("; ".join(p.text for p in prints) or NOTHING, NOTHING if span is None else str(span))
    numbers = {"printed": [list(p.span.ends) for p in prints] or None, "ours": list(span.ends) if span else None}
    unit, about = prints[0].unit if prints else unit, About(method=Method.PRINT) | about
    return _row(key, items, quantity, unit, sides, (Verdict.NOT_DETERMINED, missing), numbers, about)


def statement_claim(
    key: str,
    items: Items,
    quantity: str,
    unit: str,
    states: str,
    readings: Mapping[str, Condition],
    **about: Unpack[About],
) -> Claim:
    """Claim that something holds: ``states`` is the paper's sentence, ``readings`` what each reading of it gives.

    A reading that is ours stands in a row of its own (``kind`` reading); without a kind it is print against print.
    """
    kind = about.get("kind", Kind.PRINT)
    verdict = judge_readings(kind, readings, len(about.get("assumed", ())))
    compared = ", ".join(f"{name}: {c}" for name, c in readings.items())
    ours = "; ".join(number(c.value) if len(readings) == 1 else f"{n}: {number(c.value)}" for n, c in readings.items())
    numbers = {n: {"value": c.value, "relation": c.relation, "limit": c.limit} for n, c in readings.items()}
    return _row(
        key, items, quantity, unit, (states, ours), (verdict, compared), {"readings": numbers}, About(kind=kind) | about
    )


def _row(
    key: str,
    items: Items,
    quantity: str,
    unit: str,
    sides: tuple[str, str],
    judged: tuple[Verdict, str],
    numbers: Mapping[str, Any],
    about: About,
) -> Claim:
    """The claim of a constructor: both ``sides`` as shown, and what they were ``judged`` in words."""
    verdict, compared = judged
    why = about.get("why", {}).get(verdict)
    return Claim(
        key,
        (items,) if isinstance(items, str) else items,
        quantity,
        unit,
        *sides,
        verdict,
        f"{compared}; {why}" if why else compared,
        about.get("kind", Kind.MEASUREMENT),
        about.get("method", Method.MODEL),
        about.get("assumed", ()),
        _caller(),
        numbers,
    )


def _words(name: str) -> str:
    """``non_periodic.width`` as text."""
    return re.sub(r"(?<=[a-z])\.(?=[a-z])", " ", name).replace("_", "-")


def _span(ours: Span | float) -> Span:
    return ours if isinstance(ours, Span) else Span.of(ours)


def _unit(unit: str) -> str:
    return "" if unit in ("", "1") else f" {unit}"


def _caller() -> str:
    """``module:function`` that makes a claim, for the link from its row."""
    frame = sys._getframe(3)  # the caller of the constructor that called `_row`
    return f"{frame.f_globals['__name__']}:{frame.f_code.co_qualname.partition('.<locals>')[0]}"
