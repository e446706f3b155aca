"""The report of a diagnosis: the answer in one sentence, then the evidence."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import __version__
from ...kernels.chain import id_of
from ...logs.display import display
from ...report import Section, Table, write_report
from ..choice.excitation import EXCITATION, words
from ..choice.next_experiment import Motion
from ..choice.summary import Candidate
from ..residual.formula import Hint
from ..residual.locate import Place
from ..residual.terms import LEGEND
from ..runs.thinning import motion_channel
from ..workflow import Diagnosis
from .plots import dependence_figures, experiment_figures, run_sections
from .sentence import (
    TELLING,
    best_wrong,
    changed_parameters,
    closure_text,
    leading_channel,
    place_text,
    range_text,
    share_text,
)

if TYPE_CHECKING:
    from .write import Gap

MOST_PLACES = 12
ELSEWHERE = 2.0
"""Error on held-out runs over that on measured ones beyond which a fit does not carry over."""
PLAIN = {"N/(m/s2)": "kg", "N.m/(rad/s2)": "kg.m2", "N/(m/s)": "N.s/m", "N.m/(rad/s)": "N.m.s/rad"}
"""Units of effects in the form that people use."""


def write_diagnosis_report(
    path: Path, summary: str, found: Diagnosis, gap: Mapping[str, Gap], hints: Sequence[Hint], motion: Motion | None,
    provenance: Mapping[str, Any],
) -> Path:  # fmt: skip
    """Write the report; see `tsm_fmu.report.write_report`.

    Parameters
    ----------
    path : Path
    summary : str
        The answer of `answer.answer`.
    found : Diagnosis
    gap : mapping of str to Gap
    hints : sequence of Hint
    motion : Motion or None
        The next experiment.
    provenance : mapping
        What else produced the numbers: records with their hashes, seed.
    """
    made = [
        _gaps(gap), _where(found, hints), _candidates(found, gap), _formulas(found, hints), *run_sections(found),
        _not_excluded(found), _next(found, motion), _parameters(found), _notes(found),
    ]  # fmt: skip
    model = found.final.model if found.final else ""
    sources = (
        {"tsm-fmu": __version__, "verdict": found.verdict} | ({"model": model} if model else {}) | dict(provenance)
    )
    title = f"Diagnosis of {model}" if model else "Diagnosis"
    return write_report(path, title, summary, [s for s in made if s], sources)


def _gaps(gap: Mapping[str, Gap]) -> Section | None:
    if not gap:
        return None
    lines = [
        "Root mean square of measured minus simulated; a refit alone has other parameter values only. The floor is "
        "what the runs do not repeat; without repeats, what the best fit leaves and nothing in the motion predicts. "
        "That may still hold a law: only what changes from sample to sample is surely noise.",
        "Gap closed: share of the mean square above the floor that is gone. Where it is a range, the lower end counts "
        "all but the sure noise as gap.",
    ]
    for channel, g in gap.items():
        if g.holdout_after is not None and g.holdout_after > ELSEWHERE * max(g.after, g.floor):
            lines.append(
                f"Caution: the error of {channel} on the held-out runs is {g.holdout_after / g.after:.2g} times that "
                "on the measured ones: the fitted model does not fully carry over to their motion."
            )
    return Section("Gap", "\n\n".join(lines), [_gap_table(channel, g) for channel, g in gap.items()])


def _gap_table(channel: str, g: Gap) -> Table:
    """Errors of one channel: a row each, so that a phone shows the whole table."""
    unit = display(g.unit, max(g.before, g.floor))
    held = g.holdout_before is not None
    runs = ("measured", "held out") if held else ("measured",)
    interval = ""
    if g.closure_interval is not None:
        interval = "{:.0f} to {:.0f} %".format(*(100 * min(x, 1.0) for x in g.closure_interval))
    errors = {
        "model as given": (g.before, g.holdout_before),
        "refit alone": (g.refitted, g.holdout_refitted),
        "model of the answer": (g.after, g.holdout_after),
        "its exported FMU": (g.fmu, None),
        "floor": (g.floor, g.floor if held else None),
        "surely noise": (g.floor_least, g.floor_least if held else None),
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


def _where(found: Diagnosis, hints: Sequence[Hint]) -> Section | None:
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
    whose = "the model as given" if found.verdict in ("none", "parameters") else "the refitted model"
    told: dict[str, list[str]] = {}
    for p in found.where:
        if p.significant and p.explained - p.chance > TELLING:
            parts = told.setdefault(p.channel, [])
            parts.append(f"{_percent(p.share_of_gap)} {place_text(p)}" if parts else share_text(p))
    text = " ".join(f"{', '.join(parts[:3])}." for parts in told.values())
    text = text or "The disagreement does not depend on any coordinate beyond chance."
    caption = (
        f"Residual of {whose}, most telling first. Explained: share of its variance that is a function of the "
        "coordinate, for each direction of motion; by chance: the same in noise of its colour; p: how often that noise "
        "does as well; significant after Benjamini-Hochberg at 5 %."
    )
    if found.given is not None and motion_channel(found.given.problem.kernel) == "v":
        caption += " Only the speed is known: positions x count from the start of each run."
    figures = [f for h in hints for f in dependence_figures(h)]
    return Section("Where", text, [Table(heading, rows, caption)], figures)


def _span(p: Place) -> str:
    """Range of a place for a table: one value where both ends look the same."""
    return place_text(p) if p.coordinate == "sgn v" else " to ".join(dict.fromkeys(range_text(p)))


def _candidates(found: Diagnosis, gap: Mapping[str, Gap]) -> Section | None:
    if not found.candidates or found.baseline is None:
        return None
    channel = leading_channel(found, gap) or found.channels[0]
    c, base = found.channels.index(channel), found.baseline
    unit = display(base_unit(found, channel), float(base.rmse[c]))
    rows: list[tuple[Any, ...]] = [("none (refit alone)", _rounded(base.rmse[c] * unit.factor), "", "", "", "", "")]
    rows += [
        (words(r.spec), _rounded(r.fitted.rmse[c] * unit.factor), _closed(r.closure_measured),
         _closed(r.closure_holdout), round(r.score, 1) + 0.0, r.spec, _values(r))
        for r in found.candidates
    ]  # fmt: skip
    error = f"error of {channel} [{unit.unit}]"
    heading = ("effect", error, "closes, measured", "closes, held out", "score", "id", "parameters")
    caption = (
        "Every fit but the refit alone is also free to bend the curve of friction after reversals, to shift a channel "
        "by an offset and to delay it a little. Closes: share of the gap left by the refit alone that is gone, by "
        "effect and freedom together. Score: what the effect itself removes beyond the freedom [dB of the mean square, "
        "measured and held-out runs together]; about 0: nothing."
    )
    text = "Each effect refitted together with the model: those of the answer together, the others alone."
    wrong = best_wrong(found)
    if wrong is not None and found.final is not None:
        names = [words(e) for e in found.final.effects if id_of(e) in found.answered]
        values = [unit(float(f.rmse[c])) for f in (found.final, wrong.fitted)]
        text += f" Error of {channel} with {' and '.join(names)}: {values[0]}; with the best of the others, "
        text += f"{words(wrong.spec)}: {values[1]}."
    return Section("Candidates", text, [Table(heading, rows, caption)])


def _formulas(found: Diagnosis, hints: Sequence[Hint]) -> Section | None:
    if found.verdict not in ("unknown", "ambiguous"):
        return None
    lines = []
    for h in hints:
        f = h.formula
        if f.text:
            lines.append(
                f"{h.channel}: residual = {f.text}. Predicts {100 * f.share:.0f} % of the residual on parts left out."
            )
        else:
            lines.append(f"{h.channel}: no short formula predicts the residual on parts left out.")
    if not lines:
        return None
    if any(h.formula.text for h in hints):
        lines.append(f"A description within the range of these runs, not a name: other laws look alike. {LEGEND}.")
    return Section("What the missing part looks like", "\n\n".join(lines))


def _not_excluded(found: Diagnosis) -> Section | None:
    parts, tables = [], []
    for ids in found.equivalent:
        parts.append(f"These runs cannot tell apart: {', '.join(words(e) for e in ids)}.")
    if found.hidden:
        rows = [(words(e), EXCITATION[e].shown_by, e) for e in found.hidden]
        caption = "These runs could not show: too small in them, or taken up by the model's own parameters"
        tables.append(Table(("effect", "what would show it", "id"), rows, caption))
    if found.unplaced:
        model = found.final.model if found.final else "the model"
        parts.append(
            f"Nothing is said of these, which have no place in {model} with these channels: "
            f"{', '.join(words(e) for e in found.unplaced)}."
        )
    return Section("What could not be excluded", "\n\n".join(parts), tables) if parts or tables else None


def _next(found: Diagnosis, motion: Motion | None) -> Section | None:
    if motion is None or found.final is None:
        return None
    rivals = " and ".join(words(e) for e in found.equivalent[0]) if found.equivalent else "the rivals"
    text = (
        f"Play {motion.name} (next_experiment.csv, {motion.time[-1]:.0f} s): the predictions of {rivals} then differ "
        f"by {motion.separation:.2g} times the floor."
    )
    return Section("Next experiment", text, figures=experiment_figures(found.final.problem.kernel, motion))


def _parameters(found: Diagnosis) -> Section | None:
    """Values of the model as given, refitted, and of the answer's model."""
    fits = [f for f in (found.given, found.baseline, found.final) if f is not None]
    if len(fits) < 3:
        return None
    values = [f.values for f in fits]
    declared = {v.name: v for f in fits for v in f.problem.kernel.parameters}
    rows = [
        (name, *("" if name not in v else _rounded(v[name]) for v in values), v_.quantity.unit, v_.quantity.meaning)
        for name, v_ in declared.items()
    ]
    text = "Of what each run has of its own, the mean over the runs; the card has the value of each run."
    return Section(
        "Parameters", text, [Table(("parameter", "as given", "refitted", "answer", "unit", "meaning"), rows)]
    )


