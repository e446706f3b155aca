"""The answer of a diagnosis in one or two sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...effects import FAMILIES, about, words
from ...effects.about import Family
from ...logs.display import Display, display
from ...models.contract import with_unit
from ..criteria import (
    ABOVE_FLOOR_RATIO,
    CARRIED_OVER_RATIO,
    CHANGED_SHARE,
    EXPLAINED_SHARE,
    FAMILY_SHARE,
    NOTABLE_SHARE,
    SURE_FLOOR_SHARE,
)
from ..evidence import Candidate, Gap, ParameterChange, Place
from ..result import Diagnosis

DISTINCT = 0.01
"""Ends of a range that differ by less than this part of the larger are one value."""
OVER = {"x": "position", "v": "speed", "a": "acceleration", "sgn v": "the direction of motion", "dwell": "rests"}
"""Coordinates in words."""
BOTH_MOTIONS = "give runs with both motions to --measured"
TOO_LITTLE = "what the model's own parameters leave, too little for a name"
"""Of what the families are where nothing is missing."""
HOW = {
    "predicted": "such laws predict",
    "steps": "the steps of its converter make",
    "slow": "what moves slowly and with nothing in the log makes",
}
"""How a share of a residual is known to be of a family."""
ORDINAL = ("", "first", "second", "third", "fourth")


def answer(found: Diagnosis) -> str:
    """The answer in a few sentences: where the residual is, what explains it, the error before and after."""
    channel = leading_channel(found)
    if channel is None:
        return f"No answer from these runs: {'; '.join(found.gate.refused) or 'no effect for the gap shows in them'}."
    gap = found.gap[channel]
    numbers = errors_text(channel, gap)
    if found.verdict == "parameters":
        text = _with_other_values(found, numbers)
        text += _family_text(found, channel, f"{TOO_LITTLE},")
    elif found.verdict == "none":
        text = f"No effect named. {as_sentence(_remains(found, channel))} {as_sentence(numbers)}"
        text += _family_text(found, channel, f"{TOO_LITTLE},")
    elif found.verdict == "not_excited":
        reasons = "; ".join(found.gate.refused) or "their motion shows no effect that could explain it"
        text = f"No answer from these runs: {reasons}. {as_sentence(numbers)}"
    else:
        text = _with_gap(found, channel, numbers)
    return text + _unexplained_text(found) + _instruments_text(found) + _nuisances_text(found)


def _with_other_values(found: Diagnosis, numbers: str) -> str:
    """The sentences where other parameter values close the gap, in some channels that of the measured runs alone."""
    changes = ", ".join(changes_text(found.changes))
    how = f" ({changes})" if changes else ""
    beside = _nuisances(found)
    more = f" with {beside} (nuisance parameters, too small to be named)" if beside else ""
    elsewhere = [c for c, g in found.gap.items() if not carries_over(g)]
    of = " of the measured runs" if elsewhere else ""
    text = f"No effect named: other parameter values{more} close the gap{of}{how}. {as_sentence(numbers)}"
    text += _not_carried_text(elsewhere, "they") if elsewhere else ""
    if not found.unlike_references:
        return text
    there = ", ".join(changes_text(found.unlike_references))
    return (
        f"{text} They are not those of the reference runs ({there}, there first), and none serve both: the rig has "
        "changed since, or they stand for what is missing."
    )


def _not_carried_text(channels: Sequence[str], what: str) -> str:
    return (
        f" Of {' and '.join(channels)} {what} do not carry over to the held-out runs, whose motion shows what "
        f"the measured ones leave open: {BOTH_MOTIONS}."
    )


def _instruments_text(found: Diagnosis) -> str:
    """What the instruments do: limits that they stand at, what hums, and zeros that wander."""
    said = [
        f" {channel} stands at {_in_unit_of(found, channel, limit.level)} ({_percent(limit.share)} of the samples) "
        "where the model goes on: a sensor that saturates, and no law of the motion."
        for channel, limit in found.limits.items()
    ]
    said += [
        f" {'' if tone.taken_out else 'What is left of '}{channel} hums at {tone.frequency:.4g} Hz "
        f"({_in_unit_of(found, channel, tone.rms)} RMS), in step from end to end of each run: mains or a pump, or a "
        "faster tone sampled too slowly, and no law of the motion"
        f"{'; it is taken out of what is compared' if tone.taken_out else ''}."
        for channel, tone in found.tones.items()
    ]
    said += [
        f" The zero of {channel} wanders within each run ({_in_unit_of(found, channel, wander.rms)} RMS), slower than "
        "the motion and with nothing that the log holds: in the answer's errors it is free, in periods of "
        f"{wander.period:.2g} s and more, also on held-out runs; what it will do in another run no model tells."
        for channel, wander in found.wanders.items()
    ]
    return "".join(said)


def _in_unit_of(found: Diagnosis, channel: str, value: float) -> str:
    return display(found.gap[channel].unit, value)(value)


def _unexplained_text(found: Diagnosis) -> str:
    """Channels that nothing explains beside those that the answer does."""
    if not found.effects and not found.equivalent:
        return ""
    channels = [c for c, g in found.gap.items() if g.unexplained]
    numbers = "; ".join(errors_text(c, found.gap[c]) for c in channels)
    return f" What {' and '.join(channels)} lacks no effect of the library explains: {numbers}." if channels else ""


def _with_gap(found: Diagnosis, channel: str, numbers: str) -> str:
    """The sentence where something is missing."""
    if found.verdict == "unknown" and found.gap[channel].elsewhere:
        return _with_gap_elsewhere(found, channel, numbers)
    place = leading_place(found, channel)
    where = f"{share_text(place)}; " if place else ""
    of = "it" if place else f"the disagreement of {channel}"
    closes = closure_text(found.gap[channel])
    if found.verdict == "named":
        all_names = [*map(words, found.effects), *_beside(found)]
        names, many = " and ".join(all_names), len(all_names) > 1
        share = f"{names} explain{'' if many else 's'} {closes} of {of}" if closes else f"missing: {names}"
        return as_sentence(f"{where}{share}; {numbers}") + _of_the_answer(found, channel)
    if found.verdict == "ambiguous":
        names = either([words(e) for e in found.equivalent[0]])
        share = f"explains {closes} of {of}" if closes else "is missing"
        return as_sentence(
            f"{where}{names} {share}, these runs cannot tell which: play the next experiment; {numbers}"
        ) + _of_the_answer(found, channel)
    tried = [(c, x) for c in found.candidates if c.testable and (x := c.channels[channel].closure_measured) is not None]
    nearest = f" (the best, {words(tried[0][0].spec)}, {range_of(tried[0][1])})" if tried else ""
    text = as_sentence(f"{where}no effect of the library explains {of} well enough{nearest}; {numbers}")
    if channel not in found.limits and not (channel in found.tones and found.family == ("time",)):
        text += _family_text(found, channel, "what is missing")
    formula = next((s.formula for s in found.shapes if s.channel == channel and s.formula.text), None)
    if formula is None:
        return text
    return f"{text} What predicts {_percent(formula.share)} of it, not a name: {channel} lacks {formula.text}."


def _with_gap_elsewhere(found: Diagnosis, channel: str, numbers: str) -> str:
    """The sentence where only held-out runs show that something is missing: none of the candidates was fitted to it."""
    gap = found.gap[channel]
    unit = display(gap.unit, max(gap.holdout_before or 0.0, gap.floor))
    text = as_sentence(
        f"only the held-out runs show what {channel} lacks, and no values that the measured runs allow close it; "
        f"{numbers}, on the measured runs {unit(gap.after)}"
    )
    return f"{text} {as_sentence(BOTH_MOTIONS)}" + _family_text(found, channel, "what is missing there")


def _beside(found: Diagnosis) -> list[str]:
    """What is there beside the named effects and has no name of its own."""
    return [f"one of {', '.join(map(words, ids))} (these runs cannot tell which)" for ids in found.equivalent]


def _of_the_answer(found: Diagnosis, channel: str) -> str:
    """What an answer does not say by its names: that part of its gap is left, and of what its effects are laws."""
    gap = found.gap[channel]
    closure = gap.closure
    in_part = closure is not None and 0.0 < closure < EXPLAINED_SHARE
    left = " Part of it is left: the law of the rig is not quite the one that is named, or more is missing."
    text = left if in_part else ""
    if not carries_over(gap) and (gap.holdout_after or 0.0) > (gap.holdout_refitted or 0.0):
        unit = display(gap.unit, gap.refitted)
        text += f" On the measured runs a refit alone leaves {unit(gap.refitted)}, the answer {unit(gap.after)}."
        text += _not_carried_text([channel], "the values of the answer's model")
    return text + _laws_text(found)


def _laws_text(found: Diagnosis) -> str:
    """Of what the effects of the answer are laws; of named ones, not of what may be beside them."""
    named = {about(e).family for e in found.effects}
    laws = [FAMILIES[f] for f in found.family if not named or f in named]
    return f" Family: {either(laws) if found.verdict == 'ambiguous' else ' and '.join(laws)}." if laws else ""


def _family_text(found: Diagnosis, channel: str, what: str) -> str:
    """Of what something without a name is a law: by what such laws predict, or as the effect that comes closest is."""
    shown = {e.family: e for e in found.family_evidence if e.channel == channel and e.share > FAMILY_SHARE}
    nuisances = {about(spec).family for spec in found.also_in_model} if found.verdict == "parameters" else set()

    def why(family: Family) -> str:
        if family in shown:
            return f"{HOW[shown[family].how]} {_percent(shown[family].share)} of it"
        return "of a nuisance parameter" if family in nuisances else "of the effect that comes closest"

    families = [f"{FAMILIES[f]} ({why(f)})" for f in found.family]
    return f" {as_sentence(f'{what} is {either(families)}')}" if families else ""


def _remains(found: Diagnosis, channel: str) -> str:
    """What is left where no effect is named, and how much of an effect these runs would have shown."""
    gap = found.gap[channel]
    place = max((p for p in found.where if _notable(p, channel)), key=lambda p: p.rms, default=None)
    untested = len(found.not_excited)
    untestable = f"; {untested} effects are not testable here" if untested else ""
    if place is None:
        error = gap.after if gap.holdout_after is None else gap.holdout_after
        above = error > ABOVE_FLOOR_RATIO * gap.floor
        return ("what is left depends on nothing in the motion" if above else "no gap above the floor") + untestable
    in_unit = display(gap.unit, place.rms)
    over = OVER.get(place.coordinate, place.coordinate)
    below = f"below the threshold of {in_unit(gap.threshold, 2)}"
    limit = below if place.rms < gap.threshold else "of which no effect explains enough"
    return f"a repeatable residual of {in_unit(place.rms, 2)} (RMS) over {over} remains, {limit}{untestable}"


def _nuisances_text(found: Diagnosis) -> str:
    """What the answer's model holds beside the named effects; beside other parameter values it has been said."""
    names = _nuisances(found)
    if not names or found.verdict == "parameters":
        return ""
    return f" The model of the answer also holds {names}: nuisance parameters, too small to be named."


