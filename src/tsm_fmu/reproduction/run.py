"""All papers in one run."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from ..models.contract import InputError
from .ame2020 import paper as ame2020
from .claims import Claim, Verdict
from .closed_loops import closed_loop_claims
from .icinco2013 import paper as icinco2013
from .iftomm2013 import paper as iftomm2013
from .mmt2015 import paper as mmt2015
from .mssp2015 import paper as mssp2015
from .published import PAPERS
from .result import PaperResult

RESULTS: Mapping[str, Callable[[], PaperResult]] = {
    "iftomm2013": iftomm2013.result,
    "icinco2013": icinco2013.result,
    "mmt2015": mmt2015.result,
    "mssp2015": mssp2015.result,
    "ame2020": ame2020.result,
}


@dataclass(frozen=True)
class Reproduction:
    """Results by paper, and how long they took [s]."""

    results: Mapping[str, PaperResult]
    closed_loops: bool
    wall_s: float

    @property
    def claims(self) -> tuple[Claim, ...]:
        return tuple(claim for result in self.results.values() for claim in result.claims)

    def counts(self, paper: str | None = None) -> dict[str, int]:
        """Number of claims by verdict, of one paper or of all."""
        found = Counter(c.verdict for c in self.claims if paper in (None, c.paper))
        return {verdict.value: found[verdict] for verdict in Verdict}


def reproduce(
    papers: Sequence[str] = (), *, closed_loops: bool = True, progress: Callable[[str], None] = lambda _: None
) -> Reproduction:
    """Compute every claim.

    Parameters
    ----------
    papers : sequence of str
        Keys of `PAPERS`; all without any.
    closed_loops : bool
        Also co-simulate the closed loops of MSSP 2015 with FMUs.
    progress : callable
        Told what is computed next.

    Raises
    ------
    InputError
        For a paper that is not one of the five.
    """
    for paper in papers:
        if paper not in PAPERS:
            raise InputError(f"paper {paper!r} -- expected one of {', '.join(PAPERS)} -- choose one")
    begin = time.perf_counter()
    results: dict[str, PaperResult] = {}
    for paper in PAPERS:
        if papers and paper not in papers:
            continue
        progress(PAPERS[paper])
        results[paper] = RESULTS[paper]()
        if paper == "mssp2015" and closed_loops:
            progress("closed loops of MSSP 2015 with FMUs")
            extra = tuple(closed_loop_claims())
            results[paper] = replace(results[paper], claims=results[paper].claims + extra)
    return Reproduction(results, closed_loops, time.perf_counter() - begin)
