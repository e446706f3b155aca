"""AME 2020: strength, stiffness and preload of the tendon from the printed fibre data."""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from ...cosim.trajectory import Trajectory
from ...scenarios.papers import DEVIATION_MM, DIFFERENCE_MM, PRELOAD_N, PRESSURE_N, TENSION_N
from ..claims import Claim, Method, Open, number_claim, statement_claim, together_claim
from ..printed import value
from ..verdict import Condition, Kind, Span, Verdict
from .loops import Drive, at_end, runs
from .printed import BREAK, CALIBRATION, FIRST_STEP, LADDER_MM, OPTIMUM

MODULUS_N_TEX, STRENGTH_N_TEX = (91.0, 140.0), (2.8, 4.0)
"""As printed."""
DENSITY_KG_M3, DIAMETER = 975.0, 3.05e-4
"""Middle of the printed 0.97 to 0.98 g/cm3; printed diameter [m]."""
G = 9.81


def modulus_band() -> tuple[float, float]:
    """EA [N]: the printed modulus with the tex that the printed strength and breaking load make."""
    load = value(BREAK.text) * G
    tex = [load / strength for strength in reversed(STRENGTH_N_TEX)]
    return MODULUS_N_TEX[0] * tex[0], MODULUS_N_TEX[1] * tex[1]


def solid_tex() -> float:
    """Mass per length of a solid cylinder of the printed diameter [g/km]."""
    return math.pi / 4.0 * DIAMETER**2 * DENSITY_KG_M3 * 1e6


def preload_runs() -> dict[str, Trajectory]:
    """Forward strokes of the drive at the five preloads, 0.5 kg and 180 deg."""
    return runs({f"{T:g}": Drive("m05_180", {"T_0": T, "winding_strain": 0}, there=True) for T in PRELOAD_N})


def tendon_claims(preloaded: dict[str, Trajectory]) -> list[Claim]:
    """Claims on Figs 9 to 12 and Table 1."""
    return [_strength(), _optimum(), _fall(preloaded), _ladder(), _calibration(), _three_points()]


def _strength() -> Claim:
    fill = (0.7, 1.0)
    loads = [f * s * solid_tex() / G for f in fill for s in STRENGTH_N_TEX]
    return number_claim(
        "ame2020.strength",
        "Fig. 12",
        "breaking load of eight strands in 0.305 mm at 2.8-4 N/tex",
        BREAK,
        Span.of(*loads),
        assumed=(Open("fill of the circle by eight strands", "0.7 to 1", "assumed; a solid cylinder is 1"),),
        method=Method.PRINT,
    )


def _optimum() -> Claim:
    grid = np.linspace(PRELOAD_N[0], PRELOAD_N[-1], 1901)
    best = float(grid[np.argmin(Akima1DInterpolator(PRELOAD_N, DIFFERENCE_MM)(grid))])
    least = int(np.argmin(DIFFERENCE_MM))
    apart = [math.hypot(sd, DEVIATION_MM[least]) for sd in DEVIATION_MM]
    alike = [T for T, m, sd in zip(PRELOAD_N, DIFFERENCE_MM, apart, strict=True) if m - DIFFERENCE_MM[least] <= sd]
    return number_claim(
        "ame2020.optimum",
        "Fig. 10",
        "preload of the least displacement difference, within the printed deviations",
        OPTIMUM,
        Span.of(*alike, best),
        assumed=(Open("means", "within their printed standard deviations", "text to Fig. 9"),),
        why={
            Verdict.NOT_DETERMINED: f"the Akima spline through the means has its least at {best:.2f} N; the deviations "
            f"tell it from higher preloads only, not from {', '.join(f'{T:g}' for T in alike)} N"
        },
        method=Method.PRINT,
    )


