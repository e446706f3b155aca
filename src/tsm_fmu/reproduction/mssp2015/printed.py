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


def table(motion: str, column: str) -> Printed:
    """A column of Table 1 or 2."""
    found = TRIALS[motion][column]
    return trials(tuple(f"{trial.value:.4f}" for trial in found), found[0].unit, TABLES[motion])


TRACKED: dict[str, Printed] = {
    f"{motion}.{name}": value
    for motion in MOTIONS
    for name, value in {
        "width": WIDTH[motion],
        "residual": RESIDUAL[motion],
        "std": table(motion, "position_std"),
        "mean": table(motion, "position_mean"),
    }.items()
}
"""The eight numbers on tracking: error without feedforward, and with it peak to peak, deviation and mean."""
