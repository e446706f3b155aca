"""The page of a reproduction: facts by verdict, claim by claim with code and test, figures as the papers draw them."""

from __future__ import annotations

import ast
from functools import cache
from importlib import import_module
from inspect import getsource
from pathlib import Path
from typing import Any, NamedTuple

from .. import __version__
from ..report import Figure
from ..report.embed import Plots, rendered
from ..report.page import cells
from .claims import NOTHING, Claim, Method
from .published import ITEMS, PAPERS, Item
from .result import PaperResult
from .run import Reproduction
from .verdict import Verdict

SHORT = {
    Verdict.REPRODUCED: "reproduced",
    Verdict.CONSISTENT: "consistent",
    Verdict.NOT_DETERMINED: "not determined",
    Verdict.READING_EXCLUDED: "reading excluded",
    Verdict.NOT_EXPLAINED: "not explained",
    Verdict.INTERNAL_ERROR: "internal error",
}
MEANING = {
    Verdict.REPRODUCED: "what is printed follows from the paper's equations, nothing left open",
    Verdict.CONSISTENT: "every admissible value of what is open gives it, or one set meets more numbers than it has "
    "values",
    Verdict.NOT_DETERMINED: "it hangs on something that the paper does not print",
    Verdict.READING_EXCLUDED: "one reading, ours, of an ambiguous print fails",
    Verdict.NOT_EXPLAINED: "a measured number that the equations give with no admissible value of what is open",
    Verdict.INTERNAL_ERROR: "the paper's own equations or numbers contradict each other",
}


def page_html(done: Reproduction) -> str:
    """The whole page as one file that needs no network."""
    plots = Plots()
    proof = _proof(done)
    return rendered(
        "reproduction.html",
        proof=[plots.place(plot) for plot in proof.plots()] if proof else [],
        papers=[
            {
                "key": paper,
                "short": short(paper),
                "title": PAPERS[paper],
                "claims": [{**_row(c), "figure": _drawn_as(c, result)} for c in result.claims],
                "shown": [_item(item, result, plots) for item in ITEMS if item.paper == paper and not item.no_claim],
                "silent": [i for i in ITEMS if i.paper == paper and i.no_claim],
            }
            for paper, result in done.results.items()
        ],
        verdicts=[{"text": SHORT[v], "slug": slug(v), "meaning": MEANING[v]} for v in Verdict],
        counts={paper: done.counts(paper) for paper in done.results},
        total=done.counts(),
        values={SHORT[v]: v.value for v in Verdict},
        claims=len(done.claims),
        co_simulated=done.co_simulated,
        headline=_headline(done),
        quick=done.quick,
        version=__version__,
        wall_s=f"{done.wall_s:.0f}",
        scripts=plots.scripts(),
    )


def short(paper: str) -> str:
    """Name of a paper in a column."""
    return PAPERS[paper].partition(":")[0]


def slug(verdict: Verdict) -> str:
    """Name of a verdict in the style sheet and the filter."""
    return verdict.name.lower().replace("_", "-")


def _headline(done: Reproduction) -> str:
    """The main row of MSSP 2015, which the page opens with."""
    for claim in done.claims:
        if claim.key == "mssp2015.together":
            reason = f"{claim.reason[0].upper()}{claim.reason[1:]}"
            return f"MSSP 2015, 10.5 -> 3 and 12.3 -> 4 deg: {SHORT[claim.verdict]}. {reason}."
    return ""


def _proof(done: Reproduction) -> Figure | None:
    """The tracking of MSSP 2015, which the headline is about; without that paper the first figure there is."""
    order = sorted(done.results.items(), key=lambda item: item[0] != "mssp2015")
    return next((figure for _, result in order for figures in result.figures.values() for figure in figures), None)


