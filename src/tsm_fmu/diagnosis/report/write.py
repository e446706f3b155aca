"""A diagnosis as files: diagnosis.json, card.toml, the FMU replayed against the runs, report.html, the next motion."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...card import CardParameter, ModelCard, Provenance, RecordUsed, utc_now, write_card
from ...cosim.replay import replay
from ...fmu.build import build_fmu
from ...logs.plain_json import finite
from ...logs.record import Record
from ...models.contract import InputError
from ...regression.problem import FloatArray
from ..choice.next_experiment import Motion, next_experiment, write_experiment
from ..choice.summary import Candidate
from ..fits.refit import Fitted, rms
from ..residual.formula import hints_of
from ..workflow import Diagnosis
from .sentence import answer

REPLAYED = 60_000
"""Samples replayed through the FMU at most; whole runs, one at least."""
RESAMPLES = 500


@dataclass(frozen=True)
class Gap:
    """RMSE of one channel in its unit; None where there is nothing to compare.

    ``closure`` counts from the refitted baseline where effects were added, else from the model as given; on held-out
    runs if there are any. ``floor_least`` is the part of the floor that is noise whatever the missing law is, and
    ``closure_least`` the closure counted above it: the effects close at least that.
    """

    unit: str
    before: float
    after: float
    holdout_before: float | None
    holdout_after: float | None
    floor: float
    floor_least: float
    closure: float | None
    closure_least: float | None
    closure_interval: tuple[float, float] | None
    refitted: float
    holdout_refitted: float | None
    fmu: float | None


def write_diagnosis(
    out: Path, found: Diagnosis, measured: Sequence[Record], holdout: Sequence[Record] = (), *, preset: str = "",
    reference: Sequence[Record] = (), seed: int = 0,
) -> dict[str, Any]:  # fmt: skip
    """Write everything into a folder and return the object of ``diagnosis.json``.

    Parameters
    ----------
    out : Path
        Folder; it is made.
    found : Diagnosis
    measured, holdout, reference : sequence of Record
    preset : str
        That the model started from.
    seed : int

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    from .page import write_diagnosis_report  # plotly takes a second to import

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise InputError(f"--out {out} -- expected a folder ({failure.strerror}) -- choose another") from failure
    card = fmu = experiment = motion = None
    seen = hints_of(found, seed)
    gap: dict[str, Gap] = {}
    if found.final is not None:
        card = out / "card.toml"
        write_card(card, diagnosis_card(found, measured, holdout, preset, seed))
        fmu = _built(out, found)
        gap = gaps(found, _replayed(fmu, found, measured))
        motion = _motion(found)
        if motion is not None:
            experiment = write_experiment(out / "next_experiment.csv", motion, found.final.problem.kernel)
    data = {
        "verdict": found.verdict,
        "answer": answer(found, gap, seen),
        "effects": found.ids,
        "places": list(found.effects),
        "equivalent": [list(ids) for ids in found.equivalent],
        "not_excited": list(found.not_excited),
        "candidates": [_candidate(c) for c in found.candidates],
        "where": [asdict(p) for p in found.where],
        "compared_from": {run.name: float(run.time[0]) for run in (*found.runs, *found.holdout)},
        "gap": {channel: asdict(g) for channel, g in gap.items()},
        "card": str(card) if card else None,
        "fmu": str(fmu) if fmu else None,
        "report": str(out / "report.html"),
        "next_experiment": str(experiment) if experiment else None,
        "formulas": {h.channel: asdict(h.formula) for h in seen if h.formula.text},
        "notes": [*found.gate.refused, *found.notes, *found.gate.notes],
    }
    roles = {"measured": measured, "held out": holdout, "reference": reference}
    records = {f"{role} {r.name}": f"sha256 {r.sha256}" for role, runs in roles.items() for r in runs}
    provenance = {"preset": preset or "none", "seed": seed, **records}
    write_diagnosis_report(out / "report.html", data["answer"], found, gap, seen, motion, provenance)
    (out / "diagnosis.json").write_text(json.dumps(finite(data), indent=2) + "\n", encoding="utf-8")
    return data


def gaps(found: Diagnosis, replayed: FloatArray | None = None) -> dict[str, Gap]:
    """Gap of each channel before and after, at the full sampling of the runs."""
    given, base, final = found.given, found.baseline, found.final
    if given is None or base is None or final is None:
        return {}
    before, refitted, after = (f.at(found.runs).residuals for f in (given, base, final))
    judged = [f.judged_on(found.holdout) if found.holdout else f.at(found.runs).residuals for f in (given, base, final)]
    held = [rms(residuals) for residuals in judged] if found.holdout else None
    start = judged[1 if found.effects else 0]  # what effects close is counted from the refit, which is not theirs
    units = {v.name: v.quantity.unit for v in final.problem.kernel.outputs}
    result = {}
    for c, channel in enumerate(found.channels):
        floor, least = float(found.floor[c]), float(found.floor_least[c])
        one, two = ([r[:, c] for r in runs] for runs in (start, judged[2]))
        result[channel] = Gap(
            unit=units[channel],
            before=float(rms(before)[c]),
            after=float(rms(after)[c]),
            holdout_before=float(held[0][c]) if held else None,
            holdout_after=float(held[2][c]) if held else None,
            floor=floor,
            floor_least=least,
            closure=_closure(one, two, floor),
            closure_least=_closure(one, two, least),
            closure_interval=_interval(one, two, floor),
            refitted=float(rms(refitted)[c]),
            holdout_refitted=float(held[1][c]) if held else None,
            fmu=None if replayed is None else float(replayed[c]),
        )
    return result


