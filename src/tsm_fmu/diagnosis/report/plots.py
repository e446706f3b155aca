"""Figures of a diagnosis: residual over its leading coordinates, runs before and after, the motion to play next."""

from __future__ import annotations

import plotly.graph_objects as go

from ...kernels.kernel import Kernel
from ...logs.display import display
from ...report import Band, Line, Section, band_figure, loop_figure, time_figure
from ..choice.next_experiment import Motion
from ..fits.refit import Fitted
from ..residual.formula import Hint
from ..runs.thinning import motion_channel
from ..workflow import Diagnosis

MOST_RUNS = 3


def dependence_figures(hint: Hint) -> list[go.Figure]:
    """Mean residual over each leading coordinate."""
    figures = []
    for name in dict.fromkeys(d.coordinate for d in hint.dependences):
        curves = [d for d in hint.dependences if d.coordinate == name]
        size = max(float(abs(d.mean).max()) for d in curves)
        y, x = display(hint.unit, size), display(curves[0].unit, max(float(abs(d.at).max()) for d in curves))
        bands = [
            Band(
                d.direction and f"moving {d.direction}",
                d.at * x.factor,
                *(v * y.factor for v in (d.mean, d.low, d.high)),
            )
            for d in curves
        ]
        over = f"{name} [{x.unit}]".removesuffix(" [1]")
        figures.append(band_figure(bands, f"Mean residual of {hint.channel}, 90 % interval", over, f"[{y.unit}]"))
    return figures


def run_sections(found: Diagnosis) -> list[Section]:
    """Loops and time histories of the first runs, before and after."""
    given, base, final = found.given, found.baseline, found.final
    if given is None or base is None or final is None:
        return []
    stages: dict[str, Fitted] = {"as given": given, "refitted": base, "after": final}
    if final is base or final is given:
        del stages["after"]
    full = {name: stage.at(found.runs) for name, stage in stages.items()}
    variables = {v.name: v for v in (*base.problem.kernel.inputs, *base.problem.kernel.outputs)}
    motion = motion_channel(base.problem.kernel)
    drawn = found.runs[:MOST_RUNS]
    sections = []
    for k, run in enumerate(drawn):
        figures = []
        for c, channel in enumerate(found.channels):
            unit = display(variables[channel].quantity.unit, float(run.targets[:, c].std()))
            y = {n: (run.targets[:, c] - f.residuals[k][:, c]) * unit.factor for n, f in full.items()}
            sides = {"measured": run.targets[:, c] * unit.factor, **y}
            if motion:
                x = run.inputs[:, [v.name for v in base.problem.kernel.inputs].index(motion)]
                along = display(variables[motion].quantity.unit, float(abs(x).max()))
                x = x * along.factor
                loop = [Line(n, x, v, n == "measured") for n, v in sides.items()]
                figures.append(
                    loop_figure(
                        loop, f"{channel} over {motion}", f"{motion} [{along.unit}]", f"{channel} [{unit.unit}]"
                    )
                )
            time = [Line(n, run.time, v, n == "measured") for n, v in sides.items()]
            figures.append(time_figure(time, channel, f"[{unit.unit}]"))
            small = display(variables[channel].quantity.unit, float(given.rmse[c]))
            left = [
                Line(n, run.time, f.residuals[k][:, c] * small.factor, colour=i)
                for i, (n, f) in enumerate(full.items(), 1)
            ]
            figures.append(time_figure(left, f"{channel}: measured minus simulated", f"[{small.unit}]"))
        rest = f"{len(drawn)} of {len(found.runs)} runs are drawn." if k == 0 and len(found.runs) > len(drawn) else ""
        sections.append(Section(f"Run {run.name}", rest, figures=figures))
    return sections


def experiment_figures(kernel: Kernel, motion: Motion) -> list[go.Figure]:
    """The inputs to play over time; those that stand still are left out."""
    figures = []
    for j, variable in enumerate(kernel.inputs):
        values = motion.inputs[:, j]
        if values.max() > values.min():
            unit = display(variable.quantity.unit, float(abs(values).max()))
            line = Line(variable.name, motion.time, values * unit.factor)
            figures.append(time_figure([line], variable.name, f"[{unit.unit}]"))
    return figures
