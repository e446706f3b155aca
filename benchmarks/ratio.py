"""How two codes are compared on a machine that others use too."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from time import perf_counter_ns
from typing import NamedTuple


class Ratio(NamedTuple):
    """One comparison: what, ours and the reference in microseconds per call, their ratio and its limit.

    ``reason`` says why the limit is missed, where that is known.
    """

    what: str
    ours_us: float
    reference_us: float
    ratio: float
    limit: float
    reason: str = ""

    @property
    def verdict(self) -> str:
        if self.ratio <= self.limit:
            return "ok"
        if not self.reason:
            return "OVER"
        more = self.ours_us - self.reference_us
        return f"OVER: {self.reason}" + (f", {more:.0f} us" if more > 0.0 else "")


def compare(
    what: str, ours: Callable[[], object], reference: Callable[[], object], calls: int, limit: float, rounds: int = 41
) -> Ratio:
    """Compare two codes that each do ``calls`` calls, by turns.

    The ratio is the median over the rounds of the ratio within a round, so that a load that lasts longer
    than a round falls on both, and a shorter one on few rounds.
    """
    ours()
    reference()
    times: list[tuple[float, float]] = []
    for n in range(rounds):
        pair = {}
        for code in (ours, reference) if n % 2 else (reference, ours):
            begin = perf_counter_ns()
            code()
            pair[code] = (perf_counter_ns() - begin) / calls / 1000.0
        times.append((pair[ours], pair[reference]))
    a, b = (median(t[i] for t in times) for i in (0, 1))
    return Ratio(what, a, b, median(x / y for x, y in times), limit)
