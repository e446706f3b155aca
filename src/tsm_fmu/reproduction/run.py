"""All papers in one run."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module

from ..fmu.build import check_flavour
from ..models.contract import InputError
from .claims import Claim, Method
from .loops import FMUS
from .published import PAPERS
from .result import PaperResult
from .verdict import Verdict


@dataclass(frozen=True)
class Reproduction:
    """Results by paper, whether with fewer points (`reproduce`), how long they took [s], and how their FMUs ran."""

    results: Mapping[str, PaperResult]
    quick: bool
    wall_s: float
    flavour: str = "python"

    @property
    def claims(self) -> tuple[Claim, ...]:
        return tuple(claim for result in self.results.values() for claim in result.claims)

    def counts(self, paper: str | None = None) -> dict[str, int]:
        """Number of claims by verdict, of one paper or of all."""
        found = Counter(c.verdict for c in self.claims if paper in (None, c.paper))
        return {verdict.value: found[verdict] for verdict in Verdict}

    @property
    def co_simulated(self) -> int:
        """Number of claims that rest on FMUs in co-simulation."""
        return sum(c.method is Method.CO_SIMULATION for c in self.claims)


class ReproductionInterrupted(KeyboardInterrupt):
    """Ctrl-C during a reproduction; `done` holds the papers that were finished."""

    def __init__(self, done: Reproduction) -> None:
        super().__init__("interrupted")
        self.done = done


def reproduce(
    papers: Sequence[str] = (), *, quick: bool = False, flavour: str = "python",
    progress: Callable[[str], None] = lambda _: None,
) -> Reproduction:  # fmt: skip
    """Compute every claim.

    Parameters
    ----------
    papers : sequence of str
        Keys of `PAPERS`; all without any.
    quick : bool
        Fewer values of what the papers leave open, shorter fits: narrower spans, for a first look.
    flavour : str
        Of the FMUs: ``"python"`` (PythonFMU) or ``"native"`` (the same numbers in less time).
    progress : callable
        Told what is computed next.

    Raises
    ------
    InputError
        For a paper that is not one of the five, or a flavour that is not built.
    ReproductionInterrupted
        Ctrl-C.
    """
    for paper in papers:
        if paper not in PAPERS:
            raise InputError(f"paper {paper!r} -- expected one of {', '.join(PAPERS)} -- choose one")
    check_flavour(flavour)
    begin = time.perf_counter()
    results: dict[str, PaperResult] = {}
    for paper in PAPERS:
        if papers and paper not in papers:
            continue
        progress(PAPERS[paper])
        try:
            with FMUS.of(flavour):
                results[paper] = import_module(f".{paper}.paper", __package__).result(quick)
        except KeyboardInterrupt:
            raise ReproductionInterrupted(Reproduction(results, quick, time.perf_counter() - begin, flavour)) from None
    return Reproduction(results, quick, time.perf_counter() - begin, flavour)
