"""The report of a diagnosis: the answer in one sentence, then the evidence."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..display import display
from ..report import Section, Table, write_report
from .answer import (
    TELLING,
    answer,
    best_wrong,
    changed_parameters,
    closure_text,
    leading_channel,
    place_text,
    range_text,
    share_text,
)
from .candidates import possible
from .excitation import EXCITATION, words
from .experiment import Motion
from .plots import dependence_figures, experiment_figures, run_sections
from .summary import Candidate
from .terms import LEGEND
from .unknown import Hint
from .workflow import Diagnosis

if TYPE_CHECKING:
    from .result import Gap

MOST_PLACES = 12


def write_diagnosis_report(
    path: Path, found: Diagnosis, gap: Mapping[str, Gap], hints: Sequence[Hint], motion: Motion | None,
    provenance: Mapping[str, Any],
) -> Path:  # fmt: skip
    """Write the report; see `tsm_fmu.report.write_report`.

    Parameters
    ----------
    path : Path
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
        _not_excluded(found), _next(found, motion), _notes(found),
    ]  # fmt: skip
    model = found.final.model if found.final else ""
    sources = (
        {"tsm-fmu": __version__, "verdict": found.verdict} | ({"model": model} if model else {}) | dict(provenance)
    )
    title = f"Diagnosis of {model}" if model else "Diagnosis"
    return write_report(path, title, answer(found, gap, hints), [s for s in made if s], sources)


def _gaps(gap: Mapping[str, Gap]) -> Section | None:
    if not gap:
        return None
    stages = {"as given": "before", "refitted": "refitted", "after": "after", "exported FMU": "fmu"}
    rows = []
    for channel, g in gap.items():
        unit = display(g.unit, max(g.before, g.floor))
        interval = (
            "" if g.closure_interval is None else "{:.0f} to {:.0f} %".format(*(100 * x for x in g.closure_interval))
        )
        held = g.holdout_before is not None
        for runs, prefix in (("measured", ""), ("held out", "holdout_")) if held else (("measured", ""),):
            errors = [getattr(g, prefix + field, None) for field in stages.values()]
            closed = (closure_text(g), interval) if bool(prefix) == held else ("", "")
            scaled = [None if x is None else _rounded(x * unit.factor) for x in (*errors, g.floor_least, g.floor)]
            rows.append((channel, runs, unit.unit, *scaled, *closed))
    heading = ("channel", "runs", "unit", *stages, "surely noise", "floor", "closed", "90 % over runs")
    text = (
        "Root mean square of measured minus simulated. Refitted: other parameter values only; after: with the effects "
        "of the answer. The floor is what the runs do not repeat; without repeats, what the best model leaves and "
        "nothing in the motion predicts, which may hold the form of a law too: surely noise is only what changes from "
        "sample to sample. Closed: share of the mean square above the floor that is gone, at least (above what is "
        "surely noise) to at most."
    )
    return Section("Gap", text, [Table(heading, rows)])


