"""``check``: what is in measured runs, and what they cannot show."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..checking import RunCheck, check_record
from ..checking.finding import Finding, shown
from ..logs.proposal import Proposal, propose_mapping
from ..logs.record import Record
from ..report.text import preformatted, text_table
from .models import ModelLike, resolve_model
from .runs import ReadOptions, RunLike, records_of

if TYPE_CHECKING:
    import pandas as pd

    from ..report.figures import Figure

COVERAGE = "coverage"
"""Kind of the findings on what a run cannot show."""


@dataclass(frozen=True)
class CheckResult:
    """What is in one or several runs; see `check`.

    Attributes
    ----------
    runs : tuple of RunCheck
        In the order given.
    records : tuple of Record
        The runs themselves.
    cutoff : float or None
        As it was asked for [Hz].
    """

    runs: tuple[RunCheck, ...]
    records: tuple[Record, ...]
    cutoff: float | None = None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All findings, run after run."""
        return tuple(finding for run in self.runs for finding in run.findings)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What of the options had no effect."""
        still = [run.name for run in self.runs if run.motion is None]
        if self.cutoff is None or not still:
            return ()
        return tuple(f"--cutoff {self.cutoff:g} Hz is not used: no position in {name} moves" for name in still)

    def summary(self) -> str:
        """Rate, channels, motion, findings and what cannot be shown, run after run."""
        return "\n\n".join(_summary(run) for run in self.runs)

    def to_frame(self) -> pd.DataFrame:
        """Findings, one a row: run, kind, channel, t0 [s], t1 [s], first and last row of the file, text."""
        import pandas as pd

        rows = [(run.name, f.kind, f.channel, f.t0, f.t1, *f.rows, f.text) for run in self.runs for f in run.findings]
        return pd.DataFrame(
            rows, columns=["run", "kind", "channel", "t0", "t1", "first_row", "last_row", "text"]
        )  # fmt: skip

    def figure(self, run: str | None = None) -> Figure:
        """The channels of a run over time, one below the other, with the findings shaded.

        Parameters
        ----------
        run : str, optional
            Name of the run; the first without it.
        """
        from ..report.figures import channels_figure

        number = next((k for k, one in enumerate(self.runs) if one.name == run), 0)
        checked, record = self.runs[number], self.records[number]
        marked = [(f.t0, f.t1, f.channel, f.kind) for f in checked.findings if f.kind != COVERAGE]
        return channels_figure(record.time, record.columns, record.units, checked.name, marked)

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``check``: of one run its contents, of several by name."""
        runs = {run.name: asdict(run) for run in self.runs}
        return next(iter(runs.values())) if len(runs) == 1 else {"runs": runs}

    def _repr_html_(self) -> str:
        return preformatted(self.summary()) + self.to_frame().to_html(index=False)


def check(runs: RunLike | Sequence[RunLike], *, cutoff: float | None = None, start: float | None = None,
          stop: float | None = None) -> CheckResult:  # fmt: skip
    """Look at measured runs: rate, gaps, glitches, quantisation, sign of the power, coverage. Nothing is repaired.

    Parameters
    ----------
    runs : path, Record, DataFrame, or a sequence of them
    cutoff : float, optional
        Cut-off [Hz] of the differentiator for speed and acceleration; from the data without it.
    start, stop : float, optional
        Window [s] of files and DataFrames.

    Returns
    -------
    CheckResult

    Raises
    ------
    InputError
        A run that cannot be read, or a cut-off that rate, length or gaps of a run do not allow.

    Examples
    --------
    >>> import tsm_fmu as tsm
    >>> tsm.check(tsm.sample("sine")).findings
    ()
    """
    records = records_of(runs, ReadOptions(start, stop))
    return CheckResult(tuple(check_record(record, cutoff) for record in records), tuple(records), cutoff)


def propose(run: str | os.PathLike[str], model: ModelLike) -> Proposal:
    """What the columns of a log may be for a model: a ``log.toml`` to correct, from names, units and correlations.

    Parameters
    ----------
    run : path
        Units may be missing.
    model : str, path, ModelCard, Kernel or result
        As for `identify`.

    Raises
    ------
    InputError
        A file that cannot be read, or an unknown model.
    """
    kernel = resolve_model(model).kernel
    return propose_mapping(Path(run).expanduser(), kernel.name, (*kernel.inputs, *kernel.outputs))


def _summary(result: RunCheck) -> str:
    clock = result.clock
    lines = [
        f"{result.name}: {result.samples} samples from {result.t0:g} to {result.t1:g} s at {clock.rate:.6g} Hz, "
        f"jitter {clock.jitter:.2g} s, {clock.gaps} gaps; sha256 {result.sha256[:12]}"
    ]
    rows = []
    for name, c in result.channels.items():
        steps = (f"{c.step:.6g}", f"{(c.highest - c.lowest) / c.step:.0f}") if c.step > 0.0 else ("none found", "")
        rows.append((name, c.unit, f"{c.lowest:.6g}", f"{c.highest:.6g}", *steps, f"{c.noise:.3g}"))
    if rows:
        lines += ["", text_table(("channel", "unit", "lowest", "highest", "step", "steps in range", "noise"), rows), ""]
    if m := result.motion:
        strokes = " / ".join(shown(x, m.unit) for x in m.amplitudes)
        speed, acceleration = max(map(abs, m.v)), max(map(abs, m.a))
        lines += [
            f"motion of {m.channel}: {shown(m.x[0], m.unit)} to {shown(m.x[1], m.unit)}, speed up to "
            f"{shown(speed, m.unit + '/s')}, acceleration up to {shown(acceleration, m.unit + '/s2')}"
            + (f" (cut-off {m.cutoff:.3g} Hz)" if m.cutoff else " (uneven sampling: differences)"),
            f"{m.reversals} reversals, half strokes (least / median / most) {strokes}",
            f"frequencies {', '.join(f'{f:.3g}' for f in m.frequencies) or 'none'} Hz, longest rest {m.dwell:.3g} s",
        ]
    lines += [f"power {p.effort} * d{p.motion}/dt: {p.mean:.3g} W on average" for p in result.powers]
    found = [f for f in result.findings if f.kind != COVERAGE]
    lines += [f"findings: {len(found)}" if found else "nothing wrong found"]
    lines += [f"  {f.kind}: {f.text}" for f in found]
    missing = [f for f in result.findings if f.kind == COVERAGE]
    if missing:
        lines += ["what this log cannot show", *(f"  {f.text}" for f in missing)]
    return "\n".join(lines)
