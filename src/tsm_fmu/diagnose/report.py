"""The report of a diagnosis: the answer in one sentence, then the evidence."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..check.finding import shown
from ..report import Line, Section, Table, loop_figure, time_figure, write_report
from .experiment import Motion
from .locate import Place
from .study import motion_channel
from .workflow import Diagnosis

if TYPE_CHECKING:
    from .result import Gap

MOST_RUNS = 3
MOST_PLACES = 12


def answer(found: Diagnosis, gap: Mapping[str, Gap]) -> str:
    """The answer in one or two sentences."""
    worst = max(gap.items(), key=lambda g: g[1].before / max(g[1].floor, 1e-300), default=None)
    numbers = ""
    if worst is not None:
        channel, g = worst
        held = g.holdout_before is not None and g.holdout_after is not None
        before, after = (g.holdout_before, g.holdout_after) if held else (g.before, g.after)
        numbers = (
            f" {'Held-out error' if held else 'Error'} of {channel}: {shown(before or 0.0, g.unit)} -> "
            f"{shown(after or 0.0, g.unit)}, floor {shown(g.floor, g.unit)}."
        )
    first = next((p for p in found.where if p.significant), None)
    where = f"{_place(first)} " if first else ""
    best = found.candidates[0] if found.candidates else None
    if found.verdict == "named":
        names = " and ".join(e.replace("_", " ") for e in found.effects)
        share = (
            f" {100 * g.closure:.0f} % of what a refit leaves closes."
            if worst and (g := worst[1]).closure is not None
            else ""
        )
        return f"{where}What is missing: {names}.{share}{numbers}"
    if found.verdict == "ambiguous":
        names = " or ".join(e.replace("_", " ") for e in found.equivalent[0])
        return f"{where}These runs cannot tell {names} apart; play the next experiment.{numbers}"
    if found.verdict == "parameters":
        return f"Nothing is missing: other parameter values close the gap.{numbers}"
    if found.verdict == "none":
        return f"Nothing is missing: no gap above the floor.{numbers}"
    if found.verdict == "not_excited":
        return f"No answer from these runs: {'; '.join(found.gate.refused) or 'no effect for it shows'}."
    tried = f" The nearest, {best.effect.replace('_', ' ')}, does not pass." if best else ""
    return f"{where}Something is missing that no effect of the library explains well enough.{tried}{numbers}"


def write_diagnosis_report(
    path: Path, found: Diagnosis, gap: Mapping[str, Gap], motion: Motion | None, records: Mapping[str, str]
) -> Path:
    """Write the report; see `tsm_fmu.report.write_report`."""
    sections = [s for s in (_gaps(gap), _where(found), _candidates(found), *_plots(found), _rest(found, motion)) if s]
    provenance: dict[str, Any] = {"tsm-fmu": __version__, **records}
    return write_report(path, "Diagnosis", answer(found, gap), sections, provenance)


def _place(p: Place) -> str:
    low, high = (shown(v, p.unit) for v in p.range)
    inside = f"at {p.coordinate} from {low} to {high}"
    if p.coordinate.startswith("distance") and p.range[0] < 0.1 * p.range[1]:
        inside = f"within {high} after a reversal"
    return (
        f"{100 * p.share_of_gap:.0f} % of the disagreement of {p.channel} lies {inside} "
        f"({100 * p.share_of_samples:.0f} % of the samples)."
    )


def _gaps(gap: Mapping[str, Gap]) -> Section | None:
    if not gap:
        return None
    heading = (
        "channel", "unit", "as given", "refitted", "after", "held-out before", "held-out after", "floor", "closure",
        "90 % over runs", "FMU",
    )  # fmt: skip
    rows = [
        (c, g.unit, g.before, g.refitted, g.after, g.holdout_before, g.holdout_after, g.floor, g.closure,
         "" if g.closure_interval is None else "{:.2f} to {:.2f}".format(*g.closure_interval), g.fmu)
        for c, g in gap.items()
    ]  # fmt: skip
    text = (
        "RMSE. The floor is what the runs do not repeat or no coordinate predicts; closure is of what lies above it, "
        "from the refit on where effects were added. Experimental: thresholds and scores are not calibrated yet."
    )
    return Section("Gap", text, [Table(heading, rows)])


def _where(found: Diagnosis) -> Section | None:
    if not found.where:
        return None
    heading = ("channel", "over", "from", "to", "share of gap", "share of samples", "explained", "p", "significant")
    rows = [
        (p.channel, p.coordinate, shown(p.range[0], p.unit), shown(p.range[1], p.unit), p.share_of_gap,
         p.share_of_samples, p.explained, p.p, "yes" if p.significant else "no")
        for p in found.where[:MOST_PLACES]
    ]  # fmt: skip
    text = " ".join(_place(p) for p in found.where if p.significant and p.explained > 0.1) or (
        "The disagreement does not depend on any coordinate beyond chance."
    )
    caption = "p from surrogates with the residual's spectrum; significant after Benjamini-Hochberg at 5 %"
    return Section("Where", text, [Table(heading, rows, caption)])


def _candidates(found: Diagnosis) -> Section | None:
    if not found.candidates:
        return None
    rows = [
        (c.spec, c.score, c.closure_measured, c.closure_holdout, values)
        for c in found.candidates
        for values in [", ".join(f"{n} {v:.3g}" for n, v in c.parameters.items())]
    ]
    heading = ("effect", "score", "closes, measured", "closes, held out", "parameters")
    caption = "score: twice the log likelihood gained with effective samples, less the cost of the parameters"
    return Section("Candidates", "Each refitted together with the baseline.", [Table(heading, rows, caption)])


def _plots(found: Diagnosis) -> list[Section]:
    given, base, final = found.given, found.baseline, found.final
    if given is None or base is None or final is None:
        return []
    full = {"as given": given.at(found.runs), "refitted": base.at(found.runs), "after": final.at(found.runs)}
    if final is base or final is given:
        del full["after"]
    names = [v.name for v in base.problem.kernel.inputs]
    motion = motion_channel(base.problem.kernel)
    units = {v.name: v.quantity.unit for v in (*base.problem.kernel.inputs, *base.problem.kernel.outputs)}
    sections = []
    for k, run in enumerate(found.runs[:MOST_RUNS]):
        figures = []
        for c, channel in enumerate(found.channels):
            y = {n: run.targets[:, c] - f.residuals[k][:, c] for n, f in full.items()}
            lines = [Line("measured", run.time, run.targets[:, c], dashed=True)]
            lines += [Line(n, run.time, v) for n, v in y.items()]
            if motion in names:
                x = run.inputs[:, names.index(motion)]
                loops = [Line("measured", x, run.targets[:, c], dashed=True), *(Line(n, x, v) for n, v in y.items())]
                x_label = f"{motion} [{units[motion]}]"
                figures.append(loop_figure(loops, f"{channel} over {motion}", x_label, f"[{units[channel]}]"))
            figures.append(time_figure(lines, channel, f"[{units[channel]}]"))
            left = [Line(n, run.time, f.residuals[k][:, c]) for n, f in full.items()]
            figures.append(time_figure(left, f"measured minus simulated, {channel}", f"[{units[channel]}]"))
        sections.append(Section(f"Run {run.name}", "", figures=figures))
    return sections


def _rest(found: Diagnosis, motion: Motion | None) -> Section:
    parts = []
    if found.equivalent:
        parts.append("Not told apart: " + "; ".join(", ".join(ids) for ids in found.equivalent) + ".")
    if found.not_excited:
        parts.append("These runs could not show: " + ", ".join(found.not_excited) + ".")
    if motion is not None:
        parts.append(f"Next experiment: {motion.name}; the rivals then differ by {motion.separation:.2g} floors.")
    parts += list(found.notes) + list(found.gate.refused) + list(found.gate.notes)
    return Section("What could not be excluded", "\n\n".join(parts) or "Nothing to add.")
