"""One page on a folder of results: cards, runs, a sweep, a diagnosis."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..card import read_card
from ..logs.mapping import MAPPING_FILE
from ..logs.record import read_record
from ..logs.table import read_table
from ..logs.whole_file import check_folder
from ..models.contract import InputError
from ..report.figures import Line, time_figure
from ..report.page import Section, Table, write_report

PAGE = "index.html"
_TABLES = (".csv", ".csv.gz", ".parquet")


def write_folder_report(folder: Path) -> Path:
    """Write ``index.html`` into a folder of results and return its path; other files stay as they are.

    Raises
    ------
    InputError
        No such folder, nothing in it to report, or a result that is damaged.
    """
    if not folder.is_dir():
        raise InputError(f"{folder} -- expected a folder of results -- give the DIR or the folder of --out of a verb")
    check_folder(folder)
    sections, others = [], []
    for path in sorted(p for p in folder.iterdir() if p.is_file() and p.name != PAGE):
        section = _section(path)
        if section is None:
            others.append((path.name, path.stat().st_size))
        else:
            sections.append(section)
    if not sections:
        raise InputError(
            f"{folder} has no results -- expected a card, a run, sweep.json or diagnosis.json "
            "-- give the DIR or the folder of --out of a verb"
        )
    if others:
        table = Table(("file", "bytes"), others)
        sections.append(Section("Other files", "", (table,)))
    summary = f"{len(sections) - bool(others)} results in {folder.name}."
    return write_report(folder / PAGE, f"Results in {folder.name}", summary, sections, {"tsm-fmu": __version__})


def _section(path: Path) -> Section | None:
    """Section on a file; None for one that is no result."""
    if path.name == MAPPING_FILE:
        return None
    if path.suffix == ".toml":
        return _card(path)
    if path.name == "diagnosis.json":
        return _diagnosis(path)
    if path.name in ("sweep.json", "sweep.incomplete.json"):
        from ..cosim.sweep_report import sweep_section

        return _read(path, sweep_section)
    if path.name.endswith(_TABLES) and read_table(path).columns[0].name == "time":
        return _run(path)
    return None


def _read(path: Path, section: Any) -> Section:
    try:
        return section(json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, KeyError, TypeError, AttributeError, OSError, RecursionError) as failure:
        why = "its lists are nested too deeply" if isinstance(failure, RecursionError) else repr(failure)
        raise InputError(f"{path}: {why} -- expected the file as the verb wrote it -- run the verb again") from failure


def _card(path: Path) -> Section:
    card = read_card(path)
    made = card.provenance
    rows = [(n, p.value, p.stderr, p.unit, p.lo, p.hi, "fixed" if p.fixed else "") for n, p in card.parameters.items()]
    tables = [Table(("parameter", "value", "standard error", "unit", "lowest", "highest", ""), rows)]
    runs = [(run, name, value) for run, values in card.per_run.items() for name, value in values.items()]
    if runs:
        tables.append(Table(("run", "parameter", "value"), runs, "Values of single runs."))
    seen = [(r.name, r.role, r.sha256) for r in made.records]
    if seen:
        tables.append(Table(("record", "role", "sha256"), seen))
    text = (
        f"{'+'.join((card.model, *card.effects))}, from preset {card.preset or 'none'}; "
        f"method {made.method or 'none'}, seed {made.seed}, {made.date or 'no date'}, tsm-fmu {made.package_version}."
    )
    return Section(f"Model card {path.name}", text, tables)


def _run(path: Path) -> Section:
    record = read_record(path)
    rows = [
        (name, record.units[name], float(v.min()), float(v.max()), float(v.mean()), float(v.std()))
        for name, v in record.columns.items()
    ]
    by_unit: dict[str, list[Line]] = {}
    for name, values in record.columns.items():
        by_unit.setdefault(record.units[name], []).append(Line(name, record.time, np.asarray(values)))
    figures = [time_figure(lines, f"in {unit}", unit) for unit, lines in by_unit.items()]
    state = "The run stopped early. " if ".incomplete." in path.name else ""
    text = f"{state}{record.time.size} rows from {record.time[0]:g} to {record.time[-1]:g} s; sha256 {record.sha256}."
    table = Table(("channel", "unit", "lowest", "highest", "mean", "standard deviation"), rows)
    return Section(f"Run {path.name}", text, (table,), figures)


def _diagnosis(path: Path) -> Section:
    def section(data: Mapping[str, Any]) -> Section:
        gaps = [
            (channel, name.replace("_", " "), value, "" if "closure" in name else gap["unit"])
            for channel, gap in data["gap"].items()
            for name, value in gap.items()
            if name not in ("unit", "closure_interval") and value is not None
        ]
        text = data.get("answer") or f"Verdict {data['verdict']}: {', '.join(data['effects']) or 'no effect'}."
        return Section("Diagnosis", text, (Table(("channel", "quantity", "value", "unit"), gaps),))

    return _read(path, section)
