"""The answer of a diagnosis in one or two sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...logs.display import Display, display
from ...models.contract import with_unit
from ..choice.excitation import words
from ..choice.summary import Candidate
from ..fits.refit import Fitted
from ..residual.formula import Hint
from ..residual.locate import Place
from ..workflow import Diagnosis

if TYPE_CHECKING:
    from .write import Gap

TELLING = 0.1
"""Share of the residual that a coordinate must explain to be worth a sentence."""
CHANGED = 0.02
"""A parameter that a refit moved by less than this part of itself is not worth a word."""
WEIGHTY = 0.1
"""Nor is one whose move does less than this part of what another's does."""
ABOVE = 1.3
"""Error over the floor from which on it is said that it is above."""
SURE = 0.8
"""A floor whose lower bound is above this part of it is one number."""
APART = 0.01
"""Ends of a range that differ by less than this part of the larger are one value."""
ORDINAL = ("", "first", "second", "third", "fourth")


def answer(found: Diagnosis, gap: Mapping[str, Gap], hints: Sequence[Hint] = ()) -> str:
    """The answer in one or two sentences.

    Parameters
    ----------
    found : Diagnosis
    gap : mapping of str to Gap
        Of each channel; empty where nothing could be compared.
    hints : sequence of Hint
        For the formula where nothing is named.
    """
    channel = leading_channel(found, gap)
    if channel is None:
        return f"No answer from these runs: {'; '.join(found.gate.refused) or 'no effect for the gap shows in them'}."
    numbers = errors_text(channel, gap[channel])
    place = leading_place(found, channel)
    where = f"{share_text(place)}; " if place else ""
    of = "it" if place else f"the disagreement of {channel}"
    if found.verdict == "named":
        names, many = " and ".join(words(e) for e in found.effects), len(found.effects) > 1
        closes = closure_text(gap[channel])
        share = f"{names} explain{'' if many else 's'} {closes} of {of}" if closes else f"missing: {names}"
        return _sentence(f"{where}{share}; {numbers}")
    if found.verdict == "ambiguous":
        names = either([words(e) for e in found.equivalent[0]])
        best = next((c.closure_measured for c in found.candidates if c.effect in found.equivalent[0]), None)
        share = f"explains {_percent(best)} of {of}" if best else "is missing"
        return _sentence(f"{where}{names} {share}, these runs cannot tell which: play the next experiment; {numbers}")
    if found.verdict == "parameters":
        changes = ", ".join(changed_parameters(found))
        how = f" ({changes})" if changes else ""
        return f"Nothing is missing: other parameter values close the gap{how}. {_sentence(numbers)}"
    if found.verdict == "none":
        g = gap[channel]
        form = (g.after if g.holdout_after is None else g.holdout_after) > ABOVE * g.floor
        what = "the gap is within the form of any friction model" if form else "no gap above the floor"
        return f"Nothing is missing: {what}. {_sentence(numbers)}"
    if found.verdict == "not_excited":
        reasons = "; ".join(found.gate.refused) or "no effect that could explain it shows in them"
        return f"No answer from these runs: {reasons}. {_sentence(numbers)}"
    tried = next((c for c in found.candidates if c.closure_measured is not None), None)
    nearest = f" (the best, {words(tried.spec)}, {_percent(tried.closure_measured)})" if tried else ""
    text = _sentence(f"{where}no effect of the library explains {of} well enough{nearest}; {numbers}")
    formula = next((h.formula for h in hints if h.channel == channel and h.formula.text), None)
    if formula is None:
        return text
    return f"{text} What predicts {_percent(formula.share)} of it, not a name: {channel} lacks {formula.text}."


def either(names: Sequence[str]) -> str:
    """Alternatives as people list them."""
    *first, last = names
    return f"{', '.join(first)} or {last}" if first else last


def leading_channel(found: Diagnosis, gap: Mapping[str, Gap]) -> str | None:
    """The channel that the answer is about: what was closed most in floors, else what is furthest above its floor."""

    def weight(g: Gap) -> float:
        removed = max(g.refitted**2 - g.after**2, 0.0) if found.effects or found.equivalent else 0.0
        return (removed or 1e-9 * g.refitted**2) / max(g.floor, 1e-300) ** 2

    return max(gap, key=lambda c: weight(gap[c]), default=None)


def leading_place(found: Diagnosis, channel: str) -> Place | None:
    """The significant place of a channel that holds most of the disagreement beyond chance; a band if no other."""
    told = [p for p in found.where if p.channel == channel and p.significant and p.explained - p.chance > TELLING]
    return max(told, key=lambda p: (p.coordinate != "frequency", p.share_of_gap - p.share_of_samples), default=None)


def errors_text(channel: str, g: Gap) -> str:
    """Error before and after, with the floor, on held-out runs where there are any."""
    held = g.holdout_before is not None and g.holdout_after is not None
    before, after = (g.holdout_before, g.holdout_after) if held else (g.before, g.after)
    refitted = g.holdout_refitted if held else g.refitted
    before, after, refitted = before or 0.0, after or 0.0, refitted or 0.0
    unit = display(g.unit, max(before, g.floor))
    one, two, alone = (unit(x).removesuffix(f" {unit.unit}") for x in (before, after, refitted))
    apart = abs(refitted - before) > CHANGED * refitted < abs(refitted - after)
    alone = f" ({alone} by a refit alone)" if apart else ""
    way = one if one == two else f"{one} -> {two}"
    floor = unit(g.floor)
    if g.floor_least < SURE * g.floor:
        floor = f"{unit(g.floor_least).removesuffix(f' {unit.unit}')} to {floor}"
    return f"{'held-out ' if held else ''}error of {channel} {way} {unit.unit}{alone}, floor {floor}"


