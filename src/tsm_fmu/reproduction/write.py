"""Page (HTML), table (CSV) and everything for machines (JSON) of a reproduction."""

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
from .claims import Claim
from .page import page_html
from .published import ITEMS
from .run import Reproduction

COLUMNS = (
    "id", "paper", "item", "quantity", "unit", "printed", "ours", "verdict", "reason", "compared", "method", "assumed",
    "code",
)  # fmt: skip


def row(claim: Claim) -> dict[str, str]:
    """One claim as text, by the names in `COLUMNS`."""
    cells = (
        claim.key,
        claim.paper,
        ", ".join(claim.items),
        claim.quantity,
        claim.unit,
        claim.printed,
        claim.ours,
        claim.verdict.value,
        claim.reason,
        claim.kind.value,
        claim.method.value,
        "; ".join(map(str, claim.assumed)),
        claim.code,
    )
    return dict(zip(COLUMNS, cells, strict=True))


def as_json(done: Reproduction) -> dict[str, Any]:
    """Claims with their numbers, counts by verdict, and the items without a claim."""
    return {
        "version": __version__,
        "counts": done.counts(),
        "co_simulated": done.co_simulated,
        "claims": [{**row(c), "items": list(c.items), "numbers": dict(c.numbers)} for c in done.claims],
        "without_claim": [
            {"paper": i.paper, "item": i.label, "shows": i.shows, "reason": i.no_claim}
            for i in ITEMS
            if i.no_claim and i.paper in done.results
        ],
        "quick": done.quick,
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
    paths = {"report": out / "report.html", "csv": out / "claims.csv", "json": out / "claims.json"}
    contents = {
        "report": page_html(done),
        "csv": text.getvalue(),
        "json": json.dumps(as_json(done), indent=2) + "\n",
    }
    with _naming(out):
        out.mkdir(parents=True, exist_ok=True)
        for kind, path in paths.items():
            path.write_text(contents[kind], encoding="utf-8")
    return paths


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
