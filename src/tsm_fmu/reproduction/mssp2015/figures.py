"""MSSP 2015: Figs 7 to 13 as the paper draws them, from FMUs, with what is printed drawn in."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...cosim.trajectory import Trajectory
from ...report import Figure, Line
from ...scenarios import mssp_haptic
from ..draw import half_width, plot
from ..loops import co_simulate
from .completion import EXPERIMENT, SHORT, Completion, cases, published
from .friction import PLANTS
from .imposed import EXPERIMENT as IMPOSED
from .printed import FRICTION_ERROR, RESIDUAL, WIDTH

SHOWN_S = 15.0
"""Length of the time axes."""


def traces(best: Completion, quick: bool) -> dict[str, Trajectory]:
    """Loops to draw: ``set.motion.variant``."""
    experiment = SHORT if quick else EXPERIMENT
    jobs = {f"best.{case}": job for case, job in cases(best, experiment).items()}
    jobs |= {f"published.{case}": job for case, job in cases(published(), experiment).items() if "law_1" in case}
    return co_simulate(jobs, ["reference.y", "backlash.x_out", "error.y", "compensator.x_ff"])


def tracking_figures(runs: Mapping[str, Trajectory], motion: str) -> tuple[Figure, ...]:
    """Errors on axes of their own, output, control input, and output over input."""
    own = {name: runs[f"{name}.{motion}.{variant}"] for name, variant in (("best", "law_1"), ("published", "law_1"))}
    without = runs[f"best.{motion}.uncompensated"]
    t, shown = _shown(without)
    reference = Line("reference", t, _deg(without, "reference.y", shown), dashed=True)
    outputs = [
        Line("without feedforward", t, _deg(without, "backlash.x_out", shown)),
        Line("with feedforward", t, _deg(own["best"], "backlash.x_out", shown)),
    ]
    residuals = [
        Line("with feedforward, best set", t, _deg(own["best"], "error.y", shown), colour=1),
        Line("with feedforward, published plant", t, _deg(own["published"], "error.y", shown), colour=3),
    ]
    x = _deg(without, "reference.y", shown)
    return (
        plot(
            [
                Line("without feedforward", t, _deg(without, "error.y", shown), colour=0),
                Line("with feedforward", t, _deg(own["best"], "error.y", shown), colour=1),
            ],
            f"Tracking error, {motion.replace('_', '-')} motion (best set)",
            "time [s]",
            "error [deg]",
            bands=[*half_width(WIDTH[motion]), *half_width(RESIDUAL[motion])],
        ),
        plot(
            residuals,
            "Error with feedforward",
            "time [s]",
            "error [deg]",
            bands=half_width(RESIDUAL[motion]),
        ),
        plot([reference, *outputs], "Output (best set)", "time [s]", "angle [deg]"),
        plot(
            [reference, Line("x_FF", t, _deg(own["best"], "compensator.x_ff", shown))],
            "Control input",
            "time [s]",
            "angle [deg]",
        ),
        plot(
            [Line("without feedforward", x, outputs[0].y), Line("with feedforward", x, outputs[1].y)],
            "Input and output",
            "reference [deg]",
            "output [deg]",
        ),
    )


def identified_figures(run: Trajectory) -> tuple[Figure, ...]:
    """The identified models on the imposed motion."""
    window = IMPOSED.window(run.time)
    x, out = (np.degrees(run.columns[n][window]) for n in ("reference.y", "backlash.x_out"))
    v, force, t = np.degrees(run.columns["reference.dy"][window]), run.columns["friction.F"][window], run.time[window]
    return (
        plot([Line("x_in", t, x, dashed=True), Line("x_out", t, out)], "Displacement", "time [s]", "angle [deg]"),
        plot([Line("x_out", x, out)], "Backlash-like hysteresis", "x_in [deg]", "x_out [deg]"),
        plot([Line("friction", t, force)], "Friction", "time [s]", "F as printed"),
        plot([Line("friction", v, force)], "Friction over velocity", "velocity [deg/s]", "F as printed"),
    )


def friction_figures(runs: Mapping[str, Trajectory], motion: str) -> tuple[Figure, ...]:
    """Friction and its estimate in the haptic loop, the error on an axis of its own, and the distal torque."""
    own = {plant: runs[f"{motion}.{plant}"] for plant in PLANTS if f"{motion}.{plant}" in runs}
    first = next(iter(own.values()))
    t, shown = first.time[first.time >= 10.0], first.time >= 10.0
    errors = [Line(f"plant: {p}", t, mssp_haptic.friction_error(run, "haptic")[shown]) for p, run in own.items()]
    bands = half_width(FRICTION_ERROR) if motion == "periodic" else ()
    lines = {"plant": "friction.F", "estimate": "haptic.F"}
    speed = np.degrees(first.columns["motor.omega"][shown])
    torques = {"load": "load.tau", "estimate": "haptic.tau_out", "drive": "friction.tau_drive"}
    return (
        plot(
            [Line(n, t, first.columns[c][shown]) for n, c in lines.items()], "Friction (N.mm read)", "time [s]", "F [N]"
        ),
        plot(errors, "Error of the estimate", "time [s]", "error [N]", bands=bands),
        plot(
            [Line(n, speed, first.columns[c][shown]) for n, c in lines.items()], "over velocity", "v [deg/s]", "F [N]"
        ),
        plot([Line(n, t, first.columns[c][shown]) for n, c in torques.items()], "Torques", "time [s]", "torque [N m]"),
    )


def _shown(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    begin = EXPERIMENT.evaluate_from
    shown = (run.time >= begin) & (run.time <= begin + SHOWN_S)
    return run.time[shown], shown


def _deg(run: Trajectory, column: str, shown: np.ndarray) -> np.ndarray:
    return np.degrees(run.columns[column][shown])
