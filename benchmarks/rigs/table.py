"""Outcomes as text: rates with Wilson intervals, families, risk over coverage, calibration of the margin."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from statistics import median

from ..blind.score import Rate, curve_of, wilson
from ..blind.table import rate_lines
from .outcome import Outcome, as_scored

BINS = (0.0, 0.1, 0.3, 1.0, 3.0, math.inf)
"""Edges of the margins of the calibration curve [dB]."""


def rates(rows: Sequence[Outcome]) -> list[Rate]:
    """The rates that issue and documents set targets for."""

    def of(kind: str) -> list[Outcome]:
        return [r for r in rows if r.kind == kind]

    effect, nothing, outside, unseen = (of(kind) for kind in ("effect", "nothing", "outside", "unseen"))
    families = [r.family_right for r in effect if r.family_right is not None]
    closures = [r.closure for r in effect if r.closure is not None]
    given, right = sum(r.right + r.wrong for r in effect), sum(r.right for r in effect)
    every, good = sum(r.right + r.wrong for r in rows), sum(r.right for r in rows)
    return [
        Rate("names right, an effect is hidden", right, given, 0.95),
        Rate("names right, all cases", good, every, 0.95),
        Rate("coverage: a name, or a set that holds it", sum(r.covered for r in effect), len(effect), 0.7),
        Rate("false alarms, nothing missing", sum(bool(r.wrong) for r in nothing), len(nothing), 0.03, at_most=True),
        Rate("names where nothing can show", sum(bool(r.wrong) for r in unseen), len(unseen), 0.03, at_most=True),
        Rate("unknown, outside the vocabulary", sum(r.verdict == "unknown" for r in outside), len(outside), 0.9),
        Rate("unknown, or what the author accepts there", sum(r.accepted for r in outside), len(outside), 0.9),
        Rate("family right where no right name is given", sum(families), len(families), 0.9),
        Rate("right names close 0.9 of what can be removed", sum(c >= 0.9 for c in closures), len(closures), 0.5),
        Rate("answered", sum(r.verdict != "failed" for r in rows), len(rows), 1.0),
    ]


def gate_failures(rows: Sequence[Outcome], target: float = 0.05, chance: float = 0.01) -> list[str]:
    """What is worse than chance makes it of a tool that meets its targets: wrong names and false alarms, nothing else.

    Parameters
    ----------
    rows : sequence of Outcome
    target : float
        Share of cases with a wrong name that is allowed.
    chance : float
        Probability below which so many are no chance.
    """
    bad = [r for r in rows if r.wrong]
    p = sum(
        math.comb(len(rows), k) * target**k * (1.0 - target) ** (len(rows) - k) for k in range(len(bad), len(rows) + 1)
    )
    return [f"{r.name}: {'+'.join(r.named)} for {'+'.join(r.truth) or 'nothing'}" for r in bad] if p < chance else []


def row(r: Outcome) -> str:
    """One case."""
    said = "+".join(r.named) or f"[{r.verdict}]"
    mark = "WRONG" if r.wrong else "right" if r.accepted else ""
    return f"{r.name} {r.stratum} {r.model:<18} {'+'.join(r.truth) or '-':<36} {said:<36} {mark:<5} {r.seconds:>6.1f} s"


def lines(rows: Sequence[Outcome]) -> Iterator[str]:
    """All tables of an author's cases."""
    yield from rate_lines(rates(rows))
    closures = [r.closure for r in rows if r.closure is not None]
    if closures:
        yield f"closure of what can be removed on held-out runs, right names: median {median(closures):.2f}"
    if rows:
        seconds = [r.seconds for r in rows]
        yield f"CPU of a case: median {median(seconds):.1f} s, most {max(seconds):.1f} s"
    yield from scorer_lines(rows)
    yield ""
    yield "risk over coverage: share of wrong answers among the most certain ones"
    curve = risk_coverage(rows)
    shown = sorted({round(k * (len(curve) - 1) / 7) for k in range(8)}) if curve else []
    yield from (f"  coverage {100 * c:>4.0f} %   risk {100 * r:>4.0f} %" for c, r in (curve[k] for k in shown))
    if not curve:
        yield "  no names given"
    yield ""
    yield "calibration: share of right names by the margin to the next candidate"
    for low, high, right, given in calibration(rows):
        least, most = (100 * b for b in wilson(right, given))
        share = f"{100 * right / given:>4.0f} %  ({least:.0f}-{most:.0f} %)" if given else "   -"
        yield f"  {low:>4.1f} to {high:>4.1f} dB  {right:>3}/{given:<3} {share}"


def scorer_lines(rows: Sequence[Outcome]) -> Iterator[str]:
    """The other author's scorer beside our judgement of the same answers; nothing without a scorer."""
    known = [r for r in rows if r.scored]
    if not known:
        return
    theirs, mine = Counter(r.scored for r in known), Counter(as_scored(r) for r in known)
    yield "the other author's scorer calls them: " + ", ".join(f"{k} {n}" for k, n in theirs.most_common())
    yield "from our judgement they should be:    " + ", ".join(f"{k} {n}" for k, n in mine.most_common())
    yield from (f"  {r.name}: {r.scored}, not {as_scored(r)}" for r in known if r.scored != as_scored(r))


def risk_coverage(rows: Sequence[Outcome]) -> list[tuple[float, float]]:
    """Coverage and share of wrong answers as the margin asked for falls, over the cases in which something shows."""
    shown = [r for r in rows if r.kind in ("effect", "outside")]
    return curve_of([(r.margin, r.wrong > 0) for r in shown if r.named], len(shown))


def calibration(rows: Sequence[Outcome]) -> list[tuple[float, float, int, int]]:
    """Bins of the margin: edges, answers whose names are all right, answers with names."""
    given = [r for r in rows if r.named]
    found = []
    for low, high in pairwise(BINS):
        inside = [r for r in given if low <= r.margin < high]
        found.append((low, high, sum(not r.wrong for r in inside), len(inside)))
    return found
