"""MMT 2015: what it prints on errors, as printed."""

from __future__ import annotations

import math

from ...scenarios.papers import ERROR_N, MMT_MSE_LUGRE, MMT_MSE_NON_PERIODIC, MMT_MSE_PERIODIC
from ..printed import Printed, printed
from ..verdict import Span

MSE = {
    "Fig. 6": printed(f"{MMT_MSE_PERIODIC:g}", "N2", "Section 5, Fig. 6"),
    "Fig. 7": printed(f"{MMT_MSE_NON_PERIODIC:g}", "N2", "Section 5, Fig. 7"),
}
ERROR = printed(f"{ERROR_N['mmt2015']:g}", "N", "Section 5, Fig. 6(c)")
MSE_LUGRE = printed(f"{MMT_MSE_LUGRE:g}", "N2", "Section 3.2, Fig. 3")


def allowed_mse() -> Printed:
    """Interval of the mean square difference of the two published models [N2].

    Triangle inequality: both were fitted to the same measured force, with root mean square errors sqrt(1.4538) and
    sqrt(0.027).
    """
    far, near = math.sqrt(MSE_LUGRE.span.middle), math.sqrt(MSE["Fig. 6"].span.middle)
    span = Span((far - near) ** 2, (far + near) ** 2)
    return Printed(f"{MSE_LUGRE.text} (LuGre) and {MSE['Fig. 6'].text} (proposed)", span, "N2", "Sections 3.2 and 5")
