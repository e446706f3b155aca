"""The report of a diagnosis: the answer in one sentence, then the evidence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...effects import FAMILIES, about, words
from ...logs.display import display
from ...report import Section, Table, write_report
from ..answer.sentence import (
    TOO_LITTLE,
    as_sentence,
    best_wrong,
    carries_over,
    changes_text,
    closure_text,
    leading_channel,
    place_text,
    range_of,
    range_text,
    share_text,
)
from ..criteria import NOTABLE_SHARE
from ..evidence import Candidate, Gap, Place
from ..residual.library import LEGEND
from ..result import MISSING, Diagnosis
from .plots import dependence_figures, motion_figures, run_sections

MOST_PLACES = 12


def write_diagnosis_report(path: Path, found: Diagnosis) -> Path:
    """Write the report; see `tsm_fmu.report.write_report`."""
    made = [
        _gaps(found), _where(found), _candidates(found), _families(found), _formulas(found), _improved(found),
        *run_sections(found), _not_excluded(found), _next(found), _parameters(found), _notes(found),
    ]  # fmt: skip
    model = found.final.model if found.final else ""
    sources = {"tsm-fmu": __version__, "verdict": found.verdict} | ({"model": model} if model else {})
    sources |= {"preset": found.preset or "none", "seed": str(found.seed)}
    sources |= {record: f"sha256 {sha256}" for record, sha256 in found.records.items()}
    title = f"Diagnosis of {model}" if model else "Diagnosis"
    return write_report(path, title, found.answer, [s for s in made if s], sources)


def _gaps(found: Diagnosis) -> Section | None:
    if not found.gap:
        return None
    reference = any(g.reference is not None for g in found.gap.values())
    lines = [
        "Root mean square of measured minus simulated; a refit alone has other parameter values only. The floor is "
        "what the runs do not repeat; without repeats, what the best fit leaves and nothing in the motion predicts. "
        + ("It is not less than what the refitted model leaves on reference runs." if reference else
           "That may still hold a law: only what changes from sample to sample is surely noise."),
        "Gap closed: share of the mean square above the floor that is gone. Where it is a range, the lower end counts "
        "all but the least floor as gap. An effect that removes less than the threshold is not named.",
    ]  # fmt: skip
    if found.wanders:
        of = " and ".join(found.wanders)
        lines.append(
            f"In the errors of the answer's model the zero of {of} is free to wander; the FMU's hold that too."
        )
    for channel, g in found.gap.items():
        if g.holdout_after is not None and not carries_over(g):
            lines.append(
                f"Caution: the error of {channel} on the held-out runs is {g.holdout_after / g.after:.2g} times that "
                "on the measured ones: the fitted model does not fully carry over to their motion."
            )
    tables = [_gap_table(channel, g) for channel, g in found.gap.items()]
    return Section("Gap", "\n\n".join(lines), tables, [found.figure()])


def _gap_table(channel: str, g: Gap) -> Table:
    """Errors of one channel: a row each, so that a phone shows the whole table."""
    unit = display(g.unit, max(g.before, g.floor))
    on_holdout = g.holdout_before is not None
    runs = ("measured", "held out") if on_holdout else ("measured",)
    interval = ""
    if g.closure_interval is not None:
        interval = "{:.0f} to {:.0f} %".format(*(100 * min(x, 1.0) for x in g.closure_interval))
    least = "surely noise" if g.reference is None else "left on reference runs, or noise"
    errors = {
        "model as given": (g.before, g.holdout_before),
        "refit alone": (g.refitted, g.holdout_refitted),
        "model of the answer": (g.after, g.holdout_after),
        "its exported FMU": (g.fmu, None),
        "floor": (g.floor, g.floor if on_holdout else None),
        least: (g.floor_least, g.floor_least if on_holdout else None),
        "threshold of an effect": (g.threshold or None, None),
    }
    rows: list[tuple[Any, ...]] = [
        (name, *(None if x is None else _rounded(x * unit.factor) for x in values[: len(runs)]))
        for name, values in errors.items()
        if any(x is not None for x in values)
    ]
    for name, text in (("gap closed", closure_text(g)), ("the same, 90 % over runs", interval)):
        if text:
            rows.append((name, *("" for _ in runs[1:]), text))
    return Table((f"error of {channel} [{unit.unit}]", *runs), rows)


def _improved(found: Diagnosis) -> Section | None:
    """The way to the model that predicts best."""
    if found.improved is None:
        return None
    frame = found.improved_frame()
    rows = [
        (name, *(f"{x:.3g}" for x in row)) for name, row in zip(frame.index, frame.to_numpy().tolist(), strict=True)
    ]
    zeros = [
        Table(
            (f"zero of {z.channel} by run", f"[{(unit := display(z.unit, z.scatter)).unit}]"),
            [(run, _rounded(x * unit.factor)) for run, x in z.by_run.items()],
        )
        for z in found.improved.zeros
    ]
    return Section(
        "For prediction", found.improved.text, [Table(("added, RMS", *map(str, frame.columns)), rows), *zeros]
    )


def _where(found: Diagnosis) -> Section | None:
    if not found.where:
        return None
    rows = [
        (p.channel, p.coordinate, _span(p), _percent(p.share_of_gap), _percent(p.share_of_samples),
         _percent(p.explained), _percent(p.chance), "< 1e-6" if p.p <= 1e-6 else f"{p.p:.1g}",
         "yes" if p.significant else "no")
        for p in found.where[:MOST_PLACES]
    ]  # fmt: skip
    heading = (
        "channel",
        "over",
        "mostly",
        "of the gap",
        "of samples",
        "explained",
        "by chance",
        "p",
        "significant",
    )
    whose = "the model as given" if found.located == "given" else "the refitted model"
    notable: dict[str, list[str]] = {}
    for p in found.where:
        if p.significant and p.explained - p.chance > NOTABLE_SHARE:
            parts = notable.setdefault(p.channel, [])
            parts.append(f"{_percent(p.share_of_gap)} {place_text(p)}" if parts else share_text(p))
    text = " ".join(as_sentence(", ".join(parts[:3])) for parts in notable.values())
    text = text or "The disagreement does not depend on any coordinate beyond chance."
    if any(g.elsewhere for g in found.gap.values()):
        text += " This is of the measured runs, which do not show what the held-out ones do."
    caption = (
        f"Residual of {whose}, most telling first. Explained: share of its variance that is a function of the "
        "coordinate, for each direction of motion; by chance: the same in noise of its colour; p: how often that noise "
        "does as well; significant after Benjamini-Hochberg at 5 %."
    )
    if found.motion == "v":
        caption += " Only the speed is known: positions x count from the start of each run."
    figures = [f for shape in found.shapes for f in dependence_figures(shape)]
    return Section("Where", text, [Table(heading, rows, caption)], figures)


def _span(p: Place) -> str:
    """Range of a place for a table: one value where both ends look the same."""
    return place_text(p) if p.coordinate == "sgn v" else " to ".join(dict.fromkeys(range_text(p)))


def _candidates(found: Diagnosis) -> Section | None:
    testable = [c for c in found.candidates if c.testable]
    channel = leading_channel(found)
    if not testable or channel is None:
        return None
    gap = found.gap[channel]
    unit = display(gap.unit, gap.refitted)
    rows: list[tuple[Any, ...]] = [("none (refit alone)", _rounded(gap.refitted * unit.factor), "", "", "", "", "")]
    rows += [
        (words(c.spec), _rounded(c.channels[channel].measured * unit.factor),
         _closed(c.channels[channel].closure_measured), _closed(c.channels[channel].closure_holdout),
         round(c.score, 1) + 0.0, c.spec, _values(c))
        for c in testable
    ]  # fmt: skip
    error = f"error of {channel} [{unit.unit}]"
    heading = ("effect", error, "closes, measured", "closes, held out", "score", "id", "parameters")
    caption = (
        "Every fit but the refit alone is also free to bend the curve of friction after reversals, to shift a channel "
        "by an offset and to delay it a little. Closes: share of the gap left by the refit alone that is gone, by "
        "effect and nuisance parameters together; a range as above. Score: what the effect itself removes beyond them "
        "[dB of the mean square, all channels, measured and held-out runs together]; about 0: nothing."
    )
    text = "Each effect refitted together with the model: those of the answer together, the others alone."
    if found.wanders:
        text += f" In all of these fits the zero of {' and '.join(found.wanders)} is free to wander."
    wrong = best_wrong(found)
    if wrong is not None and found.effects:
        values = [unit(gap.after), unit(wrong.channels[channel].measured)]
        text += f" Error of {channel} with {' and '.join(words(e) for e in found.effects)}: {values[0]}; with the best "
        text += f"of the others, {words(wrong.spec)}: {values[1]}."
    hidden = [words(c.spec) for c in found.candidates if not c.testable]
    if hidden:
        text += f" Tried as well, but these runs could not show them: {', '.join(hidden)}."
    return Section("Candidates", text, [Table(heading, rows, caption)])


def _families(found: Diagnosis) -> Section | None:
    """Over what the missing part is a law, also where it has no name."""
    if not found.family_evidence:
        return None
    rows = [
        (e.channel, FAMILIES[e.family] + (f" ({e.how})" if e.how != "predicted" else ""), _percent(max(e.share, 0.0)))
        for e in found.family_evidence
    ]
    what = "what is missing" if found.verdict in MISSING else TOO_LITTLE
    text = (
        f"Of {what}: {' and '.join(FAMILIES[f] for f in found.family)}."
        if found.family
        else f"No family of laws predicts enough of {what} to say of which it is."
    )
    caption = (
        "What the laws of each family predict of the residual of the refitted model on parts that were left out, of "
        "what the model's parameters do not already do. Families share functions: the shares do not add up. "
        "Steps: what those of a converter make. Slow: what moves slowly and with nothing in the log."
    )
    return Section("Family", text, [Table(("channel", "of the residual", "predicted"), rows, caption)])


def _formulas(found: Diagnosis) -> Section | None:
    if found.verdict not in ("unknown", "ambiguous"):
        return None
    lines = []
    for h in found.shapes:
        f = h.formula
        if f.text:
            lines.append(
                f"{h.channel}: residual = {f.text}. Predicts {100 * f.share:.0f} % of the residual on parts left out."
            )
        else:
            lines.append(f"{h.channel}: no short formula predicts the residual on parts left out.")
    if not lines:
        return None
    if any(h.formula.text for h in found.shapes):
        lines.append(f"A description within the range of these runs, not a name: other laws look alike. {LEGEND}.")
    return Section("What the missing part looks like", "\n\n".join(lines))


def _not_excluded(found: Diagnosis) -> Section | None:
    parts, tables = [], []
    for ids in found.equivalent:
        parts.append(f"These runs cannot tell apart: {', '.join(words(e) for e in ids)}.")
    if found.not_excited:
        rows = [(words(e), about(e).shown_by, e) for e in found.not_excited]
        caption = "These runs could not show: too small in them, or taken up by the model's own parameters"
        tables.append(Table(("effect", "what would show it", "id"), rows, caption))
    if found.not_applicable:
        rows = [(words(e), why, e) for e, why in found.not_applicable.items()]
        tables.append(Table(("effect", "why", "id"), rows, "Not applicable: nothing is said of these"))
    return Section("What could not be excluded", "\n\n".join(parts), tables) if parts or tables else None


def _next(found: Diagnosis) -> Section | None:
    motion = found.next_motion
    if motion is None:
        return None
    rivals = " and ".join(words(e) for e in found.equivalent[0]) if found.equivalent else "the rivals"
    text = (
        f"Play {motion.name} (next_experiment.csv, {motion.time[-1]:.0f} s): the predictions of {rivals} then differ "
        f"by {motion.separation:.2g} times the floor."
    )
    return Section("Next experiment", text, figures=motion_figures(motion))


def _parameters(found: Diagnosis) -> Section | None:
    """Values of the model as given, refitted, and of the answer's model."""
    fits = [f for f in (found.given, found.refitted, found.final) if f is not None]
    if len(fits) < 3:
        return None
    declared = {p.name: p for f in fits for p in f.parameters}
    rows = [
        (name, *("" if name not in f.values else _rounded(f.values[name]) for f in fits), p.unit, p.meaning)
        for name, p in declared.items()
    ]
    text = "Of what each run has of its own, the mean over the runs; the card has the value of each run."
    return Section(
        "Parameters", text, [Table(("parameter", "as given", "refitted", "answer", "unit", "meaning"), rows)]
    )


