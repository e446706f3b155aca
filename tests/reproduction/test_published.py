"""The table of the papers' figures and tables is complete, and each item has claims or the reason why not."""

import os
import re
from pathlib import Path

import pytest

from tsm_fmu.reproduction.numbers import REPORTED
from tsm_fmu.reproduction.published import ITEMS, PAPERS

FIGURES = {"iftomm2013": 4, "icinco2013": 7, "mmt2015": 8, "mssp2015": 13, "ame2020": 20}
TABLES = {"iftomm2013": 0, "icinco2013": 1, "mmt2015": 0, "mssp2015": 2, "ame2020": 1}
SETUPS = {("ame2020", "Fig. 4"), ("ame2020", "Fig. 12")}
"""Drawings whose claims are on numbers of the text beside them."""
TEXTS = Path(os.environ.get("TSM_FMU_PAPERS", Path(__file__).parents[3] / "shared" / "papers"))


@pytest.mark.parametrize("paper", PAPERS)
def test_every_figure_and_table_is_listed(paper):
    labels = [item.label for item in ITEMS if item.paper == paper]
    assert len(labels) == len(set(labels))
    assert [x for x in labels if x.startswith("Fig.")] == [f"Fig. {n}" for n in range(1, FIGURES[paper] + 1)]
    assert [x for x in labels if x.startswith("Table")] == [f"Table {n}" for n in range(1, TABLES[paper] + 1)]


@pytest.mark.parametrize("paper", PAPERS)
def test_the_papers_have_no_further_figures(paper):
    path = TEXTS / f"{paper}.txt"
    if not path.exists():
        pytest.skip(f"{path} is not there: the papers' texts are not part of the repository")
    body = path.read_text(encoding="utf-8", errors="replace")
    captions = {int(n) for n in re.findall(r"^\W*Fig(?:ure|\.)\s*(\d+)[.:]", body, re.MULTILINE)}
    assert captions <= set(range(1, FIGURES[paper] + 1))
    assert max(captions) == FIGURES[paper]


def test_each_item_has_claims_or_the_reason_why_it_has_none(claims):
    covered = {(claim.paper, label) for claim in claims.values() for label in claim.items}
    known = {(item.paper, item.label) for item in ITEMS}
    assert covered <= known
    for item in ITEMS:
        has = (item.paper, item.label) in covered
        assert has != bool(item.no_claim), (item.paper, item.label)


def test_figures_of_results_are_drawn(done):
    """Every numbered figure that has a claim is drawn anew, those of setups apart."""
    for paper, result in done.results.items():
        for item in ITEMS:
            if item.paper == paper and item.label.startswith("Fig.") and not item.no_claim:
                drawn = item.label in result.figures
                assert drawn or (paper, item.label) in SETUPS, (paper, item.label)
        assert set(result.figures) <= {item.label for item in ITEMS if item.paper == paper}


def test_every_printed_number_is_used(claims):
    used = {repr(claim.numbers.get("reported")) for claim in claims.values()}
    for key, reported in REPORTED.items():
        assert repr([reported.value.lo, reported.value.hi]) in used, key
