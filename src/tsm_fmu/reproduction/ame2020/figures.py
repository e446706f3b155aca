"""AME 2020: figures as the paper draws them, and the table behind Figs 16 and 17."""

from __future__ import annotations

import math

import numpy as np
import plotly.graph_objects as go
from scipy.interpolate import Akima1DInterpolator

from ...kernels.kernel import kernel
from ...report import Line, Table
from ...scenarios.papers import (
    CASES,
    DEVIATION_MM,
    DIFFERENCE_MM,
    FORWARD_MM,
    MAXIMUM_FORWARD_MM,
    NAMES,
    PRELOAD_N,
    PRESSURE_N,
    REVERSE_MM,
    SAME_BEND,
    TENSION_N,
    WEIGHT_N,
)
from ..claims import Span
from ..draw import panels, plot
from ..motions import FloatArray
from ..numbers import REPORTED
from .drive import (
    compensated_error,
    forward_error,
    lost_motion,
    parameters,
    profile_integral,
    stiffness_band,
    tension_at_driver,
    there_back_there,
)
from .winding import rows_of_eq4, winding_position


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
    heading = ["case", "T_a0 [N]", "I [mm]", "forward", "path", "+ winding", "EA needed [N]", "reverse"]
    heading += ["changes sides", "hangs"]
    caption = (
        "forward and reverse: reported [mm]. path, + winding: forward error [mm] by the strain of the path, and with "
        "that which the wheels wind. EA needed: for the path alone. changes sides, hangs: elastic reverse error [mm], "
        f"the weight changing tendons or staying on one. Pairs: EA = {low:.0f} and {high:.0f} N, the fibre's range."
    )
    return Table(heading, rows, caption)


def transmission_figures() -> dict[str, go.Figure]:
    """Figs 13 to 20 as the paper draws them, with the slack of each case as input."""
    s = np.linspace(0.0, 785.0, 120)
    forward = [Line(NAMES[c], s, forward_error(c, rows=120, winding_strain=1)) for c in CASES]
    layered = [Line(NAMES[c], s, forward_error(c, rows=120, winding_strain=1, layers=1)) for c in CASES]
    cycles = {c: tuple(1e3 * x for x in there_back_there(c)) for c in CASES}
    turn = cycles[CASES[0]][0].size // 3
    back, there, again, whole = [], [], [], []
    for case, (s_in, s_out) in cycles.items():
        leg = slice(turn, 2 * turn + 1)
        travelled = s_in[turn] - s_in[leg]
        back.append(Line(NAMES[case], travelled, travelled - (s_out[turn] - s_out[leg])))
        whole.append(Line(NAMES[case], s_in, s_out))
        if case in MAXIMUM_FORWARD_MM:
            there.append(Line(NAMES[case], s_in[:turn], s_out[:turn]))
            again.append(Line(NAMES[case], s_in[leg], s_out[leg]))
    ends = [Line("reported (Fig. 16)", [785.0] * 2, Span.of(*FORWARD_MM.values()).ends, dashed=True)]
    return {
        "Fig. 13": panels([plot(there, "Forward", "s_in [mm]", "s_out [mm]")], columns=1),
        "Fig. 14": panels([plot(again, "Reverse, slack as input", "s_in [mm]", "s_out [mm]")], columns=1),
        "Fig. 15": panels([plot(whole, "There, back and there again", "s_in [mm]", "s_out [mm]")], columns=1),
        "Fig. 16": panels(
            [
                plot([*forward, *ends], "One radius, as in the paper", "s_in [mm]", "error [mm]"),
                plot([*layered, *ends], "Radii grow by layer (ours)", "s_in [mm]", "error [mm]"),
            ]
        ),
        "Fig. 17": panels([plot(back, "After the turn, slack as input", "travel back [mm]", "error [mm]")], columns=1),
        "Fig. 18": panels([_same_bend_figure()], columns=1),
        "Fig. 19": _compensation_figure("m05_180", cycles["m05_180"]),
        "Fig. 20": _compensation_figure("m10_540", cycles["m10_540"]),
    }


def _compensation_figure(case: str, without: tuple[FloatArray, ...]) -> go.Figure:
    s_in, s_out = (x[: 2 * (x.size // 3) + 1] for x in without)
    errors = []
    for name, values in {"without winding strain": {"winding_strain": 0.0}, "with all parameters": {}}.items():
        wanted, error = compensated_error(case, rows=80, **values)
        errors.append(Line(f"compensator {name}", _way(1e3 * wanted), error))
    return panels(
        [
            plot(
                [Line("without compensation", _way(s_in), s_in - s_out)],
                "Before",
                "way there and back [mm]",
                "error [mm]",
            ),
            plot(errors, "After", "way there and back [mm]", "error [mm]"),
        ]
    )


def _way(position: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position)))])


def _same_bend_figure() -> go.Figure:
    s = np.linspace(0.0, 785.0, 60)
    lines = [Line(f"{WEIGHT_N[c] / 9.81:g} kg", s, forward_error(c, rows=60, winding_strain=1)) for c in SAME_BEND]
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
    gap = np.full(mean.size, np.nan)
    at = np.column_stack([PRELOAD_N, PRELOAD_N, gap]).ravel()
    bars = np.column_stack([mean - sd, mean + sd, gap]).ravel()
    lines = [
        Line("Akima spline", grid, Akima1DInterpolator(PRELOAD_N, DIFFERENCE_MM)(grid)),
        Line("mean and standard deviation", at, bars, dashed=True),
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
