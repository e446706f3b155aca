"""MSSP 2015: what it prints on tracking and friction errors, as printed."""

from __future__ import annotations

from ...scenarios.papers import MSSP_FRICTION_ERROR_N, MSSP_RESIDUAL_DEG, MSSP_WIDTH_DEG, TRIALS
from ..printed import Printed, printed, trials

MOTIONS = ("periodic", "non_periodic")
TRACKING = {"periodic": "Fig. 10", "non_periodic": "Fig. 12"}
IDENTIFIED = {"periodic": "Fig. 7", "non_periodic": "Fig. 8"}
FRICTION = {"periodic": "Fig. 11", "non_periodic": "Fig. 13"}
TABLES = {"periodic": "Table 1", "non_periodic": "Table 2"}

WIDTH = {m: printed(f"{MSSP_WIDTH_DEG[m]:g}", "deg", f"Section 8, {TRACKING[m]}") for m in MOTIONS}
RESIDUAL = {m: printed(f"around {MSSP_RESIDUAL_DEG[m]:g}", "deg", f"Section 8, {TRACKING[m]}") for m in MOTIONS}
FRICTION_ERROR = printed(f"{MSSP_FRICTION_ERROR_N:g}", "N", "Section 8, Fig. 11")


def table(motion: str, column: str, unit: str) -> Printed:
    """A column of Table 1 or 2."""
    return trials(tuple(f"{v:.4f}" for v in TRIALS[motion][column]), unit, TABLES[motion])


TRACKED: dict[str, Printed] = {
    f"{motion}.{name}": value
    for motion in MOTIONS
    for name, value in {
        "width": WIDTH[motion],
        "residual": RESIDUAL[motion],
        "std": table(motion, "position_std_deg", "deg"),
        "mean": table(motion, "position_mean_deg", "deg"),
    }.items()
}
"""The eight numbers on tracking: error without feedforward, and with it peak to peak, deviation and mean."""
