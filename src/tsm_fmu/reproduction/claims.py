"""Claims of the papers as rows of one table.

A reason is the computed comparison in words; the explanation that follows it is given for one verdict and is left
out if the run comes to another.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .verdict import Condition, Reported, Span, Verdict, judge_number, judge_readings, number

__all__ = ["Claim", "Condition", "Reported", "Span", "Verdict", "number_claim", "open_claim", "statement_claim"]


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
    reported, ours : str
        As shown.
    rule : str
        When which verdict is given, with the tolerance and its reason.
    numbers : mapping
        The compared numbers, for machines.
    """

    key: str
    items: tuple[str, ...]
    quantity: str
    unit: str
    reported: str
    ours: str
    verdict: Verdict
    reason: str
    rule: str
    numbers: Mapping[str, Any] = field(default_factory=dict)

    @property
    def paper(self) -> str:
        return self.key.partition(".")[0]


Why = Mapping[Verdict, str]


def number_claim(
    key: str,
    items: str | tuple[str, ...],
    quantity: str,
    reported: Reported | None,
    ours: Span | float,
    why: Why,
) -> Claim:
    """Claim that a printed number is what the equations give."""
    return _number_claim(key, items, quantity, reported, ours, "", why, "")


def open_claim(
    key: str,
    items: str | tuple[str, ...],
    quantity: str,
    ours: Span | float | None,
    missing: str,
    *,
    unit: str = "",
    reported: Reported | None = None,
) -> Claim:
    """What the equations give where the paper does not publish what a comparison needs: ``missing`` says what.

    ``ours`` is None where nothing can be computed without it.
    """
    return _number_claim(key, items, quantity, reported, ours, missing, {}, unit)


def _number_claim(
    key: str,
    items: str | tuple[str, ...],
    quantity: str,
    reported: Reported | None,
    ours: Span | float | None,
    missing: str,
    why: Why,
    unit: str,
) -> Claim:
    span = ours if isinstance(ours, Span) or ours is None else Span.of(ours)
    verdict = judge_number(reported, span, missing)
    numbers: dict[str, Any] = {"reported": None, "ours": None if span is None else [span.lo, span.hi]}
    rule = "the comparison needs what is not published: not determined"
    if reported is not None:
        unit = reported.unit
        numbers |= {"reported": [reported.value.lo, reported.value.hi], "where": reported.where}
    if reported is not None and not missing:
        numbers |= {"accuracy": reported.accuracy}
        rule = (
            f"within {_with_unit(number(reported.accuracy), unit)} ({reported.because}): reproduced for one value, "
            "consistent for a range narrower than the value, else not determined; outside: contradicts"
        )
    return Claim(
        key,
        _items(items),
        quantity,
        unit,
        _as_printed(reported.value) if reported else "no number",
        "not computable" if span is None else str(span),
        verdict,
        missing or _reason(_compared(reported, span, verdict), why, verdict),
        rule,
        numbers,
    )


def statement_claim(
    key: str,
    items: str | tuple[str, ...],
    quantity: str,
    unit: str,
    states: str,
    readings: Mapping[str, Condition],
    why: Why,
) -> Claim:
    """Claim that something holds: ``states`` is the paper's statement, ``readings`` what each reading gives."""
    verdict = judge_readings(readings)
    comparison = ", ".join(f"{name}: {c}" for name, c in readings.items())
    ours = ", ".join(number(c.value) if len(readings) == 1 else f"{n}: {number(c.value)}" for n, c in readings.items())
    rule = "holds in all readings: reproduced; in some: not determined; in none: contradicts"
    numbers = {n: {"value": c.value, "relation": c.relation, "limit": c.limit} for n, c in readings.items()}
    return Claim(
        key,
        _items(items),
        quantity,
        unit,
        states,
        ours,
        verdict,
        _reason(comparison, why, verdict),
        rule,
        {"readings": numbers},
    )


def _as_printed(span: Span) -> str:
    """Five digits: nearly all that the papers print."""
    return f"{span.lo:.5g}" if span.lo == span.hi else f"{span.lo:.5g} to {span.hi:.5g}"


def _with_unit(text: str, unit: str) -> str:
    return text if unit in ("", "1") else f"{text} {unit}"


def _items(items: str | tuple[str, ...]) -> tuple[str, ...]:
    return (items,) if isinstance(items, str) else items


def _compared(reported: Reported | None, ours: Span | None, verdict: Verdict) -> str:
    if reported is None or ours is None:
        return "no number is printed"
    gap, accuracy = number(reported.value.distance(ours)), _with_unit(number(reported.accuracy), reported.unit)
    if verdict is Verdict.CONTRADICTS:
        return f"{ours} misses {reported.value} by {gap}, more than {accuracy}"
    if verdict is Verdict.REPRODUCED:
        return f"{ours} is within {accuracy} of {reported.value}"
    if verdict is Verdict.CONSISTENT:
        return f"{ours} meets {reported.value}"
    return f"{ours} is as wide as the reported value itself"


def _reason(comparison: str, why: Why, verdict: Verdict) -> str:
    return f"{comparison}; {why[verdict]}" if verdict in why else comparison
