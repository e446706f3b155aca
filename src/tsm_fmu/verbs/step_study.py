"""``step-study``: what the communication step and the order of exchange cost."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..cosim.cases import present
from ..cosim.step_study import SignalStudy, order_sentence
from ..cosim.step_study import step_study as study_case
from ..models.contract import InputError
from ..report.text import preformatted, text_table
from . import TIME_LIMIT
from .systems import Settings, opened

if TYPE_CHECKING:
    import pandas as pd

    from ..report.figures import Figure

PLOTTED = 4
"""Signals in the picture of a study: those in which the order of exchange matters most."""


@dataclass(frozen=True)
class StepStudyResult:
    """A study of the communication step; see `step_study`.

    Attributes
    ----------
    case : str
    steps : tuple of float
        The steps [s], the longest first.
    signals : tuple of SignalStudy
    stop : float
        End of the runs [s].
    """

    case: str
    steps: tuple[float, ...]
    signals: tuple[SignalStudy, ...]
    stop: float

    @property
    def sentence(self) -> str:
        """Whether the order of exchange matters, in words."""
        return order_sentence({s.signal: s.share for s in self.signals}, self.steps[0], self.stop)

    def summary(self) -> str:
        """The table of differences with observed orders, and the sentence."""
        heading = ("signal", "size", "halved", "order", "Jacobi halved", "order", "Jacobi - Gauss-Seidel", "unit")
        rows = []
        for s in self.signals:
            serial, parallel = s.halved["gauss-seidel"], s.halved["jacobi"]
            rows.append((
                s.signal, f"{s.size:.5g}", f"{serial[0]:.3g}", _shown(s.order("gauss-seidel")), f"{parallel[0]:.3g}",
                _shown(s.order("jacobi")), f"{s.exchange[0]:.3g}", s.unit,
            ))  # fmt: skip
        steps = ", ".join(f"{step:g}" for step in self.steps)
        return f"{text_table(heading, rows)}\n{self.case}, steps of {steps} s. {self.sentence}"

    def to_frame(self) -> pd.DataFrame:
        """One row a signal and step: differences [unit of the signal] of both methods."""
        import pandas as pd

        rows = [
            {"signal": s.signal, "unit": s.unit, "step [s]": step, "gauss-seidel": a, "jacobi": b, "exchange": c}
            for s in self.signals
            for step, a, b, c in zip(
                self.steps, s.halved["gauss-seidel"], s.halved["jacobi"], s.exchange, strict=False
            )  # the last step has no half
        ]
        return pd.DataFrame(rows)

    def figure(self) -> Figure:
        """How far each step is from its half, in percent of a signal's size, over the step; Jacobi dashed."""
        from ..report.figures import Figure, Line
        from ..report.panel import Panel

        moving = sorted((s for s in self.signals if s.size > 0.0), key=lambda s: -s.share)[:PLOTTED]
        lines = [
            Line(f"{s.signal}, {method}", self.steps[: len(errors)], [100.0 * e / s.size for e in errors],
                 dashed=method == "jacobi", colour=k)
            for k, s in enumerate(moving) for method, errors in s.halved.items()
        ]  # fmt: skip
        title = f"{self.case}: what halving the step changes"
        panel = Panel("communication step [s]", "change of the signal [% of its size]", lines=lines, log_x=True)
        return Figure(title, (panel,))

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``step-study``."""
        return {
            "case": self.case, "steps": self.steps, "sentence": self.sentence,
            "signals": {
                s.signal: {
                    "unit": s.unit, "size": s.size, "halved": s.halved, "exchange": s.exchange,
                    "order": {method: s.order(method) for method in s.halved},
                }
                for s in self.signals
            },
        }  # fmt: skip

    def _repr_html_(self) -> str:
        return preformatted(self.summary()) + self.figure()._repr_html_()


def step_study(
    what: str | os.PathLike[str],
    *,
    halvings: int = 3,
    values: Mapping[str, object] | None = None,
    case: Sequence[str] = (),
    stop: float | None = None,
    step: float | None = None,
    loops: str | None = None,
    isolate: bool | None = None,
    time_limit: float = TIME_LIMIT,
) -> StepStudyResult:
    """Run a system with its communication step and its halves, with Gauss-Seidel and Jacobi.

    Parameters
    ----------
    what : str or Path
        Name of a scenario, or a file that ends in ``.ssp``.
    halvings : int
        How often the step is halved, 1 to 10; orders need two.
    values, case, stop, step, loops, isolate, time_limit
        As in `run`; the first case without a name.

    Returns
    -------
    StepStudyResult

    Raises
    ------
    InputError
        As in `run`.
    """
    if not 1 <= halvings <= 10:
        raise InputError(f"halvings {halvings!r} -- expected 1 to 10 -- correct it")
    settings = Settings(values or {}, case, stop, step, loops=loops, isolate=isolate, time_limit=time_limit)
    with opened(what, None, settings) as system:
        name, one = next(iter(system.cases.items()))
        signals = study_case(one, halvings, record=present(one[0], system.record), simulate=system.simulate)
    return StepStudyResult(name, tuple(one[1].step / 2**k for k in range(halvings + 1)), signals, one[1].stop)


def _shown(order: float) -> str:
    return f"{order:.2f}" if math.isfinite(order) else "-"
