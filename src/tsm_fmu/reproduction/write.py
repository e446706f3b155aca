"""Page (HTML), table (CSV) and everything for machines (JSON) of a reproduction."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

from .. import __version__
from ..logs.whole_file import remove_earlier, write_whole
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
        "flavour": done.flavour,
        "wall_s": done.wall_s,
    }


def write_reproduction(out: Path, done: Reproduction, *, complete: bool = True) -> dict[str, Path]:
    """Write ``report.html``, ``claims.csv`` and ``claims.json`` into a folder; return their paths by kind.

    Of a reproduction that was interrupted the names are ``report.incomplete.html`` and so on; a complete one removes
    those.

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
    mark = "" if complete else ".incomplete"
    names = {"report": ("report", "html"), "csv": ("claims", "csv"), "json": ("claims", "json")}
    paths = {kind: out / f"{stem}{mark}.{ending}" for kind, (stem, ending) in names.items()}
    earlier = [f"{stem}{m}.{ending}" for stem, ending in names.values() for m in {mark, ".incomplete"}]
    remove_earlier(out, earlier)
    write_whole(paths["csv"], text.getvalue())
    write_whole(paths["json"], json.dumps(as_json(done), indent=2) + "\n")
    write_whole(paths["report"], page_html(done))  # last: its plots take seconds, a place that refuses is known before
    return paths
