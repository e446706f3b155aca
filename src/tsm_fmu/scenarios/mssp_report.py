"""Report of the MSSP 2015 loop: our numbers beside the paper's and the closed forms."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..cosim.metric import CaseMetrics, Metric
from ..cosim.trajectory import Trajectory
from ..report import Line, Section, Table, loop_figure, time_figure, write_report
from . import mssp_haptic

_HEADING = ("case", "peak to peak [deg]", "mean [deg]", "std [deg]", "without motor [deg]", "paper: peak to peak [deg]")


def write_mssp_report(
    path: Path, runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]
) -> Path:
    """Write the report of `mssp_feedforward`; ``beside`` is its `comparison`."""
    sections = [_tracking(runs, metrics, beside), _tables(metrics, beside), _controller(beside["controller"])]
    haptic = mssp_haptic.section(runs)
    sections += [haptic] if haptic is not None else []
    sections += [_case(name, run) for name, run in runs.items()]
    sections += beside["ending"]
    first = next(iter(runs))
    own, error = metrics[first], metrics[first].tracked()
    summary = (
        f"Tracking error of {first.replace('_', ' ')} from {own.begin.value:g} to {own.end.value:g} s: "
        f"{error.peak_to_peak:.3f} deg peak to peak, standard deviation {error.std:.3f} deg."
    )
    return write_report(path, "Feedforward compensation (MSSP 2015)", summary, sections, {"tsm-fmu": __version__})


def _tracking(runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]) -> Section:
    rows = []
    for name in runs:
        own, paper = metrics[name].tracked(), beside["reported"].get(name, {}).get("peak_to_peak")
        ideal = beside["without_motor"][name].peak_to_peak
        rows.append((name, own.peak_to_peak, own.mean, own.std, ideal, None if paper is None else paper.value))
    text = (
        "Error x_r - x_out of the co-simulated loop. 'Without motor' is the same plant moved exactly as commanded: the "
        "difference is the tracking error of the position loop. The published plant runs backwards after a reversal "
        "(slope 2B - c < 0), so its exact inverse (law 2) asks for jumps that no motor follows; plants of equal loop "
        "width with B = 0.65 and 0.70 give the 3 deg that the paper reports for law 1."
    )
    forms = beside["closed_forms"]
    closed = Table(
        ("closed form (models of the paper)", "value [deg]"), [(name, form.value) for name, form in forms.items()]
    )
    return Section("Tracking error", text, (Table(_HEADING, rows), closed))


def _tables(metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]) -> Section:
    rows = []
    for name, paper in beside["reported"].items():
        if name not in metrics or "mean" not in paper:
            continue
        own, motion = metrics[name].tracked(), name.partition(".")[0]
        for trial, (mean, std) in enumerate(zip(paper["mean"], paper["std"], strict=True), start=1):
            rows.append((motion, trial, mean.value, std.value, own.mean, own.std))
    heading = ("motion", "trial", "paper: mean [deg]", "paper: std [deg]", "ours: mean [deg]", "ours: std [deg]")
    return Section("Tables 1 and 2 of the paper", "Law 1 on the published plant.", (Table(heading, rows),))


def _controller(pid: Mapping[str, Metric]) -> Section:
    rows = [(name, m.value, m.unit) for name, m in pid.items()]
    text = (
        "Designed with python-control on the linear motor, with the delay of half a communication step. The paper "
        "prints no gains."
    )
    return Section("Position controller", text, (Table(("quantity", "value", "unit"), rows),))


def _case(name: str, run: Trajectory) -> Section:
    def degrees(address: str) -> Any:
        return np.degrees(run.columns[address])

    figures = []
    if {"reference.y", "backlash.x_out", "error.y"} <= set(run.columns):
        position = [
            Line("x_r", run.time, degrees("reference.y"), dashed=True),
            Line("x_out", run.time, degrees("backlash.x_out")),
        ]
        figures.append(time_figure([*position, Line("x_r - x_out", run.time, degrees("error.y"))], "Motion", "deg"))
        loop = [Line("x_out over x_r", degrees("reference.y"), degrees("backlash.x_out"))]
        figures.append(loop_figure(loop, "Reference and output", "x_r [deg]", "x_out [deg]"))
    return Section(name, "", (), figures)