def _notes(found: Diagnosis) -> Section | None:
    changes = changed_parameters(found, 6) if found.verdict in ("named", "ambiguous", "parameters") else []
    parts = [f"The refit moved {', '.join(changes)}."] if changes else []
    freedom = _freedom(found)
    if freedom:
        parts.append(
            f"The model of the answer, its card and its FMU also hold {' and '.join(freedom)}: freedom of every fit, "
            "of too little effect to be named."
        )
    parts += [f"{n[0].upper()}{n[1:].rstrip('.')}." for n in (*found.notes, *found.gate.refused)]
    runs: dict[str, list[str]] = {}
    for note in found.gate.notes:  # "run: finding"; the same of several runs is one row
        run, _, finding = note.partition(": ")
        runs.setdefault(finding, []).append(run)
    rows = [(finding, ", ".join(names)) for finding, names in runs.items()]
    tables = [Table(("finding", "runs"), rows, "What the check of the data says")] if rows else []
    return Section("Notes", "\n\n".join(parts), tables) if parts or tables else None


def _freedom(found: Diagnosis) -> list[str]:
    """Effects of the final model that are neither of the model as given nor of the answer, with their ids."""
    if found.final is None or found.given is None:
        return []
    return [
        f"{words(e)} ({e})"
        for e in found.final.effects
        if e not in found.given.effects and id_of(e) not in found.answered
    ]


def base_unit(found: Diagnosis, channel: str) -> str:
    """SI unit of a channel."""
    assert found.baseline is not None
    return next(v.quantity.unit for v in found.baseline.problem.kernel.outputs if v.name == channel)


def _values(r: Candidate) -> str:
    """Parameters of a candidate with their units."""
    units = {v.name: v.quantity.unit for v in r.fitted.problem.kernel.parameters}
    own = {n: next((u for name, u in units.items() if name.endswith(f"{r.effect}.{n}")), "1") for n in r.parameters}
    return ", ".join(f"{n} = {value_text(value, own[n])}" for n, value in r.parameters.items())


def value_text(value: float, unit: str) -> str:
    """A parameter as people read it: deg for rad, kg for N/(m/s2)."""
    plain = re.sub(r"\((\w+)\)", r"\1", PLAIN.get(unit, unit))
    return display(plain, value)(value)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}") if np.isfinite(value) else value


def _closed(share: float | None) -> str:
    """Share of a gap that is closed; on held-out runs a fit can also be worse than the one without it."""
    return "worse" if share is not None and share < -0.005 else _percent(share if share is None else min(share, 1.0))


def _percent(share: float | None) -> str:
    return "" if share is None else f"{round(100.0 * share)} %"
