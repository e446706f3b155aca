"""AME 2020: what it prints on displacements, preload and calibration, as printed."""

from __future__ import annotations

from ...scenarios.papers import (
    CASES,
    FORWARD_MM,
    MAXIMUM_FORWARD_MM,
    MAXIMUM_REVERSE_MM,
    NAMES,
    RESIDUAL_FORWARD_MM,
    RESIDUAL_REVERSE_MM,
    REVERSE_MM,
)
from ..printed import printed

FORWARD = {NAMES[c]: printed(f"{FORWARD_MM[c]:g}", "mm", "Fig. 16") for c in CASES}
REVERSE = {NAMES[c]: printed(f"{REVERSE_MM[c]:g}", "mm", "Fig. 17") for c in CASES}
THEORY_FORWARD = {NAMES[c]: printed(f"{v:g}", "mm", "text to Fig. 13") for c, v in MAXIMUM_FORWARD_MM.items()}
THEORY_REVERSE = {NAMES[c]: printed(f"{v:g}", "mm", "text to Fig. 14") for c, v in MAXIMUM_REVERSE_MM.items()}
RESIDUAL = {
    "forward": printed("{:g} to {:g}".format(*RESIDUAL_FORWARD_MM), "mm", "text to Figs 19, 20"),
    "reverse": printed("{:g} to {:g}".format(*RESIDUAL_REVERSE_MM), "mm", "text to Figs 19, 20"),
}
PEAK = printed("approximately 2/3", "1", "text to Fig. 16")
BREAK = printed("20.8", "kg", "experimental design")
CALIBRATION = {
    "slope": printed("3.437", "", "Eq. (37)"),
    "intercept": printed("-4.514", "", "Eq. (37)"),
    "pressure at 1.1 N": printed("1.63", "", "below Eq. (37)"),
}
OPTIMUM = printed("approximately 1.1", "N", "text to Fig. 10")
LADDER_MM = (3.0, 6.0, 9.0, 12.0)
"""Travel of the tensioning pulley for the preloads 0.6, 1.1, 1.7 and 1.9 N."""
FIRST_STEP = printed("0.6", "N", "text to Fig. 9: 3 mm")
