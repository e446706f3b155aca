"""How far a computed value may be off what the papers print (`papers`); numbers that stand here alone are used once."""

from __future__ import annotations

from ..scenarios.papers import (
    ERROR_N,
    MMT_MSE_LUGRE,
    MMT_MSE_NON_PERIODIC,
    MMT_MSE_PERIODIC,
    MSSP_FRICTION_ERROR_N,
    MSSP_RESIDUAL_DEG,
    MSSP_WIDTH_DEG,
)
from .claims import Reported, Span

ROUNDING = "half of the last printed digit"


def printed(value: float, unit: str, where: str, accuracy: float, because: str = ROUNDING) -> Reported:
    """One printed value."""
    return Reported(Span.of(value), unit, where, accuracy, because)


ENCODER = "one count of the 3600 P/R encoder is 0.1 deg, more than the rounding"
AROUND = "'around' a whole number in the text"

REPORTED = {
    "iftomm2013.error": printed(ERROR_N["iftomm2013"], "N", "page 8", 0.05),
    "mmt2015.error": printed(ERROR_N["mmt2015"], "N", "Section 5, Fig. 6(c)", 0.5, AROUND),
    "mmt2015.mse_periodic": printed(MMT_MSE_PERIODIC, "N2", "Section 5, Fig. 6", 5e-4),
    "mmt2015.mse_non_periodic": printed(MMT_MSE_NON_PERIODIC, "N2", "Section 5, Fig. 7", 5e-5),
    "mssp2015.friction_error": printed(MSSP_FRICTION_ERROR_N, "N", "Section 8, Fig. 11", 5e-5),
    "mmt2015.mse_lugre": printed(MMT_MSE_LUGRE, "N2", "Section 3.2, Fig. 3", 5e-5),
    "mssp2015.width": printed(MSSP_WIDTH_DEG["periodic"], "deg", "Section 8, Fig. 10", 0.1, ENCODER),
    "mssp2015.width_non_periodic": printed(MSSP_WIDTH_DEG["non_periodic"], "deg", "Section 8, Fig. 12", 0.1, ENCODER),
    "mssp2015.residual": printed(MSSP_RESIDUAL_DEG["periodic"], "deg", "Section 8, Fig. 10", 0.5, AROUND),
    "mssp2015.residual_non_periodic": printed(
        MSSP_RESIDUAL_DEG["non_periodic"], "deg", "Section 8, Fig. 12", 0.5, AROUND
    ),
    "mssp2015.parameters": printed(10.0, "1", "Section 5", 0.0, "a count"),
    "ame2020.slope": printed(3.437, "1", "Eq. (37)", 5e-4),
    "ame2020.intercept": printed(-4.514, "N", "Eq. (37)", 5e-4),
    "ame2020.pressure": printed(1.63, "N", "below Eq. (37)", 5e-3),
    "ame2020.optimum": printed(1.1, "N", "Fig. 10", 0.3, "half the distance to the next preload tried"),
    "ame2020.break": printed(20.8 * 9.81, "N", "experimental design, 20.8 kg", 0.5, ROUNDING),
    "ame2020.peak": printed(2.0 / 3.0, "1", "text to Fig. 16", 0.05, "'approximately 2/3 of the stroke'"),
}


def trials(key: str, values: tuple[float, ...], unit: str, where: str) -> Reported:
    """The range of five trials; ``key`` says of what."""
    half = 0.5 * (max(values) - min(values))
    return Reported(Span.of(*values), unit, f"{where}, {key}", half, "half the range of the five trials")


def displacement(value: float, where: str) -> Reported:
    """A displacement error of AME 2020 as a curve ends, read by the authors."""
    return printed(
        value, "mm", where, 0.05, "the printed values of one curve in Figs 17 and 18 differ by up to 0.03 mm"
    )