def _where(found: Diagnosis, hints: Sequence[Hint]) -> Section | None:
    if not found.where:
        return None
    rows = [
        (p.channel, p.coordinate, " to ".join(range_text(p)), _percent(p.share_of_gap), _percent(p.share_of_samples),
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
        "coordinate, for each direction of motion; p against noise of its colour, significant after Benjamini-Hochberg "
        "at 5 %"
    )
    figures = [f for h in hints for f in dependence_figures(h)]
    return Section("Where", text, [Table(heading, rows, caption)], figures)


def _candidates(found: Diagnosis, gap: Mapping[str, Gap]) -> Section | None:
    if not found.candidates or found.baseline is None:
        return None
    channel = leading_channel(found, gap) or found.channels[0]
    c, base = found.channels.index(channel), found.baseline
    unit = display(base_unit(found, channel), float(base.rmse[c]))
    rows: list[tuple[Any, ...]] = [("none (refit alone)", _rounded(base.rmse[c] * unit.factor), "", "", "", "", "")]
    rows += [
        (words(r.spec), _rounded(r.fitted.rmse[c] * unit.factor), _percent(r.closure_measured),
         _percent(r.closure_holdout), round(r.score, 1), r.spec, _values(r))
        for r in found.candidates
    ]  # fmt: skip
    error = f"error of {channel} [{unit.unit}]"
    heading = ("effect", error, "closes, measured", "closes, held out", "score", "id", "parameters")
    caption = "Score: what it removes beyond the refit [dB of the mean square, measured and held-out runs together]"
    text = "Each effect refitted together with the model: those of the answer together, the others alone."
    wrong = best_wrong(found)
    right = next((r for r in found.candidates if r is not wrong), None)
    if wrong is not None and right is not None and (found.effects or found.equivalent):
        values = [unit(float(r.fitted.rmse[c])) for r in (right, wrong)]
        text += f" Error of {channel} with {words(right.spec)}: {values[0]}; with the best of the others, "
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
    if found.not_excited:
        placed = _placed(found)
        hidden = [e for e in found.not_excited if e in placed]
        elsewhere = [e for e in found.not_excited if e not in placed]
        if hidden:
            rows = [(words(e), EXCITATION[e].shown_by, e) for e in hidden]
            tables.append(Table(("effect", "what would show it", "id"), rows, "These runs could not show"))
        if elsewhere:
            model = found.final.model if found.final else "the model"
            parts.append(f"Without a place in {model} and these channels: {', '.join(words(e) for e in elsewhere)}.")
    return Section("What could not be excluded", "\n\n".join(parts), tables) if parts or tables else None


def _placed(found: Diagnosis) -> set[str]:
    """Effects that have a place in the model and the channels."""
    if found.given is None:
        return set(found.not_excited)
    kernel = found.given.problem.kernel
    allowed = possible(found.given.model, found.channels, (), [v.name for v in kernel.inputs])
    return {a.module.NAME for a in allowed}


def _next(found: Diagnosis, motion: Motion | None) -> Section | None:
    if motion is None or found.final is None:
        return None
    rivals = " and ".join(words(e) for e in found.equivalent[0]) if found.equivalent else "the rivals"
    text = (
        f"Play {motion.name} (next_experiment.csv, {motion.time[-1]:.0f} s): the predictions of {rivals} then differ "
        f"by {motion.separation:.2g} times the floor."
    )
    return Section("Next experiment", text, figures=experiment_figures(found.final.problem.kernel, motion))


def _notes(found: Diagnosis) -> Section | None:
    changes = changed_parameters(found, 6) if found.verdict in ("named", "ambiguous", "parameters") else []
    parts = [f"The refit moved {', '.join(changes)}."] if changes else []
    parts += [f"{n[0].upper()}{n[1:].rstrip('.')}." for n in (*found.notes, *found.gate.refused)]
    tables = (
        [Table(("finding",), [(n,) for n in found.gate.notes], "What the check of the data says")]
        if found.gate.notes
        else []
    )
    return Section("Notes", "\n\n".join(parts), tables) if parts or tables else None


def base_unit(found: Diagnosis, channel: str) -> str:
    """SI unit of a channel."""
    assert found.baseline is not None
    return next(v.quantity.unit for v in found.baseline.problem.kernel.outputs if v.name == channel)


def _values(r: Candidate) -> str:
    """Parameters of a candidate with their units."""
    units = {v.name: re.sub(r"\((\w+)\)", r"\1", v.quantity.unit) for v in r.fitted.problem.kernel.parameters}
    own = {n: next((u for name, u in units.items() if name.endswith(f"{r.effect}.{n}")), "") for n in r.parameters}
    return ", ".join(f"{n} = {value:.3g} {own[n]}".removesuffix(" 1").rstrip() for n, value in r.parameters.items())


def _rounded(value: float) -> float:
    return float(f"{value:.3g}") if np.isfinite(value) else value


def _percent(share: float | None) -> str:
    return "" if share is None else f"{round(100.0 * share)} %"
