"""AME 2020: Figs 3, 10 and 13 to 20 as the paper draws them, from the loop of FMUs, errors on axes of their own."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from ...cosim.trajectory import Trajectory
from ...kernels.kernel import kernel
from ...report import Figure, Line
from ...scenarios.papers import (
    CASES,
    DEVIATION_MM,
    DIFFERENCE_MM,
    FORWARD_MM,
    NAMES,
    PRELOAD_N,
    PRESSURE_N,
    REVERSE_MM,
    SAME_BEND,
    SAME_BEND_MM,
    TENSION_N,
)
from ..draw import plot
from ..printed import value
from .compensated import PAIR, residual_figures
from .displacement import Found
from .loops import at_end, error, travel
from .printed import CALIBRATION, THEORY_FORWARD, THEORY_REVERSE
from .winding import rows_of_eq4, winding_position

Panels = tuple[Figure, ...]
TWO = tuple(PAIR.values())


def displacement_figures(f: Found) -> dict[str, Panels]:
    """Figs 13 to 20."""
    there = {c: _way(f.runs[f"best.{c}"], back=False) for c in CASES}
    back = {c: _way(f.runs[f"cycle.{c}"], back=True) for c in CASES}
    own = {c: _way(f.runs[f"cycle.{c}"], back=False) for c in TWO}
    layered = [
        Line(f"{name.removeprefix('layers.')} turns a layer", travel(run), error(run))
        for name, run in f.runs.items()
        if name.startswith("layers.")
    ]
    ends = [(f"printed (Fig. 16), {NAMES[c]}", [785.0], [FORWARD_MM[c]]) for c in CASES]
    turned = [(f"printed (Fig. 17), {NAMES[c]}", [785.0], [REVERSE_MM[c]]) for c in CASES]
    bent = [
        (f"printed (Fig. 18), {NAMES[c]}", [785.0], [v])
        for c, v in zip(SAME_BEND, SAME_BEND_MM["forward"], strict=True)
    ]
    figures: dict[str, Panels] = {
        "Fig. 13": (
            plot(_lines(own, TWO, 0), "Forward, theory", "s_in [mm]", "s_out [mm]"),
            plot(
                _lines(own, TWO, 1),
                "Error forward, theory",
                "s_in [mm]",
                "error [mm]",
                points=[
                    (
                        f"printed end {FORWARD_MM[c]:g}, theory within {THEORY_FORWARD[NAMES[c]].text}",
                        [785.0],
                        [FORWARD_MM[c]],
                    )
                    for c in TWO
                ],
            ),
        ),
        "Fig. 14": (
            plot(
                _lines(back, TWO, 0),
                "Reverse, slack as input",
                "travel back [mm]",
                "s_out travelled back [mm]",
            ),
            plot(
                _lines(back, TWO, 1),
                "Error in reverse, slack as input",
                "travel back [mm]",
                "error [mm]",
                points=[
                    (
                        f"printed {REVERSE_MM[c]:g}, theory within {THEORY_REVERSE[NAMES[c]].text}",
                        [785.0],
                        [REVERSE_MM[c]],
                    )
                    for c in TWO
                ],
            ),
        ),
        "Fig. 15": (
            plot(
                [
                    Line(
                        NAMES[c],
                        travel(f.runs[f"cycle.{c}"]),
                        travel(f.runs[f"cycle.{c}"]) - error(f.runs[f"cycle.{c}"]),
                    )
                    for c in CASES
                ],
                "There and back, slack as input",
                "s_in [mm]",
                "s_out [mm]",
            ),
        ),
        "Fig. 16": (
            plot(
                _lines(there, CASES, 1),
                f"One radius, EA {f.EA:.0f} N" + _told(f),
                "s_in [mm]",
                "error [mm]",
                points=ends,
            ),
            plot(
                [Line(NAMES[c], travel(f.runs[f"there.plain.{c}"]), error(f.runs[f"there.plain.{c}"])) for c in CASES],
                "One radius, Eqs (23), (30) alone",
                "s_in [mm]",
                "error [mm]",
                points=ends,
            ),
            plot(layered, "Radii grow by layer (ours), 0.5 kg and 180 deg", "s_in [mm]", "error [mm]", points=ends[:1]),
        ),
        "Fig. 17": (
            plot(
                _lines(back, CASES, 1),
                "After the turn, slack as input",
                "travel back [mm]",
                "error [mm]",
                points=turned,
            ),
            plot(
                [_elastic(f.runs[f"elastic.{c}"], NAMES[c]) for c in CASES],
                "After the turn, Eqs (32)-(36) alone",
                "travel back [mm]",
                "error [mm]",
            ),
        ),
        "Fig. 18": (plot(_lines(there, SAME_BEND, 1), "Two loads at 540 deg", "s_in [mm]", "error [mm]", points=bent),),
    }
    for label, case in PAIR.items():
        figures[label] = (
            plot(
                [Line("without", there[case][0], there[case][2])],
                "Forward without compensation",
                "s_in [mm]",
                "error [mm]",
                points=[(f"printed {FORWARD_MM[case]:g} (Fig. 16)", [785.0], [FORWARD_MM[case]])],
            ),
            *residual_figures(f.runs, label),
        )
    return figures


def _way(run: Trajectory, *, back: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Driver travel, follower travel, error [mm] on one way, each from its beginning."""
    s, e = travel(run), error(run)
    turn = int(np.argmax(s))
    if not back:
        return s[: turn + 1], s[: turn + 1] - e[: turn + 1], e[: turn + 1]
    moved = s[turn] - s[turn:]
    followed = (s[turn] - e[turn]) - (s[turn:] - e[turn:])
    return moved, followed, moved - followed


