"""One case after judging, whoever made it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from tsm_fmu.effects import about

from ..blind.score import SAME, scored

Kind = Literal["effect", "nothing", "outside", "unseen"]
"""What is hidden: effects of the library, nothing (or wrong parameters), something else, an effect that cannot show."""


@dataclass(frozen=True)
class Outcome:
    """A case and what was said of it.

    Attributes
    ----------
    author, name, stratum, model : str
    kind : str
    truth, named : tuple of str
        Ids.
    verdict : str
        "failed" if there is no answer.
    right, wrong : int
        Names given.
    covered : bool
        A name is given, or a set that holds what is hidden.
    accepted : bool
        The verdict, with its names, is one that the author accepts.
    family_right : bool or None
        Whether the family said is that of a hidden effect; None where a right name is given, or nothing is hidden.
    closure : float or None
        Of the removable mean square on held-out runs, where the right name is given.
    margin : float
        Score of the best candidate less that of the next other effect [dB]: how sure the answer is.
    seconds : float
        CPU.
    scored : str
        What the other author's own scorer calls the answer; empty for a case of ours.
    """

    author: str
    name: str
    stratum: str
    model: str
    kind: Kind
    truth: tuple[str, ...]
    named: tuple[str, ...]
    verdict: str
    right: int
    wrong: int
    covered: bool
    accepted: bool
    family_right: bool | None
    closure: float | None
    margin: float
    seconds: float
    scored: str = ""


def outcome_of_ours(name: str, model: str, truth: Mapping[str, Any], answer: Mapping[str, Any]) -> Outcome:
    """Judge a case of `benchmarks.blind`.

    Parameters
    ----------
    name, model : str
    truth : mapping
        Its entry of ``answers.json``.
    answer : mapping
        Content of ``diagnosis.json``, or ``{"failed": reason}``; ``seconds`` beside it.
    """
    one = scored(name, truth, answer)
    nothing = {
        "B": ("parameters", "none"),
        "F": ("parameters", "none"),
        "E": ("unknown",),
        "G": ("none", "not_excited"),
    }
    kind: Kind = "effect" if one.truth else "nothing"
    kind = "outside" if one.stratum == "E" else "unseen" if one.stratum == "G" else kind
    accepted = not one.wrong and (
        one.right == len(one.truth) if kind == "effect" else one.verdict in nothing.get(one.stratum, nothing["F"])
    )
    right_name = one.right > 0 and not one.wrong
    return Outcome(
        "ours", name, one.stratum, model, kind, one.truth, one.named, one.verdict, one.right, one.wrong,
        bool(one.named) or one.in_set, accepted, _family_right(kind, one.truth, right_name, answer),
        one.closure if right_name and kind == "effect" else None, margin(answer), float(answer.get("seconds", 0.0)),
    )  # fmt: skip


def outcome_of_theirs(truth: Mapping[str, Any], answer: Mapping[str, Any], scored: str = "") -> Outcome:
    """Judge a case of the other author by the rules of that author's ``score.py``.

    Parameters
    ----------
    truth : mapping
        Its entry of ``truth.json``.
    answer : mapping
        As for `outcome_of_ours`.
    scored : str
        What that scorer itself calls the answer.
    """
    accept = [set(a) for a in truth["accept"]]
    verdicts = {"none", "parameters", "unknown", "not_excited"}
    known: set[str] = set().union(*(a - verdicts for a in accept))
    kinds: dict[str, Kind] = {"B": "nothing", "F": "nothing", "E": "outside", "G": "unseen"}
    kind = kinds.get(truth["stratum"], "effect")
    hidden = tuple(e["id"] for e in truth["effects"])
    verdict = "failed" if "failed" in answer else str(answer["verdict"])
    named = tuple(dict.fromkeys(answer.get("effects", ())))
    right = sum(e in known for e in named)
    in_set = any(known & set(group) for group in answer.get("equivalent", ()))
    whole = set(named) in accept if verdict == "named" else {verdict} in accept
    right_name = right > 0 and right == len(named)
    return Outcome(
        "third", truth["name"], truth["stratum"], truth["model"], kind, hidden, named, verdict, right,
        len(named) - right, bool(named) or in_set, whole, _family_right(kind, hidden, right_name, answer),
        _closed_of_removable(truth, answer) if whole and kind == "effect" and named else None, margin(answer),
        float(answer.get("seconds", 0.0)), scored,
    )  # fmt: skip


def as_scored(one: Outcome) -> str:
    """What the other author's scorer should call an outcome, from our own judgement of it."""
    if one.verdict == "failed":
        return "error"
    if one.accepted:
        return "right"
    if one.verdict == "named" and one.wrong:
        if one.right:
            return "part wrong"
        return "false alarm" if one.stratum in "BFG" else "wrong"
    if one.verdict == "named":
        return "partial"
    if one.verdict == "ambiguous" and one.wrong:
        return "wrong"
    if one.verdict == "ambiguous" and one.covered:
        return "in set"
    return "false alarm" if one.verdict == "ambiguous" and one.kind != "effect" else "abstain"


def margin(answer: Mapping[str, Any]) -> float:
    """Score of the best candidate less that of the next other effect [dB]; nought without a candidate."""
    best: dict[str, float] = {}
    for c in answer.get("candidates", ()):
        score = -math.inf if c["score"] is None else float(c["score"])
        effect = SAME.get(str(c["effect"]), str(c["effect"]))
        best[effect] = max(score, best.get(effect, -math.inf))
    scores = [s for s in sorted(best.values(), reverse=True) if math.isfinite(s)]
    return scores[0] - scores[1] if len(scores) > 1 else max([0.0, *scores])


def _family_right(kind: Kind, hidden: Sequence[str], right_name: bool, answer: Mapping[str, Any]) -> bool | None:
    if kind != "effect" or right_name or "failed" in answer:
        return None
    return bool({about(effect).family for effect in hidden} & set(answer.get("family", ())))


def _closed_of_removable(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> float | None:
    removable = truth["effects"][0]["removable"]
    gap = answer["gap"].get(removable["channel"], {})
    before, after = gap.get("holdout_before"), gap.get("holdout_after")
    if len(truth["effects"]) > 1 or not removable["holdout"] or before is None or after is None:
        return None
    return float(before**2 - after**2) / float(removable["holdout"]) ** 2