def _nuisances(found: Diagnosis) -> str:
    names = [words(e) for e in found.also_in_model]
    return listed(names) if names else ""


def either(names: Sequence[str]) -> str:
    """Alternatives as people list them."""
    return listed(names, "or")


def listed(names: Sequence[str], conjunction: str = "and") -> str:
    """Names as people list them."""
    *first, last = names
    return f"{', '.join(first)} {conjunction} {last}" if first else last


def leading_channel(found: Diagnosis) -> str | None:
    """The channel that the answer is about: what was closed most in floors, else what is furthest above its floor.

    Without an answer, of channels in which nothing is unexplained only where that is so of all.
    """
    answered = bool(found.effects or found.equivalent)

    def weight(g: Gap) -> float:
        removed = max(g.refitted**2 - g.after**2, 0.0) if answered else 0.0
        return (removed or 1e-9 * g.refitted**2) / max(g.floor, 1e-150) ** 2

    return max(found.gap, key=lambda c: (found.gap[c].unexplained and not answered, weight(found.gap[c])), default=None)


def leading_place(found: Diagnosis, channel: str) -> Place | None:
    """The significant place of a channel that holds most of the disagreement beyond chance; a band if no other."""
    notable = [p for p in found.where if _notable(p, channel, bands=True)]
    return max(notable, key=lambda p: (p.coordinate != "frequency", p.share_of_gap - p.share_of_samples), default=None)


