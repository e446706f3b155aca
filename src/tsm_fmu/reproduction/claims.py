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
from typing import Any

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


def number_claim(
    key: str,
    items: Items,
    quantity: str,
    print_: Printed,
    ours: Span | float,
    *,
    kind: Kind = Kind.MEASUREMENT,
    assumed: tuple[Open, ...] = (),
    why: Why | None = None,
    method: Method = Method.MODEL,
) -> Claim:
    """A printed number, beside what the equations give over all that is open."""
    span = ours if isinstance(ours, Span) else Span.of(ours)
    verdict = judge_numbers(kind, [print_.span], [span], len(assumed))
    gap = print_.span.distance(span)
    compared = (
        f"{span} misses {print_.text} by {number(gap)}{_unit(print_.unit)}"
        if gap > 0.0
        else f"{span} {'is' if print_.span.holds(span) else 'reaches'} what is printed as {print_.text}"
    )
    numbers = {"printed": list(print_.span.ends), "ours": list(span.ends), "where": print_.where}
    return Claim(
        key,
        _items(items),
        quantity,
        print_.unit,
        print_.text,
        str(span),
        verdict,
        _reason(compared, why, verdict),
        kind,
        method,
        assumed,
        _caller(),
        numbers,
    )


def together_claim(
    key: str,
    items: Items,
    quantity: str,
    prints: Mapping[str, Printed],
    best: Mapping[str, float],
    *,
    kind: Kind = Kind.MEASUREMENT,
    assumed: tuple[Open, ...] = (),
    why: Why | None = None,
    method: Method = Method.MODEL,
) -> Claim:
    """Several printed numbers at once, beside what the best admissible set of values gives for all of them."""
    names = list(prints)
    verdict = judge_together(kind, [prints[n].span for n in names], [best[n] for n in names], len(assumed))
    units = {p.unit for p in prints.values()}
    missed = [n for n in names if not prints[n].span.holds(Span.of(best[n]))]
    compared = f"{len(names) - len(missed)} of {len(names)} numbers are met at once" + (
        "; missed: " + ", ".join(f"{_words(n)} ({number(best[n])} for {prints[n].text})" for n in missed)
        if missed
        else ""
    )
    numbers = {
        "printed": {n: list(prints[n].span.ends) for n in names},
        "ours": {n: best[n] for n in names},
        "free": len(assumed),
    }
    return Claim(
        key,
        _items(items),
        quantity,
        units.pop() if len(units) == 1 else "",
        "; ".join(f"{_words(n)} {prints[n].text}" for n in names),
        "; ".join(f"{_words(n)} {number(best[n])}" for n in names),
        verdict,
        _reason(compared, why, verdict),
        kind,
        method,
        assumed,
        _caller(),
        numbers,
    )


def open_claim(
    key: str,
    items: Items,
    quantity: str,
    missing: str,
    *,
    ours: Span | float | None = None,
    unit: str = "",
    prints: Sequence[Printed] = (),
    assumed: tuple[Open, ...] = (),
    method: Method = Method.PRINT,
) -> Claim:
    """A fact that cannot be compared because the paper does not publish what that needs: ``missing`` says what.

    ``ours`` is what the equations give where that can be said at all; it is no counterpart of a measured number.
    """
    span = ours if isinstance(ours, Span) or ours is None else Span.of(ours)
    return Claim(
        key,
        _items(items),
        quantity,
        prints[0].unit if prints else unit,
        "; ".join(p.text for p in prints) or NOTHING,
        NOTHING if span is None else str(span),
        Verdict.NOT_DETERMINED,
        missing,
        Kind.MEASUREMENT,
        method,
        assumed,
        _caller(),
        {"printed": [list(p.span.ends) for p in prints] or None, "ours": list(span.ends) if span else None},
    )


def statement_claim(
    key: str,
    items: Items,
    quantity: str,
    unit: str,
    states: str,
    readings: Mapping[str, Condition],
    *,
    kind: Kind = Kind.PRINT,
    assumed: tuple[Open, ...] = (),
    why: Why | None = None,
    method: Method = Method.MODEL,
) -> Claim:
    """Claim that something holds: ``states`` is the paper's sentence, ``readings`` what each reading of it gives.

    A reading that is ours stands in a row of its own (``kind`` reading).
    """
    verdict = judge_readings(kind, readings)
    compared = ", ".join(f"{name}: {c}" for name, c in readings.items())
    ours = ", ".join(number(c.value) if len(readings) == 1 else f"{n}: {number(c.value)}" for n, c in readings.items())
    numbers = {n: {"value": c.value, "relation": c.relation, "limit": c.limit} for n, c in readings.items()}
    return Claim(
        key,
        _items(items),
        quantity,
        unit,
        states,
        ours,
        verdict,
        _reason(compared, why, verdict),
        kind,
        method,
        assumed,
        _caller(),
        {"readings": numbers},
    )


def _words(name: str) -> str:
    """``non_periodic.width`` as text."""
    return re.sub(r"(?<=[a-z])\.(?=[a-z])", " ", name).replace("_", "-")


def _items(items: Items) -> tuple[str, ...]:
    return (items,) if isinstance(items, str) else items


def _unit(unit: str) -> str:
    return "" if unit in ("", "1") else f" {unit}"


def _reason(compared: str, why: Why | None, verdict: Verdict) -> str:
    return f"{compared}; {why[verdict]}" if why and verdict in why else compared


def _caller() -> str:
    """``module:function`` that makes a claim, for the link from its row."""
    frame = sys._getframe(2)  # the constructor's caller
    return f"{frame.f_globals['__name__']}:{frame.f_code.co_qualname.partition('.<locals>')[0]}"
