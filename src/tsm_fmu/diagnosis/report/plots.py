"""Figures of a diagnosis: residual over its leading coordinates, runs before and after, the motion to play next."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...kernels.arrays import FloatArray
from ...logs.display import display
from ...report import Band, Figure, Line, Section, band_figure, loop_figure, time_figure
from ..evidence import NextMotion, ResidualShape
from ..result import Diagnosis

MOST_RUNS = 3


def dependence_figures(shape: ResidualShape) -> list[Figure]:
    """Mean residual over each leading coordinate."""
    figures = []
    for name in dict.fromkeys(d.coordinate for d in shape.dependences):
        curves = [d for d in shape.dependences if d.coordinate == name]
        size = max(float(abs(d.mean).max()) for d in curves)
        y, x = display(shape.unit, size), display(curves[0].unit, max(float(abs(d.at).max()) for d in curves))
        bands = [
            Band(
                d.direction and f"moving {d.direction}",
                d.at * x.factor,
                d.mean * y.factor,
                d.low * y.factor,
                d.high * y.factor,
            )
            for d in curves
        ]
        over = f"{name} [{x.unit}]".removesuffix(" [1]")
        figures.append(band_figure(bands, f"Mean residual of {shape.channel}, 90 % interval", over, f"[{y.unit}]"))
    return figures


def run_sections(found: Diagnosis) -> list[Section]:
    """Loops and time histories of the first runs, before and after."""
    if found.final is None:
        return []
    names = {"given": "as given", "refitted": "refitted", "final": "after"}
    if found.final in (found.given, found.refitted):
        del names["final"]
    return [_run_section(found, k, names) for k in range(min(MOST_RUNS, len(found.runs)))]


def _run_section(found: Diagnosis, k: int, names: Mapping[str, str]) -> Section:
    run, figures = found.runs[k], []
    for c, channel in enumerate(found.channels):
        gap = found.gap[channel]
        measured = run.measured[:, c]
        unit = display(gap.unit, float(measured.std()))
        simulated = {name: run.simulated[stage][:, c] for stage, name in names.items()}
        sides = {"measured": measured * unit.factor, **{n: y * unit.factor for n, y in simulated.items()}}
        if run.motion is not None:
            speed = "/s" if found.motion == "v" else ""
            along = display(found.motion_unit + speed, float(abs(run.motion).max()))
            x, line = run.motion * along.factor, straight_line(run.motion, measured)
            loops, title, shown = sides, f"{channel} over {found.motion}", unit
            if line is not None:
                shown = display(gap.unit, float((measured - line).std()))
                loops = {n: y * (shown.factor / unit.factor) - line * shown.factor for n, y in sides.items()}
                title += ", less the measurement's straight line"
            loop = [Line(n, x, y, n == "measured") for n, y in loops.items()]
            figures.append(loop_figure(loop, title, f"{found.motion} [{along.unit}]", f"{channel} [{shown.unit}]"))
        time = [Line(n, run.time, y, n == "measured") for n, y in sides.items()]
        figures.append(time_figure(time, channel, f"[{unit.unit}]"))
        small = display(gap.unit, gap.before)
        errors = [
            Line(n, run.time, (measured - y) * small.factor, colour=i) for i, (n, y) in enumerate(simulated.items(), 1)
        ]
        figures.append(time_figure(errors, f"{channel}: measured minus simulated", f"[{small.unit}]"))
    plotted = min(MOST_RUNS, len(found.runs))
    remark = f"{plotted} of {len(found.runs)} runs are drawn." if k == 0 and len(found.runs) > plotted else ""
    return Section(f"Run {run.record.name}", remark, figures=figures)


def straight_line(x: FloatArray, y: FloatArray) -> FloatArray | None:
    """The least-squares line where it hides the loop: where it is more than what it leaves."""
    slope, level = np.polyfit(x, y, 1) if np.ptp(x) > 0.0 else (0.0, float(y.mean()))
    line = slope * x + level
    return line if np.var(line) > np.var(y - line) else None


def motion_figures(motion: NextMotion) -> list[Figure]:
    """The inputs to play over time; those that stand still are left out."""
    figures = []
    for name, values in motion.columns.items():
        if values.max() > values.min():
            unit = display(motion.units[name], float(abs(values).max()))
            figures.append(time_figure([Line(name, motion.time, values * unit.factor)], name, f"[{unit.unit}]"))
    return figures
