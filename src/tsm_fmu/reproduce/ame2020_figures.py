"""AME 2020: figures as the paper draws them, and the table behind Figs 16 and 17."""

from __future__ import annotations

import math

import numpy as np
import plotly.graph_objects as go
from scipy.interpolate import Akima1DInterpolator

from ..kernel import kernel
from ..report import Line, Table
from .ame2020_drive import (
    NAMES,
    WEIGHT,
    cycle,
    forward_error,
    lost_motion,
    parameters,
    profile_integral,
    stiffness_band,
    tension_at_driver,
)
from .ame2020_winding import rows_of_eq4, winding_position
from .draw import panels, plot
from .numbers import (
    CASES,
    DEVIATION_MM,
    DIFFERENCE_MM,
    FORWARD_MM,
    PRELOAD_N,
    PRESSURE_N,
    REPORTED,
    REVERSE_MM,
    SAME_BEND,
    TENSION_N,
)


def audit_table() -> Table:
    """The numbers behind Figs 16 and 17, models and reported ones side by side."""
    low, high = stiffness_band()
    rows = []
    for case in CASES:
        row: list[object] = [NAMES[case], tension_at_driver(case), 1e3 * profile_integral(case), FORWARD_MM[case]]
        row += [f"{forward_error(case, EA=low)[-1]:.3f} / {forward_error(case, EA=high)[-1]:.3f}"]
        row += [
            f"{forward_error(case, EA=low, winding_strain=1)[-1]:.3f} / "
            f"{forward_error(case, EA=high, winding_strain=1)[-1]:.3f}"
        ]
        row += [low * forward_error(case, EA=low)[-1] / FORWARD_MM[case], REVERSE_MM[case]]
        for sides in (True, False):
            ends = [lost_motion(case, changes_sides=sides, slack=0.0, EA=EA) for EA in (low, high)]
            row += [f"{ends[0]:.2f} / {ends[1]:.2f}"]
        rows.append(row)
    heading = ["case", "T_a0 [N]", "I [mm]", "forward reported [mm]", "path strain", "+ winding strain"]
    heading += ["EA needed [N]", "reverse reported [mm]", "elastic, weight changes sides", "elastic, weight hangs"]
    return Table(heading, rows, f"Computed pairs are for EA = {low:.0f} and {high:.0f} N, the fibre's range.")


def transmission_figures() -> dict[str, go.Figure]:
    """Figs 15, 16 and 17 as the paper draws them, with the slack of each case as input."""
    forward, layered, back, whole = [], [], [], []
    for case in CASES:
        name = NAMES[case]
        s = np.linspace(0.0, 785.0, 120)
        forward.append(Line(name, s, forward_error(case, rows=120, winding_strain=1)))
        layered.append(Line(name, s, forward_error(case, rows=120, winding_strain=1, layers=1)))
        s_in, s_out = cycle(case, changes_sides=True, winding_strain=1)
        whole.append(Line(name, 1e3 * s_in, 1e3 * s_out))
        turned = np.argmax(s_in)
        travelled = 1e3 * (s_in[turned] - s_in[turned:])
        back.append(Line(name, travelled, travelled - 1e3 * (s_out[turned] - s_out[turned:])))
    ends = [
        Line("reported (Fig. 16)", [785.0] * 2, [min(FORWARD_MM.values()), max(FORWARD_MM.values())], dashed=True),
    ]
    return {
        "Fig. 15": panels([plot(whole, "One cycle, slack as input", "s_in [mm]", "s_out [mm]")], columns=1),
        "Fig. 16": panels(
            [
                plot([*forward, *ends], "One radius, as in the paper", "s_in [mm]", "error [mm]"),
                plot([*layered, *ends], "Radii grow by layer (ours)", "s_in [mm]", "error [mm]"),
            ]
        ),
        "Fig. 17": panels([plot(back, "After the turn, slack as input", "travel back [mm]", "error [mm]")], columns=1),
        "Fig. 18": panels([_same_bend_figure()], columns=1),
    }


def _same_bend_figure() -> go.Figure:
    s = np.linspace(0.0, 785.0, 60)
    lines = [Line(f"{WEIGHT[c] / 9.81:g} kg", s, forward_error(c, rows=60, winding_strain=1)) for c in SAME_BEND]
    low = parameters(SAME_BEND[0])
    return plot(lines, f"540 deg, EA = {low.EA:.0f} N, with winding strain", "s_in [mm]", "error [mm]")


def winding_figure() -> go.Figure:
    p = kernel("LebusWinding").params("published")
    angles, ours = winding_position(np.arange(0.5, 1080.0, 1.0))
    printed_rows = [rows_of_eq4(float(a), p.P_s, math.degrees(p.alpha_s), p.L_d0) for a in angles]
    lines = [Line("continuous reading", angles, 1e3 * ours)]
    for name, pick in (("Eq. (4) as printed, highest", max), ("Eq. (4) as printed, lowest", min)):
        lines.append(Line(name, angles, [1e3 * pick(z) if z else math.nan for z in printed_rows], dashed=True))
    return panels([plot(lines, "Place of the tendon on the wheel", "wheel angle [deg]", "z_p [mm]")], columns=1)


def preload_figure() -> go.Figure:
    grid = np.linspace(PRELOAD_N[0], PRELOAD_N[-1], 400)
    mean, sd = np.array(DIFFERENCE_MM), np.array(DEVIATION_MM)
    lines = [
        Line("Akima spline", grid, Akima1DInterpolator(PRELOAD_N, DIFFERENCE_MM)(grid)),
        *(
            Line(f"{load:g} N", [load] * 2, [m - s, m + s], dashed=True)
            for load, m, s in zip(PRELOAD_N, mean, sd, strict=True)
        ),
    ]
    return panels([plot(lines, "Mean and deviation", "preload [N]", "displacement difference [mm]")], columns=1)


def calibration_figure() -> go.Figure:
    slope, intercept = np.polyfit(PRESSURE_N, TENSION_N, 1)
    ends = np.array([1.2, 2.2])
    lines = [
        Line("Table 1", PRESSURE_N, TENSION_N, dashed=True),
        Line("fitted anew", ends, slope * ends + intercept),
        Line("Eq. (37)", ends, REPORTED["ame2020.slope"].value.lo * ends + REPORTED["ame2020.intercept"].value.lo),
    ]
    return panels([plot(lines, "Calibration of the preload", "pressure [N]", "tensile force [N]")], columns=1)