def closure_text(g: Gap) -> str:
    """Share of the gap that the effects close: a range where the floor is one; empty if nothing is closed."""
    if g.closure is None or g.closure <= 0.0:
        return ""
    least, most = _percent(max(g.closure_least or 0.0, 0.0)), _percent(g.closure)
    if least == most or g.closure_least is None:
        return most
    return f"{least if most == 'all' else least.removesuffix(' %')} to {most}"


def share_text(p: Place) -> str:
    """How much of the disagreement lies where, in words."""
    return (
        f"{_percent(p.share_of_gap)} of the disagreement of {p.channel} lies {place_text(p)} "
        f"({_percent(p.share_of_samples)} {'by chance' if p.unit == 'Hz' else 'of the samples'})"
    )


def place_text(p: Place) -> str:
    """Where a place is, in words."""
    low, high = range_text(p)
    one = low == high  # all of it at one value, or at values that look the same
    span = f"of about {low}" if one else f"from {low} to {high}"
    between = f"at about {low}" if one else f"between {low} and {high}"
    if p.coordinate == "distance since reversal":
        if p.range[0] < 0.1 * p.range[1]:
            return f"within {high} after reversals"
        return f"{f'about {low}' if one else span} after reversals"
    if p.coordinate == "sgn v":
        return {1.0: "on the way forth", -1.0: "on the way back"}.get(float(np.sign(sum(p.range))), "at rest")
    if p.coordinate == "v" and abs(sum(p.range)) < 0.3 * max(np.abs(p.range)):
        return f"at speeds below {max(low.lstrip('-'), high, key=lambda t: float(t.split()[0]))}"
    if p.coordinate.startswith("harmonic "):
        number = int(p.coordinate.split()[1])
        return f"at the {ORDINAL[number]} harmonic of the motion ({low})"
    names = {
        "x": f"at positions {span}", "v": f"at speeds {span}", "a": f"at accelerations {span}",
        "dwell": f"after rests {span}", "time": f"{between} of a run", "load": f"at loads {span}",
        "drum angle": f"at drum angles {span}", "frequency": f"{between}, in step with the motion",
        "odd harmonics": "at odd harmonics of the motion", "even harmonics": "at even harmonics of the motion",
    }  # fmt: skip
    return names[p.coordinate]


def range_text(p: Place) -> tuple[str, str]:
    """Both ends of a place's range, to a hundredth of the larger one, or as fine as it takes to tell them apart."""
    unit = display(p.unit, max(abs(p.range[0]), abs(p.range[1])))
    ends = [v * unit.factor for v in p.range]
    largest, apart = max(*map(abs, ends), 1e-300), abs(ends[1] - ends[0])
    step = 10.0 ** (np.floor(np.log10(largest)) - 1)
    if apart > APART * largest:
        step = min(step, 10.0 ** np.floor(np.log10(apart)))
    low, high = (Display(unit.unit, 1.0)(round(v / step) * step + 0.0) for v in ends)
    return low, high


def changed_parameters(found: Diagnosis, most: int = 3) -> list[str]:
    """Parameters that the answer's fit moved, with their values: first whose move does most to the channels."""
    given, final = found.given, found.final
    if given is None or final is None:
        return []
    before, after = given.values, final.values
    names = [v for v in final.problem.kernel.parameters if v.field in final.problem.shared and v.name in before]
    moved = [
        v for v in names
        if abs(after[v.name] - before[v.name]) > CHANGED * max(abs(before[v.name]), abs(after[v.name]))
    ]  # fmt: skip
    does = {v.name: _undone(final, v.field, before[v.name]) for v in moved}
    least = WEIGHTY * max((d for d in does.values() if np.isfinite(d)), default=0.0)
    told = sorted((v for v in moved if does[v.name] >= least), key=lambda v: -does[v.name])
    return [
        f"{v.name} {before[v.name]:.3g} -> {with_unit(f'{after[v.name]:.3g}', v.quantity.unit)}"
        for v in told[:most]
    ]  # fmt: skip


def _undone(final: Fitted, field: str, value: float) -> float:
    """Largest change of a channel if one parameter alone had its old value; infinite where the others forbid it."""
    return float(np.nan_to_num(final.change_with({field: value}), nan=np.inf).max())


def best_wrong(found: Diagnosis) -> Candidate | None:
    """The best candidate that the answer does not hold: how good a wrong name would look."""
    others = [c for c in found.candidates if c.effect not in found.answered]
    return min(others, key=_error, default=None) if found.answered else None


def _error(c: Candidate) -> float:
    return error_of(c.fitted)


def error_of(fitted: Fitted) -> float:
    """RMSE over the spread of the channel, summed in squares over the channels."""
    return float(np.sum((fitted.rmse / np.maximum(fitted.spread, 1e-300)) ** 2))


def _percent(share: float | None) -> str:
    if share is not None and share > 0.995:
        return "all"
    return f"{round(100.0 * (share or 0.0))} %"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."