def _fall(preloaded: dict[str, Trajectory]) -> Claim:
    ours = {T: at_end(run) for T, run in preloaded.items()}
    rise = ours["1.9"] - ours["1.1"]
    return statement_claim(
        "ame2020.preload_shape",
        "Fig. 10",
        "error at a preload of 1.9 N less that at 1.1 N, Eqs (23), (30)",
        "mm",
        "2.8, 2.2, 1.7, 4.2, 5.1 mm at 0, 0.6, 1.1, 1.7, 1.9 N: the difference rises again above 1.1 N",
        {"Eqs (23), (30)": Condition(rise, ">=", 0.0)},
        kind=Kind.MEASUREMENT,
        assumed=(Open("load of that rig", "0.5 kg at 180 deg", "not printed; the sign is that of any load"),),
        why={
            Verdict.NOT_EXPLAINED: "in the equations preload stretches the tendon beforehand, so the error falls with "
            "it throughout: nothing in them makes an optimum"
        },
        method=Method.CO_SIMULATION,
    )


def _ladder() -> Claim:
    low, high = modulus_band()
    forces = [stiffness * LADDER_MM[0] / length for stiffness in (low, high) for length in (0.5e3, 3.0e3)]
    steps = np.diff([0.0, *PRELOAD_N[1:]]) / np.diff([0.0, *LADDER_MM])
    return number_claim(
        "ame2020.ladder",
        "Fig. 9",
        "tension after 3 mm of the tensioning pulley, EA/L times its travel",
        FIRST_STEP,
        Span.of(*forces),
        assumed=(
            Open("EA", f"{low:.0f} to {high:.0f} N", "91-140 N/tex, 20.8 kg at 2.8-4 N/tex"),
            Open("length that is tensioned", "0.5 to 3 m", "not printed; the sheath is 1.5 m, the loop twice that"),
        ),
        why={
            Verdict.NOT_EXPLAINED: f"the four steps are {steps.min():.2f} to {steps.max():.2f} N/mm: the pulley "
            "takes up "
            "slack or bends the sheath, it does not strain the tendon alone"
        },
        method=Method.PRINT,
    )


def _calibration() -> Claim:
    slope, intercept = (float(c) for c in np.polyfit(PRESSURE_N, TENSION_N, 1))
    off = np.polyval([slope, intercept], PRESSURE_N) - np.array(TENSION_N)
    return together_claim(
        "ame2020.calibration",
        "Table 1",
        "Eq. (37) fitted anew to Table 1, and the pressure at 1.1 N",
        CALIBRATION,
        {"slope": slope, "intercept": intercept, "pressure at 1.1 N": (1.1 - intercept) / slope},
        kind=Kind.PRINT,
        why={
            Verdict.REPRODUCED: f"the fit is off by {np.sqrt(np.mean(off**2)):.3f} N rms and "
            f"{np.abs(off).max():.2f} N at "
            "most, against a preload of 1.1 N"
        },
        method=Method.PRINT,
    )


def _three_points() -> Claim:
    spare = 2.0 * np.array(TENSION_N) - np.array(PRESSURE_N)
    slope = float(np.polyfit(TENSION_N, PRESSURE_N, 1)[0])
    deflection = 35.0 * math.tan(math.asin(0.5 * slope))
    return statement_claim(
        "ame2020.three_points",
        ("Fig. 11", "Table 1"),
        "least of 2 F_r - P_r over Table 1",
        "N",
        "the pressure P_r between two bars 70 mm apart measures the tension F_r",
        {"three forces in balance": Condition(float(spare.min()), ">=", 0.0)},
        kind=Kind.MEASUREMENT,
        why={
            Verdict.NOT_EXPLAINED: f"a tendon pressed aside balances at most P = 2 F; {int(np.sum(spare < 0.0))} of 10 "
            "rows have more, so the sensor reads a preload of its own, which is the intercept of Eq. (37). Its slope "
            f"means a deflection of {deflection:.1f} mm"
        },
        method=Method.PRINT,
    )