def _notable(p: Place, channel: str, *, bands: bool = False) -> bool:
    known = p.channel == channel and p.significant and p.explained - p.chance > NOTABLE_SHARE
    return known and (bands or p.unit != "Hz")


def carries_over(g: Gap) -> bool:
    """Whether held-out runs, if there are any, are predicted about as well as the measured ones."""
    return g.holdout_after is None or g.holdout_after <= CARRIED_OVER_RATIO * max(g.after, g.floor)


def errors_text(channel: str, g: Gap) -> str:
    """Error before and after, with the floor, on held-out runs where there are any."""
    on_holdout = g.holdout_before is not None and g.holdout_after is not None
    before, after = (g.holdout_before, g.holdout_after) if on_holdout else (g.before, g.after)
    refitted = g.holdout_refitted if on_holdout else g.refitted
    before, after, refitted = before or 0.0, after or 0.0, refitted or 0.0
    unit = display(g.unit, max(before, g.floor))
    one, two, by_refit = (unit(x).removesuffix(f" {unit.unit}") for x in (before, after, refitted))
    distinct = abs(refitted - before) > CHANGED_SHARE * refitted < abs(refitted - after)
    by_refit = f" ({by_refit} by a refit alone)" if distinct else ""
    way = one if one == two else f"{one} -> {two}"
    floor = unit(g.floor)
    if g.floor_least < SURE_FLOOR_SHARE * g.floor:
        floor = f"{unit(g.floor_least).removesuffix(f' {unit.unit}')} to {floor}"
    return f"{'held-out ' if on_holdout else ''}error of {channel} {way} {unit.unit}{by_refit}, floor {floor}"


