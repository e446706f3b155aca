"""A diagnosis as files: diagnosis.json, card.toml, the FMU checked against the runs, report.html, the next motion."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ...card import write_card
from ...logs.plain_json import finite
from ...logs.record import write_record
from ...logs.whole_file import remove_earlier, write_whole
from ..evidence import Candidate
from ..improved import ImprovedModel
from ..result import Diagnosis
from .export import export_answer
from .page import write_diagnosis_report


def write_diagnosis(out: Path, found: Diagnosis) -> dict[str, Any]:
    """Write everything into a folder and return the object of ``diagnosis.json``.

    Parameters
    ----------
    out : Path
        Folder; it is made.
    found : Diagnosis

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    remove_earlier(
        out,
        ("diagnosis.json", "card.toml", "card.incomplete.toml", "next_experiment.csv", "report.html", "improved.toml"),
    )
    card = fmu = experiment = None
    if found.model is not None:
        card = out / "card.toml"
        write_card(card, found.model)
        fmu, errors = export_answer(out, found)
        found = replace(found, gap={channel: replace(g, fmu=errors[channel]) for channel, g in found.gap.items()})
    if found.next_motion is not None:
        experiment = out / "next_experiment.csv"
        write_record(experiment, found.next_motion.time, found.next_motion.columns, found.next_motion.units)
    improved = None
    if found.improved is not None:
        improved = out / "improved.toml"
        write_card(improved, found.improved.model)
    report = write_diagnosis_report(out / "report.html", found)
    paths = {"card": card, "fmu": fmu, "report": report, "next_experiment": experiment, "improved_card": improved}
    data = as_json(found, {name: str(path) if path else None for name, path in paths.items()})
    write_whole(out / "diagnosis.json", json.dumps(finite(data), indent=2) + "\n")
    return data


def as_json(found: Diagnosis, paths: Mapping[str, str | None]) -> dict[str, Any]:
    """The object of ``diagnosis.json``; its keys are a public contract."""
    return {
        "verdict": found.verdict,
        "answer": found.answer,
        "effects": found.ids,
        "places": list(found.effects),
        "equivalent": [list(ids) for ids in found.equivalent],
        "also_in_model": list(found.also_in_model),
        "family": list(found.family),
        "family_evidence": [asdict(e) for e in found.family_evidence],
        "tones": {channel: asdict(tone) for channel, tone in found.tones.items()},
        "limits": {channel: asdict(limit) for channel, limit in found.limits.items()},
        "wanders": {channel: asdict(wander) for channel, wander in found.wanders.items()},
        "not_excited": list(found.not_excited),
        "not_applicable": dict(found.not_applicable),
        "candidates": [_candidate(c) for c in found.candidates],
        "steps": [asdict(s) for s in found.steps],
        "unlike_references": [asdict(c) for c in found.unlike_references],
        "where": [asdict(p) for p in found.where],
        "compared_from": dict(found.compared_from),
        "gap": {channel: asdict(g) for channel, g in found.gap.items()},
        **paths,
        "formulas": {s.channel: asdict(s.formula) for s in found.shapes if s.formula.text},
        "improved": _improved(found.improved),
        "notes": [*found.gate.refused, *found.notes, *found.gate.notes],
    }


def _improved(found: ImprovedModel | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "text": found.text,
        "effects": list(found.effects),
        "not_named": list(found.not_named),
        "steps": [asdict(s) for s in found.steps],
        "zeros": [asdict(z) for z in found.zeros],
    }


def _candidate(c: Candidate) -> dict[str, Any]:
    return {
        "effect": c.effect,
        "place": c.spec,
        "score": c.score,
        "gap_closure_measured": c.closure_measured,
        "gap_closure_holdout": c.closure_holdout,
        "parameters": dict(c.parameters),
        "testable": c.testable,
    }
