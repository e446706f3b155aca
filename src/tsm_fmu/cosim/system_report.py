"""Report of an SSP run: statistics and time histories of every signal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from .. import __version__
from ..logs.display import display
from ..report import Line, Section, Table, time_figure, write_report
from .energy import BOND_HEADING, bond_rows
from .metric import CaseMetrics, spread
from .order import schedule
from .ssp import Case
from .system import check_system
from .trajectory import Trajectory

COMMANDING = ("reference", "compensator", "controller", "stepper")
"""Components of our scenarios whose outputs are commands."""


def write_system_report(
    path: Path,
    name: str,
    cases: Mapping[str, Case],
    runs: Mapping[str, Trajectory],
    metrics: Mapping[str, CaseMetrics],
    order: str,
) -> Path:
    """Write one section for each case, and one on the coupling; return the path."""
    sections = [_section(case, cases[case], run) for case, run in runs.items()]
    sections += coupling_section(metrics, order)
    summary = f"{len(runs)} {'system' if len(runs) == 1 else 'systems'} co-simulated."
    return write_report(path, name, summary, sections, {"tsm-fmu": __version__})


def commands_section(runs: Mapping[str, Trajectory]) -> list[Section]:
    """What the plants of a scenario are told, by unit; a command that several cases share is drawn once."""
    lines: dict[str, dict[tuple[str, bytes], Line]] = {}
    for case, run in runs.items():
        for column, values in run.columns.items():
            if column.partition(".")[0] in COMMANDING:
                show = display(run.units[column])
                drawn = Line(f"{column}, {case}", run.time, show.factor * np.asarray(values, float))
                lines.setdefault(show.unit, {}).setdefault((column, np.asarray(values).tobytes()), drawn)
    figures = [time_figure(list(own.values()), f"Commands in {unit}", unit) for unit, own in lines.items()]
    text = "What references, compensators, controllers and steppers give; of cases that share a command the first."
    return [Section("Commands", text, (), figures)] if figures else []


def coupling_section(metrics: Mapping[str, CaseMetrics], order: str) -> list[Section]:
    """What the coupling costs: the order of exchange, and the energy at each power bond; none if unknown."""
    rows = bond_rows(metrics)
    text = order
    if rows:
        text += (
            " At a power bond one component gives a motion and another a force or torque. Each works with what it was "
            "handed, held over a step or late; what one gives and the other does not take is lost in the coupling, "
            "or made by it where it is negative. It falls with the step."
        )
    tables = (Table(BOND_HEADING, rows),) if rows else ()
    return [Section("What the coupling costs", text.strip(), tables)] if text else []


def _section(name: str, case: Case, run: Trajectory) -> Section:
    system, experiment = case
    plan = schedule(check_system(system), experiment.loops)
    late = [f"{'.'.join(link.source)} to {'.'.join(link.target)}" for link in plan.delayed]
    window = experiment.window(run.time)
    text = (
        f"From {experiment.start:g} to {experiment.stop:g} s, communication step {experiment.step:g} s, "
        f"{experiment.method}, in the order {', '.join(plan.components)}. "
        f"One step late: {', '.join(late) or 'nothing'}. Statistics from {run.time[window][0]:g} s on."
    )
    found = [(column, spread(v[window], run.units[column])) for column, v in run.columns.items()]
    rows = [(column, s.unit, s.mean, s.std, s.peak_to_peak) for column, s in found]
    by_unit: dict[str, list[Line]] = {}
    for column, values in run.columns.items():
        by_unit.setdefault(run.units[column], []).append(Line(column, run.time, values))
    figures = [time_figure(lines, f"in {unit}", unit) for unit, lines in by_unit.items()]
    table = Table(("signal", "unit", "mean", "standard deviation", "peak to peak"), rows)
    return Section(name, text, (table,), figures)