def _lines(ways: Mapping[str, tuple[np.ndarray, ...]], cases: tuple[str, ...], shown: int) -> list[Line]:
    return [Line(NAMES[c], ways[c][0], ways[c][1 + shown]) for c in cases]


def _elastic(run: Trajectory, name: str) -> Line:
    moved, _, e = _way(run, back=True)
    return Line(name, moved, e)


def winding_figure() -> Panels:
    """Fig. 3: Eq. (4) as printed, and as it can be meant."""
    p = kernel("LebusWinding").params("published")
    angles, ours = winding_position(np.arange(0.5, 1080.0, 1.0))
    printed_rows = [rows_of_eq4(float(a), p.P_s, math.degrees(p.alpha_s), p.L_d0) for a in angles]
    lines = [Line("continuous reading", angles, 1e3 * ours)]
    for name, pick in (("Eq. (4) as printed, highest", max), ("Eq. (4) as printed, lowest", min)):
        lines.append(Line(name, angles, [1e3 * pick(z) if z else math.nan for z in printed_rows], dashed=True))
    return (plot(lines, "Place of the tendon on the wheel", "wheel angle [deg]", "z_p [mm]"),)


def preload_figure(preloaded: Mapping[str, Trajectory]) -> Panels:
    """Fig. 10: the printed means and deviations, the spline, and what the equations give."""
    grid = np.linspace(PRELOAD_N[0], PRELOAD_N[-1], 400)
    mean, sd = np.array(DIFFERENCE_MM), np.array(DEVIATION_MM)
    gap = np.full(mean.size, np.nan)
    at = np.column_stack([PRELOAD_N, PRELOAD_N, gap]).ravel()
    bars = np.column_stack([mean - sd, mean + sd, gap]).ravel()
    lines = [
        Line("Akima spline through the means", grid, Akima1DInterpolator(PRELOAD_N, DIFFERENCE_MM)(grid)),
        Line("printed standard deviation", at, bars, dashed=True),
        Line("Eqs (23), (30), 0.5 kg, 180 deg", [float(T) for T in preloaded], [at_end(r) for r in preloaded.values()]),
    ]
    return (
        plot(
            lines,
            "Over preload",
            "preload [N]",
            "displacement difference [mm]",
            points=[("printed means", PRELOAD_N, DIFFERENCE_MM)],
        ),
    )


def calibration_figure() -> Panels:
    """Table 1 and Eq. (37)."""
    slope, intercept = np.polyfit(PRESSURE_N, TENSION_N, 1)
    ends = np.array([1.2, 2.2])
    lines = [
        Line("fitted anew", ends, slope * ends + intercept),
        Line(
            "Eq. (37)",
            ends,
            value(CALIBRATION["slope"].text) * ends + value(CALIBRATION["intercept"].text),
            dashed=True,
        ),
        Line("P = 2 F, the most that three forces balance", 2.0 * np.array([0.0, 1.1]), [0.0, 1.1], dashed=True),
    ]
    return (
        plot(lines, "Calibration", "pressure [N]", "tensile force [N]", points=[("Table 1", PRESSURE_N, TENSION_N)]),
    )


def _told(f: Found) -> str:
    parts = [", with winding strain (ours)"] * f.reading.wound + [", preload of tendon b kept"] * f.reading.kept
    return "".join(parts) or ", Eqs (23), (30)"
