"""MSSP 2015: Figs 7, 8, 10 and 12 as the paper draws them."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from ...report import Line
from ..draw import panels, plot
from ..motions import FloatArray, Motion
from .drive import FROM, backlash, compensated, numbers_of


def tracking_figure(motion: Motion) -> go.Figure:
    own, milder = numbers_of(), numbers_of(0.65)
    drive = compensated(motion.x, 1, own)
    kept = motion.time >= FROM
    t, degrees = motion.time[kept], np.degrees
    outputs = {
        "without feedforward": (motion.x, own),
        "with feedforward": (drive, own),
        "with feedforward, plant of B = 0.65": (compensated(motion.x, 1, milder), milder),
    }
    out = {name: backlash(x, p) for name, (x, p) in outputs.items()}
    reference = Line("reference", t, degrees(motion.x)[kept], dashed=True)
    return panels(
        [
            plot(
                [reference, *(Line(n, t, degrees(y)[kept]) for n, y in out.items())],
                "Output",
                "time [s]",
                "angle [deg]",
            ),
            plot([Line(n, t, degrees(motion.x - y)[kept]) for n, y in out.items()], "Error", "time [s]", "error [deg]"),
            plot([reference, Line("x_FF", t, degrees(drive)[kept])], "Control input", "time [s]", "angle [deg]"),
            plot(
                [Line(n, degrees(motion.x)[kept], degrees(y)[kept]) for n, y in out.items()],
                "Input and output",
                "reference [deg]",
                "output [deg]",
            ),
        ]
    )


def identified_figure(motion: Motion, raw: FloatArray) -> go.Figure:
    x, out = np.degrees(motion.x), np.degrees(backlash(motion.x, numbers_of()))
    kept = motion.time >= FROM
    return panels(
        [
            plot(
                [Line("x_in", motion.time, x, dashed=True), Line("x_out", motion.time, out)],
                "Displacement",
                "time [s]",
                "angle [deg]",
            ),
            plot([Line("x_out", x[kept], out[kept])], "Backlash-like hysteresis", "x_in [deg]", "x_out [deg]"),
            plot([Line("friction, raw", motion.time, raw)], "Friction", "time [s]", "F as printed"),
            plot(
                [Line("friction, raw", np.degrees(motion.v)[kept], raw[kept])],
                "Friction over velocity",
                "velocity [deg/s]",
                "F as printed",
            ),
        ]
    )
