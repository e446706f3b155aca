"""Answers against the truth: points, rates with Wilson intervals, confusion, risk over coverage, closure.

Points of a case, with n hidden effects of the vocabulary:

* each right name 1/n, each wrong name -2;
* no name but sets that hold a hidden effect: 0.5/size of the smallest, /n;
* a name where nothing is missing (B, F, and C without an effect) or where nothing shows (G): -3, unless it is right;
* anything else 0.

Some names say the same of these rigs and count as each other: see `SAME`. A name that the truth calls tolerated (the
step of a coarse encoder that every log of the rig shows) counts neither way.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

SAME = {"smooth_backlash": "backlash"}
"""Names taken for another: gaps of different width in parallel are a rounded play."""


@dataclass(frozen=True)
class Scored:
    """One case after scoring.

    Attributes
    ----------
    name, stratum, verdict : str
        Verdict as given; "failed" if the run failed.
    truth, named : tuple of str
        Ids.
    points : float
    right, wrong : int
        Names given.
    in_set : bool
        A hidden effect is in an equivalent set.
    confidence : float
        Score of the best candidate less that of the next.
    listed : bool
        All hidden effects are in the ``not_excited`` list.
    closure : float or None
        On held-out runs as the diagnosis says, of the channel that shows most of what is hidden.
    wrong_closure : float or None
        On held-out runs, of the best candidate that is not hidden.
    wall_s : float
    """

    name: str
    stratum: str
    verdict: str
    truth: tuple[str, ...]
    named: tuple[str, ...]
    points: float
    right: int
    wrong: int
    in_set: bool = False
    confidence: float = 0.0
    listed: bool = False
    closure: float | None = None
    wrong_closure: float | None = None
    wall_s: float = 0.0


def scored(name: str, truth: Mapping[str, Any], answer: Mapping[str, Any]) -> Scored:
    """Score one case.

    Parameters
    ----------
    name : str
    truth : mapping
        Entry of ``answers.json``.
    answer : mapping
        Content of ``diagnosis.json``, or ``{"failed": code}``.
    """
    hidden = tuple(truth["effects"])
    if "failed" in answer:
        return Scored(name, truth["stratum"], "failed", hidden, (), 0.0, 0, 0, wall_s=answer.get("wall_s", 0.0))
    effects: list[str] = answer["effects"]
    given = dict.fromkeys(SAME.get(e, e) for e in effects)
    named = tuple(e for e in given if e in hidden or e not in truth["tolerated"])
    right = sum(e in hidden for e in named)
    wrong = len(named) - right
    sets = [{SAME.get(e, e) for e in group} for group in answer["equivalent"]]
    holding = [len(group) for group in sets if group & set(hidden)]
    nothing = (not hidden and not truth["hidden"]) or truth["stratum"] == "G"
    if named:
        points = right / len(hidden) if hidden else 0.0
        points += -3.0 if nothing and wrong else -2.0 * wrong
    else:
        points = 0.5 / min(holding) / len(hidden) if holding else 0.0
    candidates = sorted(answer["candidates"], key=lambda c: -_number(c["score"]))
    scores = [_number(c["score"]) for c in candidates]
    losers = [c["gap_closure_holdout"] for c in candidates if SAME.get(c["effect"], c["effect"]) not in hidden]
    shown = max(truth["response"], key=lambda c: truth["response"][c] / truth["noise"][c])
    return Scored(
        name, truth["stratum"], answer["verdict"], hidden, named, points, right, wrong, bool(holding),
        scores[0] - scores[1] if len(scores) > 1 else (scores[0] if scores else 0.0),
        bool(hidden) and set(hidden) <= {SAME.get(e, e) for e in answer["not_excited"]},
        answer["gap"].get(shown, {}).get("closure"),
        max((c for c in losers if c is not None), default=None),
        answer.get("wall_s", 0.0),
    )  # fmt: skip


def _number(value: float | None) -> float:
    return -math.inf if value is None else float(value)


def wilson(hits: int, trials: int, z: float = 1.96) -> tuple[float, float]:
    """Interval of a rate, 95 % by default; (0, 1) without trials."""
    if trials == 0:
        return 0.0, 1.0
    p, n = hits / trials, trials
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    scale = 1 + z * z / n
    return max(0.0, (middle - half) / scale), min(1.0, (middle + half) / scale)


@dataclass(frozen=True)
class Rate:
    """A share of cases against its target.

    Attributes
    ----------
    what : str
    hits, trials : int
    target : float
    at_most : bool
        The target is an upper limit.
    """

    what: str
    hits: int
    trials: int
    target: float
    at_most: bool = False
    interval: tuple[float, float] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "interval", wilson(self.hits, self.trials))

    @property
    def value(self) -> float:
        return self.hits / self.trials if self.trials else math.nan

    @property
    def met(self) -> bool | None:
        """None without trials."""
        if not self.trials:
            return None
        return self.value <= self.target if self.at_most else self.value >= self.target


def rates(results: Iterable[Scored]) -> list[Rate]:
    """The rates that have targets, and those that explain them."""
    results = list(results)
    one = [r for r in results if r.truth and r.stratum in "ACD"]
    names = [(r.right, r.wrong) for r in one]
    clean = [r for r in results if not r.truth and r.stratum in "CF"]

    def of(stratum: str) -> list[Scored]:
        return [r for r in results if r.stratum == stratum]

    def count(rows: list[Scored], *verdicts: str) -> int:
        return sum(r.verdict in verdicts for r in rows)

    closures = [r.closure for r in one if r.right and not r.wrong and r.closure is not None]
    return [
        Rate("names given that are right (A, C, D)", sum(n for n, _ in names), sum(n + m for n, m in names), 0.95),
        Rate("coverage: a name given (A, C, D)", sum(bool(r.named) for r in one), len(one), 0.7),
        Rate(
            "false alarms, nothing missing (F)", sum(bool(r.named) for r in of("F")), len(of("F")), 0.05, at_most=True
        ),
        Rate("false alarms, also bad instruments (F, C)", sum(bool(r.named) for r in clean), len(clean), 0.05, True),
        Rate("outside the vocabulary: unknown (E)", count(of("E"), "unknown"), len(of("E")), 0.8),
        Rate("wrong parameters: said so (B)", count(of("B"), "parameters"), len(of("B")), 0.8),
        Rate("not excited: listed (G)", sum(r.listed for r in of("G")), len(of("G")), 0.95),
        Rate("right name closes 0.9 of the gap", sum(c >= 0.9 for c in closures), len(closures), 0.8),
        Rate("runs without failure", sum(r.verdict != "failed" for r in results), len(results), 1.0),
    ]


def confusion(results: Iterable[Scored]) -> Counter[tuple[str, str]]:
    """How often each truth (or the stratum, if none) met each name (or the verdict, if none)."""
    pairs: Counter[tuple[str, str]] = Counter()
    for r in results:
        missed = [e for e in r.truth if e not in r.named]
        surplus = [e for e in r.named if e not in r.truth]
        pairs.update((e, e) for e in r.truth if e in r.named)
        rows = missed or ([] if r.truth else [f"({r.stratum})"])
        pairs.update((row, column) for row in rows for column in (surplus or [f"[{r.verdict}]"]))
        if r.truth and not missed:
            pairs.update(("(surplus)", column) for column in surplus)
    return pairs


def risk_coverage(results: Iterable[Scored]) -> list[tuple[float, float]]:
    """Coverage and share of wrong answers as the margin asked for falls, over the cases where something shows (not G).

    The most certain answers come first; a case counts as wrong if any of its names is.
    """
    results = [r for r in results if (r.truth and r.stratum != "G") or r.stratum == "E"]
    return curve_of([(r.confidence, r.wrong > 0) for r in results if r.named], len(results))


def curve_of(answers: Iterable[tuple[float, bool]], cases: int) -> list[tuple[float, float]]:
    """Coverage and share of wrong ones of answers (how sure, whether wrong), out of all cases."""
    wrong, curve = 0, []
    for k, (_, failed) in enumerate(sorted(answers, key=lambda answer: -answer[0]), 1):
        wrong += failed
        curve.append((k / cases, wrong / k))
    return curve