def _row(claim: Claim) -> dict[str, Any]:
    unit = "" if claim.unit in ("", "1") else f" [{claim.unit}]"
    return {
        "key": claim.key,
        "id": claim.key.replace(".", "-"),
        "item": claim.items[0],
        "more_items": ", ".join(claim.items[1:]),
        "quantity": claim.quantity + unit,
        "printed": _lines(claim.printed),
        "ours": _lines(claim.ours),
        "verdict": SHORT[claim.verdict],
        "slug": slug(claim.verdict),
        "reason": claim.reason,
        "kind": claim.kind.value,
        "method": claim.method.value,
        "fmu": claim.method is Method.CO_SIMULATION,
        "assumed": [str(a) for a in claim.assumed],
        "code": claim.code,
        "source": source(claim.code),
        "place": place(claim.code),
        "tests": checked_by(claim.key),
    }


def _drawn_as(claim: Claim, result: PaperResult) -> str:
    """Place on the page of the item that it is shown with; nothing if that has no figure or table."""
    label = claim.items[0]
    return _item_id(claim.paper, label) if label in result.figures or label in result.tables else ""


def _item_id(paper: str, label: str) -> str:
    return f"{paper}-{label}".replace(" ", "").replace(".", "")


def _lines(text: str) -> list[str]:
    """Several values one below the other; a sentence of the paper stays whole."""
    if text == NOTHING:
        return []
    return [text] if "'" in text else text.split("; ")


@cache
def source(code: str) -> str:
    """Text of the function that computes a claim.

    Raises
    ------
    ValueError
        ``code`` names none.
    """
    module, _, name = code.partition(":")
    text = getsource(import_module(module))
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef) and node.name == name:
            return "\n".join(text.splitlines()[node.lineno - 1 : node.end_lineno])
    raise ValueError(f"code {code!r} -- expected module:function")


def place(code: str) -> str:
    """File and line of the function that computes a claim, from the folder of the package on."""
    module, _, name = code.partition(":")
    found = import_module(module)
    for node in ast.parse(getsource(found)).body:
        if isinstance(node, ast.FunctionDef) and node.name == name:
            return f"src/{module.replace('.', '/')}.py:{node.lineno}"
    raise ValueError(f"code {code!r} -- expected module:function")


HELD = "tests/reproduction/test_claims.py", "test_every_verdict_follows_from_its_numbers"
"""The test that every row has."""


def checked_by(key: str) -> list[dict[str, str]]:
    """Tests that a row has: file, name and text of those that name it, then the one of every row.

    The text is there if the package runs from its repository, whose tests are not part of an installation.
    """
    own = [test for test in _tests() if key in test.keys or test[:2] == HELD]
    if not own:
        return [{"file": HELD[0], "name": HELD[1], "text": ""}]
    return [{"file": t.file, "name": t.name, "text": t.text} for t in own]


class _Test(NamedTuple):
    file: str
    name: str
    keys: frozenset[str]
    text: str


@cache
def _tests() -> tuple[_Test, ...]:
    root = Path(__file__).parents[3]
    found = []
    for path in sorted((root / "tests" / "reproduction").glob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                keys = {n.value for n in ast.walk(node) if isinstance(n, ast.Constant) and isinstance(n.value, str)}
                body = "\n".join(text.splitlines()[node.lineno - 1 : node.end_lineno])
                found.append(_Test(path.relative_to(root).as_posix(), node.name, frozenset(keys), body))
    # the tests that name a row come first
    return tuple(sorted(found, key=lambda test: (test.file, test.name) == HELD))


def _item(item: Item, result: PaperResult, plots: Plots) -> dict[str, Any]:
    figures = result.figures.get(item.label, ())
    table = result.tables.get(item.label)
    rows = [c for c in result.claims if item.label in c.items]
    return {
        "label": item.label,
        "id": _item_id(item.paper, item.label),
        "shows": item.shows,
        "text": result.texts.get(item.label, ""),
        "table": cells(table) if table else None,
        "figures": [plots.place(plot) for figure in figures for plot in figure.plots()],
        "claims": [
            {"key": c.key, "id": c.key.replace(".", "-"), "verdict": SHORT[c.verdict], "slug": slug(c.verdict)}
            for c in rows
        ],
    }
