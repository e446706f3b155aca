"""AME 2020: the wheel with its grooves, the friction on it, and the LuGre set, by what the paper prints of them."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from ...kernels.kernel import kernel
from ...logs.units import same_quantity
from ...report import Table
from ..claims import Claim, Method, Open, statement_claim
from ..printed import value
from ..verdict import Condition, Verdict
from .grooves import Grooves, faults
from .printed import BREAK
from .winding import rows_of_eq4, winding_position

ASSUMED = Grooves(pitch=3.2e-4, straight_deg=150.0, width=1.6e-3, distance=0.1)
"""As in the model LebusWinding; the paper prints none of it."""
PITCHES, STRAIGHT_DEG = (2.5e-4, 3.1e-4, 3.6e-4, 6.2e-4), (90.0, 120.0, 150.0, 170.0)
SPEED = 0.05
"""[m/s]"""


def wheel_claims() -> list[Claim]:
    """Claims on Figs 3 and 4 and Eq. (40)."""
    return [_winding(), _unit(), _guided(), _lugre()]


def _winding() -> Claim:
    p = kernel("LebusWinding").params("published")
    angles = np.arange(0.5, 1440.0, 1.0)
    spread = [
        max(values) - min(values)
        for values in (rows_of_eq4(float(a), p.P_s, math.degrees(p.alpha_s), p.L_d0) for a in angles)
        if values
    ]
    _, ours = winding_position(angles)
    step = float(np.abs(np.diff(ours)).max() / p.P_s)
    return statement_claim(
        "ame2020.winding",
        "Fig. 3",
        "largest distance of two places that Eq. (4) gives one angle, over the pitch",
        "1",
        "z_p, one place for each angle",
        {"as printed": Condition(max(spread) / p.P_s, "<=", 1e-9)},
        assumed=(Open("pitch and angle of the grooves", "0.32 mm, 150 deg", "not printed; any have the overlap"),),
        why={
            Verdict.INTERNAL_ERROR: "the ranges of rows 2 to 4 overlap; with those of a half turn each z_p is "
            f"continuous (at most {step:.2g} of the pitch in a degree) and falls by a pitch per turn"
        },
        method=Method.PRINT,
    )


def _unit() -> Claim:
    alike = same_quantity("N/m", "N")
    return statement_claim(
        "ame2020.wheel_unit",
        "Fig. 4",
        "whether F_f1, F_f2 of Eqs (9), (13) have the unit of the tension that Eq. (24) takes them from (1: yes)",
        "1",
        "T_ao - T_0 - F_f2, with F_f2 = 4 sqrt(3) mu F_c cos(gamma)/(3 D)",
        {"N/m from N": Condition(float(alike), ">=", 1.0)},
        why={Verdict.INTERNAL_ERROR: "2 F_c/D is a force per length; the length that would make it a force is missing"},
        method=Method.PRINT,
    )


def _guided() -> Claim:
    found = {cell: faults(_grooves(*cell)) for cell in product(PITCHES, STRAIGHT_DEG)}
    best = [cell for cell, wrong in found.items() if not wrong]
    return statement_claim(
        "ame2020.guided",
        ("Fig. 2", "Fig. 3"),
        "faults of the winding (empty, stacked, wheel full), fewest and most over the grooves of the table below",
        "1",
        "'a double broken-line groove structure that can effectively avoid the phenomenon of tendon entanglement'",
        {
            "fewest": Condition(float(min(map(len, found.values()))), "<=", 0.0),
            "most": Condition(float(max(map(len, found.values()))), "<=", 0.0),
        },
        assumed=(
            Open(
                "pitch", f"{1e3 * PITCHES[0]:g} to {1e3 * PITCHES[-1]:g} mm", "not printed: 0.8 to 2 tendon diameters"
            ),
            Open("angle of a straight groove", f"{STRAIGHT_DEG[0]:g} to {STRAIGHT_DEG[-1]:g} deg", "not printed"),
            Open("width and distance of the sheath", "1.6 mm, 100 mm", "not printed: those of LebusWinding"),
        ),
        why={
            Verdict.NOT_DETERMINED: f"{len(best)} of {len(found)} wind without a fault: it takes a pitch between one "
            "and two tendon diameters and a groove steeper than the fleet angle; the paper prints neither"
        },
        method=Method.MODEL,
    )


def _grooves(pitch: float, straight_deg: float) -> Grooves:
    return ASSUMED._replace(pitch=pitch, straight_deg=straight_deg)


def groove_table() -> Table:
    """What l_s, l_b, phi and n_t come to, and what goes wrong, over pitch and straight angle."""
    rows = []
    for pitch, straight in product(PITCHES, STRAIGHT_DEG):
        g = _grooves(pitch, straight)
        rows.append(
            [
                f"{1e3 * pitch:g}",
                f"{straight:g}",
                f"{1e3 * g.straight_length:.1f}",
                f"{1e3 * g.broken_length:.1f}",
                f"{g.groove_deg:.2f}",
                f"{g.turns:.2f}",
                "; ".join(faults(g)) or "guided",
            ]
        )
    heading = ["P_s [mm]", "alpha_s [deg]", "l_s [mm]", "l_b [mm]", "phi [deg]", "n_t", "winding"]
    return Table(
        heading, rows, "The grooves as a calculator: D = 25 mm, d = 0.305 mm, width 1.6 mm, sheath 100 mm away."
    )


def _lugre() -> Claim:
    p = kernel("LuGreFriction").params("published")
    strength = value(BREAK.text) * 9.81
    settled = p.sigma0 * p.F_c
    spike = 1e3 * p.sigma1 * SPEED
    return statement_claim(
        "ame2020.lugre",
        "Eq. (40)",
        "friction at 0.05 m/s with Eq. (40) and its numbers as printed, 0.5 kg",
        "N",
        "dz/dt = dx/dt - |dx/dt| z/g, k = 1e5 N/m, sigma1 = 10^2.5 N s/mm",
        {
            "steady sigma0 z = sigma0 g": Condition(settled, "<=", strength),
            "sigma1 v at a reversal": Condition(spike, "<=", strength),
        },
        why={
            Verdict.INTERNAL_ERROR: f"the tendon breaks at {strength:.0f} N; sigma0 is missing in the equation of "
            "z, and "
            f"sigma1 is meant in N s/m ({1e-3 * spike:.1f} N)"
        },
        method=Method.MODEL,
    )
