"""The results as text."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from statistics import median

from .score import Rate, Scored, confusion, rates, risk_coverage, wilson

MEANING = {
    "A": "effects in other forms", "B": "wrong parameters", "C": "bad instruments", "D": "two effects",
    "E": "outside the vocabulary", "F": "nothing missing", "G": "not excited",
}  # fmt: skip


def lines(results: Sequence[Scored]) -> Iterator[str]:
    """All tables."""
    yield from _strata(results)
    yield ""
    yield from rate_lines(rates(results))
    yield ""
    yield from _confusion(results)
    yield ""
    yield from _curve(results)
    yield ""
    yield from _closures(results)


def row(r: Scored) -> str:
    """One case."""
    truth = "+".join(r.truth) or "-"
    given = "+".join(r.named) or f"[{r.verdict}]"
    close = "" if r.closure is None else f"closure {r.closure:.2f}"
    return f"{r.name} {r.stratum}  {truth:<38} {given:<38} {r.points:>+5.2f} {r.wall_s:>6.1f} s  {close}"


def _strata(results: Sequence[Scored]) -> Iterator[str]:
    head = ("cases", 5), ("right", 6), ("wrong", 6), ("in set", 6), ("no name", 7), ("points", 7)
    yield f"{'stratum':<28} " + " ".join(f"{word:>{width}}" for word, width in head) + "  names right, 95 %"
    for letter, meaning in MEANING.items():
        rows = [r for r in results if r.stratum == letter]
        if rows:
            yield _stratum_line(f"{letter} {meaning}", rows)
    yield _stratum_line("all", results)


def _stratum_line(what: str, rows: Sequence[Scored]) -> str:
    right, wrong = sum(r.right for r in rows), sum(r.wrong for r in rows)
    low, high = wilson(right, right + wrong)
    share = f"{100 * low:.0f}-{100 * high:.0f} %" if right + wrong else "-"
    silent = sum(not r.named for r in rows)
    points, held = sum(r.points for r in rows), sum(r.in_set and not r.named for r in rows)
    return f"{what:<28} {len(rows):>5} {right:>6} {wrong:>6} {held:>6} {silent:>7} {points:>+7.2f}  {share}"


def rate_lines(found: Sequence[Rate]) -> Iterator[str]:
    """Rates with their intervals and targets, one a line."""
    yield f"{'rate':<44} {'hits':>9} {'value':>7} {'95 %':>11} {'target':>8}"
    for r in found:
        value = "-" if math.isnan(r.value) else f"{100 * r.value:.0f} %"
        low, high = (100 * b for b in r.interval)
        verdict = {True: "met", False: "MISSED", None: "no cases"}[r.met]
        target = f"{'<=' if r.at_most else '>='} {100 * r.target:.0f} %"
        yield f"{r.what:<44} {r.hits:>4}/{r.trials:<4} {value:>7} {low:>4.0f}-{high:.0f} % {target:>9}  {verdict}"


def _confusion(results: Sequence[Scored]) -> Iterator[str]:
    yield "confusion: truth -> answer (names; [verdict] without a name), most frequent first"
    found = confusion(results)
    for truth in dict.fromkeys(t for t, _ in sorted(found)):
        answers = [(n, a) for (t, a), n in found.items() if t == truth]
        yield f"  {truth:<24} " + ", ".join(f"{a} {n}" for n, a in sorted(answers, key=lambda p: (-p[0], p[1])))


def _curve(results: Sequence[Scored]) -> Iterator[str]:
    yield "risk over coverage: share of wrong answers among the most certain ones"
    curve = risk_coverage(results)
    if not curve:
        yield "  no names given"
    shown = sorted({round(k * (len(curve) - 1) / 9) for k in range(10)}) if curve else []
    for coverage, risk in (curve[k] for k in shown):
        yield f"  coverage {100 * coverage:>4.0f} %   risk {100 * risk:>4.0f} %  {'#' * round(40 * risk)}"


def _closures(results: Sequence[Scored]) -> Iterator[str]:
    rightly = [r for r in results if r.right and not r.wrong]
    yield "closure of the removable gap on held-out runs"
    for what, values in (
        ("right name", [r.closure for r in rightly]),
        ("best wrong candidate of the same cases", [r.wrong_closure for r in rightly]),
        ("best wrong candidate, all cases", [r.wrong_closure for r in results]),
    ):
        known = sorted(v for v in values if v is not None)
        if known:
            low, high = known[len(known) // 10], known[-1 - len(known) // 10]
            yield f"  {what:<40} median {median(known):.2f}, 10-90 %: {low:.2f} to {high:.2f}  ({len(known)} cases)"
        else:
            yield f"  {what:<40} no cases"