def diagnosis_card(
    found: Diagnosis, measured: Sequence[Record], holdout: Sequence[Record], preset: str, seed: int
) -> ModelCard:
    """The model of the answer as a card; standard errors are left to an identification."""
    final = found.final
    assert final is not None
    problem, values = final.problem, final.values
    parameters = {}
    for variable in problem.kernel.parameters:
        p = problem.parameters[variable.field]
        value = min(max(values[variable.name], p.min), p.max)
        parameters[variable.name] = CardParameter(value, variable.quantity.unit, None, p.min, p.max, not p.vary)
    used = [RecordUsed(r.name, r.sha256) for r in measured if r.sha256]
    used += [RecordUsed(r.name, r.sha256, "holdout") for r in holdout if r.sha256]
    columns = {problem.declared[f].name: problem.fields.index(f) for f in problem.own}
    own = {
        run.name: {name: float(final.table[k, j]) for name, j in columns.items()} for k, run in enumerate(problem.runs)
    }
    provenance = Provenance(tuple(used), seed=seed, date=utc_now(), method="diagnose")
    return ModelCard(final.model, preset, final.effects, parameters, own if columns else {}, provenance)


def _built(out: Path, found: Diagnosis) -> Path:
    assert found.final is not None
    problem = found.final.problem
    start = {v.name: v.kind(value) for v, value in zip(problem.kernel.parameters, _mean(found.final), strict=True)}
    return build_fmu(problem.kernel, out / f"{problem.kernel.name}.fmu", start_values=start)


def _mean(final: Fitted) -> FloatArray:
    return final.table.mean(axis=0)


def _replayed(fmu: Path, found: Diagnosis, measured: Sequence[Record]) -> FloatArray | None:
    """RMSE of the FMU over the first runs, each with its own parameters, and the check that it is the workflow's."""
    assert found.final is not None
    problem, rows, own, simulated = found.final.problem, 0, [], []
    full = found.final.at(found.runs)
    for k, record in enumerate(measured):
        if k and rows + record.time.size > REPLAYED:
            break
        rows += record.time.size
        row = problem.params(found.final.table[k])
        values = {v.name: x for v, x in zip(problem.kernel.parameters, row, strict=True)}
        columns = replay(fmu, record, parameters=values).columns
        run = found.runs[k]
        from_there = np.column_stack([columns[c] for c in found.channels])[run.lead_time.size :]
        simulated.append(run.targets - from_there)
        own.append(full.residuals[k])
    there, here = rms(simulated), rms(own)
    if not np.allclose(there, here, rtol=1e-6, atol=1e-12):
        raise RuntimeError(f"the FMU's gap {there} is not the workflow's {here}")
    return there


def _motion(found: Diagnosis) -> Motion | None:
    if not found.equivalent:
        return None
    wanted = set(found.equivalent[0])
    first: dict[str, Fitted] = {}
    for c in found.candidates:
        if c.effect in wanted:
            first.setdefault(c.effect, c.fitted)
    return next_experiment(list(first.values()), found.floor)


def _candidate(c: Candidate) -> dict[str, Any]:
    return {
        "effect": c.effect,
        "place": c.spec,
        "score": c.score,
        "gap_closure_measured": c.closure_measured,
        "gap_closure_holdout": c.closure_holdout,
        "parameters": c.parameters,
    }


def _closure(before: Sequence[FloatArray], after: Sequence[FloatArray], floor: float) -> float | None:
    one, two = (float(np.mean(np.concatenate(r) ** 2)) for r in (before, after))
    return None if one <= floor**2 else 1.0 - (two - floor**2) / (one - floor**2)


def _interval(before: Sequence[FloatArray], after: Sequence[FloatArray], floor: float) -> tuple[float, float] | None:
    """90 % bootstrap interval over runs; None with fewer than three."""
    if len(before) < 3 or _closure(before, after, floor) is None:
        return None
    rng = np.random.default_rng(0)
    sums = np.array([[np.sum(a**2), np.sum(b**2), a.size] for a, b in zip(before, after, strict=True)])
    drawn = sums[rng.integers(0, len(before), (RESAMPLES, len(before)))].sum(axis=1)
    gap, left = drawn[:, 0] / drawn[:, 2] - floor**2, drawn[:, 1] / drawn[:, 2] - floor**2
    shares = 1.0 - left[gap > 0.0] / gap[gap > 0.0]
    low, high = np.quantile(shares, [0.05, 0.95])
    return float(low), float(high)
