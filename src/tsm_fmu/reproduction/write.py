"""Report (HTML), table (CSV) and everything for machines (JSON) of a reproduction."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .. import __version__
from ..models.contract import InputError
from ..report import Section, Table, write_report
from .claims import Claim, Verdict
from .published import ITEMS, PAPERS, Item
from .result import PaperResult
from .run import Reproduction

COLUMNS = ("id", "paper", "item", "quantity", "unit", "reported", "ours", "verdict", "reason", "rule")


def row(claim: Claim) -> dict[str, str]:
    """One claim as text, by the names in `COLUMNS`."""
    cells = (
        claim.key,
        claim.paper,
        ", ".join(claim.items),
        claim.quantity,
        claim.unit,
        claim.reported,
        claim.ours,
        claim.verdict.value,
        claim.reason,
        claim.rule,
    )
    return dict(zip(COLUMNS, cells, strict=True))


def as_json(done: Reproduction) -> dict[str, Any]:
    """Claims with their numbers, counts by verdict, and the items without a claim."""
    return {
        "version": __version__,
        "counts": done.counts(),
        "claims": [{**row(c), "items": list(c.items), "numbers": dict(c.numbers)} for c in done.claims],
        "without_claim": [
            {"paper": i.paper, "item": i.label, "shows": i.shows, "reason": i.no_claim}
            for i in ITEMS
            if i.no_claim and i.paper in done.results
        ],
        "closed_loops": done.closed_loops,
        "wall_s": done.wall_s,
    }


def write_reproduction(out: Path, done: Reproduction) -> dict[str, Path]:
    """Write ``report.html``, ``claims.csv`` and ``claims.json`` into a folder; return their paths by kind.

    Raises
    ------
    InputError
        If the folder or a file cannot be written.
    """
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for claim in done.claims:
        table.writerow(row(claim).values())
    paths = {"csv": out / "claims.csv", "json": out / "claims.json"}
    contents = {"csv": text.getvalue(), "json": json.dumps(as_json(done), indent=2) + "\n"}
    with _naming(out):
        out.mkdir(parents=True, exist_ok=True)
        for kind, path in paths.items():
            path.write_text(contents[kind], encoding="utf-8")
    report = write_report(
        out / "report.html",
        "The five papers, figure by figure",
        _summary(done),
        [_overview(done), *(section for paper in done.results for section in _sections(paper, done.results[paper]))],
        {
            "tsm-fmu": __version__,
            "closed loops": "co-simulated with FMUs" if done.closed_loops else "left out (--no-loops)",
            "computed in": f"{done.wall_s:.1f} s",
            "measurements": "none of the papers' raw data is public; every 'ours' was computed in this run",
        },
    )
    return {"report": report, **paths}


def make_folder(out: Path) -> None:
    """Make the folder before the work begins.

    Raises
    ------
    InputError
        If it is a file or cannot be made.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file -- expected a folder -- choose another")
    with _naming(out):
        out.mkdir(parents=True, exist_ok=True)


@contextmanager
def _naming(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as failure:
        raise InputError(f"--out {out} -- could not be written ({failure.strerror}) -- choose another folder") from None


def _summary(done: Reproduction) -> str:
    counts = ", ".join(f"{n} {verdict}" for verdict, n in done.counts().items())
    return f"{len(done.claims)} claims of {len(done.results)} papers, each computed anew: {counts}."


def _overview(done: Reproduction) -> Section:
    heading = ["verdict", *map(_short, done.results), "all"]
    rows: list[list[Any]] = [
        [verdict.value, *(done.counts(paper)[verdict] for paper in done.results), done.counts()[verdict]]
        for verdict in Verdict
    ]
    everything = [[_short(c.paper), c.items[0], _quantity(c), c.reported, c.ours, c.verdict.value] for c in done.claims]
    return Section(
        "Verdicts",
        "A number is reproduced where the computed value is within the stated accuracy of the printed one, and "
        "consistent where a computed or printed range meets it. It is not determined by the paper where nothing is "
        "printed, where the comparison needs unpublished data, or where what is left open would allow nearly any "
        "number. It contradicts the paper's own equations where these cannot give it.\n\n"
        "A statement is tested in every reading that the print allows: it is reproduced if it holds in all of them, "
        "not determined if in some, and contradicts the equations if in none. The rule and the tolerance of each claim "
        "stand in claims.csv.",
        [
            Table(heading, rows),
            Table(
                ["paper", "item", "quantity", "reported", "ours", "verdict"],
                everything,
                "All claims; reasons and figures follow paper by paper.",
            ),
        ],
    )


def _sections(paper: str, result: PaperResult) -> list[Section]:
    items = [item for item in ITEMS if item.paper == paper]
    shown = [_item_section(item, result) for item in items if not item.no_claim]
    silent = [[item.label, item.shows, item.no_claim] for item in items if item.no_claim]
    rest = Section(f"{_short(paper)}: figures without a claim", "", [Table(["item", "shows", "why"], silent)])
    return [*shown, rest] if silent else shown


def _item_section(item: Item, result: PaperResult) -> Section:
    claims = [claim for claim in result.claims if claim.items[0] == item.label]
    elsewhere = [c for c in result.claims if item.label in c.items[1:]]
    text = result.texts.get(item.label, "")
    if elsewhere:
        places = ", ".join(dict.fromkeys(c.items[0] for c in elsewhere))
        text = f"{text}\n\nMore on this item under {places}.".strip()
    heading = ["quantity", "reported", "ours", "verdict", "reason"]
    rows = [[_quantity(c), c.reported, c.ours, c.verdict.value, c.reason] for c in claims]
    tables = [Table(heading, rows)] if rows else []
    tables += [result.tables[item.label]] if item.label in result.tables else []
    figures = [result.figures[item.label]] if item.label in result.figures else []
    return Section(f"{_short(item.paper)} {item.label}: {item.shows}", text, tables, figures)


def _quantity(claim: Claim) -> str:
    return claim.quantity if claim.unit in ("", "1") else f"{claim.quantity} [{claim.unit}]"


def _short(paper: str) -> str:
    return PAPERS[paper].partition(":")[0]