def _notes(found: Diagnosis) -> Section | None:
    changes = changes_text(found.changes, 6) if found.verdict in ("named", "ambiguous", "parameters") else []
    parts = [f"The refit moved {', '.join(changes)}."] if changes else []
    if found.also_in_model:
        names = [f"{words(e)} ({e})" for e in found.also_in_model]
        parts.append(
            f"The model of the answer, its card and its FMU also hold {' and '.join(names)}: nuisance parameters of "
            "every fit, of too little effect to be named."
        )
    parts += [as_sentence(n.rstrip(".")) for n in (*found.notes, *found.gate.refused)]
    runs: dict[str, list[str]] = {}
    for note in found.gate.notes:  # "run: finding"; the same of several runs is one row
        run, _, finding = note.partition(": ")
        runs.setdefault(finding, []).append(run)
    rows = [(finding, ", ".join(names)) for finding, names in runs.items()]
    tables = [Table(("finding", "runs"), rows, "What the check of the data says")] if rows else []
    return Section("Notes", "\n\n".join(parts), tables) if parts or tables else None


def _values(c: Candidate) -> str:
    """Parameters of a candidate with their units."""
    return ", ".join(f"{n} = {display(c.units[n], value)(value)}" for n, value in c.parameters.items())


def _rounded(value: float) -> float:
    return float(f"{value:.3g}") if np.isfinite(value) else value


def _closed(closures: tuple[float, float] | None) -> str:
    """Share of a gap that is closed; on held-out runs a fit can also be worse than the one without it."""
    if closures is None:
        return ""
    return "worse" if closures[1] < -0.005 else range_of(closures)


def _percent(share: float | None) -> str:
    return "" if share is None else f"{round(100.0 * share)} %"