def closure_text(g: Gap) -> str:
    """Share of the gap that the effects close: a range where the floor is one; empty if nothing is closed."""
    if g.closure is None or g.closure <= 0.0:
        return ""
    return range_of((g.closure if g.closure_least is None else g.closure_least, g.closure))


def range_of(closures: tuple[float, float]) -> str:
    """Share of a gap that is closed, counted above the least and above the full floor."""
    least, most = _percent(max(closures[0], 0.0)), _percent(closures[1])
    if least == most:
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
    largest, distinct = max(*map(abs, ends), 1e-300), abs(ends[1] - ends[0])
    step = 10.0 ** (np.floor(np.log10(largest)) - 1)
    if distinct > DISTINCT * largest:
        step = min(step, 10.0 ** np.floor(np.log10(distinct)))
    low, high = (Display(unit.unit, 1.0)(round(v / step) * step + 0.0) for v in ends)
    return low, high


def changes_text(changes: Sequence[ParameterChange], most: int = 3) -> list[str]:
    """Parameters that the answer's fit moved, with their values: the first of them."""
    return [f"{c.name} {c.before:.3g} -> {with_unit(f'{c.after:.3g}', c.unit)}" for c in changes[:most]]


def best_wrong(found: Diagnosis) -> Candidate | None:
    """The best candidate that the answer does not hold: how good a wrong name would look."""
    others = [c for c in found.candidates if c.effect not in found.answered and c.testable]
    return min(others, key=lambda c: c.misfit, default=None) if found.answered else None


def _percent(share: float | None) -> str:
    if share is not None and share > 0.995:
        return "all"
    return f"{round(100.0 * (share or 0.0))} %"


def as_sentence(text: str) -> str:
    """A clause with its capital letter and its full stop."""
    return f"{text[0].upper()}{text[1:]}."
