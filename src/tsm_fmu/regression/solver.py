"""What every way to solve a regression problem has in common: the `Solver` protocol, its result and its progress."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from ..kernels.arrays import FloatArray
from .problem import Problem


@dataclass(frozen=True)
class Solution:
    """Where a search ended, or where another one begins.

    Attributes
    ----------
    table : ndarray, shape (runs, parameters)
        Values found.
    linear : frozenset of str
        Fields in which the channels are jointly affine; empty where that was not asked.
    constrained : bool
        A bound or a joint condition of the model holds the fit: nothing shared is eliminated any more.
    """

    table: FloatArray
    linear: frozenset[str] = frozenset()
    constrained: bool = False


@dataclass(frozen=True)
class Progress:
    """How far a search is.

    Attributes
    ----------
    phase : str
        What is being done.
    number, phases : int
        Which phase of how many.
    simulations : int
        Simulations of one run so far.
    error : float
        Weighted RMS error of the best point of this phase; infinite before the first one.
    """

    phase: str
    number: int
    phases: int
    simulations: int
    error: float


Report = Callable[[Progress], None]
"""Called with the progress after each point."""


class SearchLog:
    """Counts the simulations of a search and keeps the best point, so that an interruption loses nothing.

    Parameters
    ----------
    report : callable, optional
        Told the progress.

    Attributes
    ----------
    best : ndarray, shape (runs, parameters), or None
        Values with the lowest weighted error so far, in the phase that had one last.
    error : float
        Its weighted RMS residual.
    simulations : int
        Simulations of one run.
    """

    def __init__(self, report: Report | None = None) -> None:
        self.report = report
        self.best: FloatArray | None = None
        self.error = math.inf
        self.simulations = 0
        self._phase, self._number, self._phases = "fit", 0, 1

    def plan(self, phases: int) -> None:
        """Say how many phases will follow."""
        self._number, self._phases = 0, phases

    def begin(self, phase: str) -> None:
        """Begin a phase: its errors are not those of the one before, so its first point is the best until then."""
        self._phase, self._number, self.error = phase, self._number + 1, math.inf
        self._phases = max(self._phases, self._number)

    def rename(self, phase: str) -> None:
        """Say more of what the phase does."""
        self._phase = phase
        self.report_progress()

    def simulated(self, count: int) -> None:
        """Count simulations of one run."""
        self.simulations += count

    def offer(self, table: FloatArray, error: float) -> None:
        """Keep a point if it is the best of its phase, and report."""
        if error < self.error:
            self.best, self.error = table.copy(), error
        self.report_progress()

    def report_progress(self) -> None:
        """Report the progress."""
        if self.report:
            self.report(Progress(self._phase, self._number, self._phases, self.simulations, self.error))


class Solver(Protocol):
    """A way to minimise the weighted residuals of a problem."""

    def __call__(self, problem: Problem, log: SearchLog, start: Solution | None = None) -> Solution:
        """Search, from a solution if one is given, and else from the start values of the problem and others.

        Deterministic. Every point that may be the answer is offered to ``log``.
        """
        ...
