"""Numbers that the papers print, each with its place and with how far a computed value may be off."""

from __future__ import annotations

from .claims import Reported, Span

ROUNDING = "half of the last printed digit"


def printed(value: float, unit: str, where: str, accuracy: float, because: str = ROUNDING) -> Reported:
    """One printed value."""
    return Reported(Span.of(value), unit, where, accuracy, because)


TRIALS_PERIODIC = {
    "position_mean_deg": (0.0150, -0.0036, 0.0168, 0.0185, 0.0095),
    "position_std_deg": (0.5804, 0.6001, 0.5963, 0.5803, 0.5937),
    "friction_mean_N": (-0.0124, -0.0018, -0.0035, -0.0125, -0.0096),
    "friction_std_N": (0.2261, 0.2253, 0.2227, 0.2241, 0.2243),
}
"""MSSP 2015 Table 1."""
TRIALS_NON_PERIODIC = {
    "position_mean_deg": (0.0602, -0.0804, -0.0165, -0.0659, -0.0878),
    "position_std_deg": (0.8157, 0.8007, 0.7937, 0.7917, 0.7829),
    "friction_mean_N": (0.1070, -0.0188, 0.1335, -0.1015, 0.1187),
    "friction_std_N": (0.2351, 0.2325, 0.2360, 0.2318, 0.2231),
}
"""MSSP 2015 Table 2."""

PRESSURE_N = (1.25, 1.36, 1.46, 1.53, 1.68, 1.77, 1.88, 2.0, 2.07, 2.16)
TENSION_N = (0.07, 0.27, 0.43, 0.63, 0.94, 1.22, 2.1, 2.42, 2.74, 3.02)
"""AME 2020 Table 1."""
PRELOAD_N = (0.0, 0.6, 1.1, 1.7, 1.9)
DIFFERENCE_MM = (2.8, 2.2, 1.7, 4.2, 5.1)
DEVIATION_MM = (1.5, 1.0, 1.1, 1.1, 2.2)
"""AME 2020 Figs 9 and 10, text below Fig. 8: mean and standard deviation of the displacement difference."""

CASES = ("m05_180", "m05_540", "m10_180", "m10_540")
FORWARD_MM: dict[str, float] = dict(zip(CASES, (1.77, 3.21, 4.808, 10.37), strict=True))
"""AME 2020 Fig. 16."""
REVERSE_MM: dict[str, float] = dict(zip(CASES, (156.28, 187.06, 202.33, 205.99), strict=True))
"""AME 2020 Fig. 17."""
MAXIMUM_FORWARD_MM = {"m05_180": 2.88, "m10_540": 5.35}
"""AME 2020 Fig. 13."""
MAXIMUM_REVERSE_MM = {"m05_180": 6.41, "m10_540": 13.22}
"""AME 2020 Fig. 14."""
SAME_BEND = ("m05_540", "m10_540")
"""Cases of AME 2020 Fig. 18: its reverse errors are those of Fig. 17 at 540 deg."""
SAME_BEND_MM = {"forward": (3.85958, 7.42479), "reverse": (187.09167, 205.99708)}
"""AME 2020 Fig. 18: 0.5 and 1 kg."""

MMT_MSE_LUGRE, MMT_MSE_PERIODIC, MMT_MSE_NON_PERIODIC = 1.4538, 0.027, 0.0419
"""MMT 2015 Section 3.2 (LuGre) and Section 5 (proposed model) [N2]."""
MMT_FIG_4 = {"rho1": 8.855, "mu1": -6.533, "kappa1": -0.341, "kappa2": 0.078, "kappa3": 0.0063, "mu2": 14.6}
"""MMT 2015 Fig. 4, as printed."""

ENCODER = "one count of the 3600 P/R encoder is 0.1 deg, more than the rounding"
AROUND = "'around' a whole number in the text"

REPORTED = {
    "iftomm2013.error": printed(0.4, "N", "page 8", 0.05),
    "mmt2015.error": printed(1.0, "N", "Section 5, Fig. 6(c)", 0.5, AROUND),
    "mmt2015.mse_periodic": printed(MMT_MSE_PERIODIC, "N2", "Section 5, Fig. 6", 5e-4),
    "mmt2015.mse_non_periodic": printed(MMT_MSE_NON_PERIODIC, "N2", "Section 5, Fig. 7", 5e-5),
    "mssp2015.friction_error": printed(1.4216, "N", "Section 8, Fig. 11", 5e-5),
    "mmt2015.mse_lugre": printed(MMT_MSE_LUGRE, "N2", "Section 3.2, Fig. 3", 5e-5),
    "mssp2015.width": printed(10.5, "deg", "Section 8, Fig. 10", 0.1, ENCODER),
    "mssp2015.width_non_periodic": printed(12.3, "deg", "Section 8, Fig. 12", 0.1, ENCODER),
    "mssp2015.residual": printed(3.0, "deg", "Section 8, Fig. 10", 0.5, AROUND),
    "mssp2015.residual_non_periodic": printed(4.0, "deg", "Section 8, Fig. 12", 0.5, AROUND),
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
