"""Numbers that the five papers print, as printed, each with its place.

Scenarios show them beside their results; `reproduce` adds how far a computed value may be off and judges.
"""

from __future__ import annotations

from ..cosim.metric import Metric


def _trials(unit: str, *values: float) -> tuple[Metric, ...]:
    return tuple(Metric(value, unit) for value in values)


ERROR_N = {"iftomm2013": 0.4, "mmt2015": 1.0}
"""Largest error of the distal force: IFToMM 2013 page 8; MMT 2015 Section 5, Fig. 6(c)."""
MMT_MSE_LUGRE, MMT_MSE_PERIODIC, MMT_MSE_NON_PERIODIC = 1.4538, 0.027, 0.0419
"""MMT 2015 Section 3.2 (LuGre) and Section 5 (proposed model) [N2]."""
MMT_FIG_4 = {"rho1": 8.855, "mu1": -6.533, "kappa1": -0.341, "kappa2": 0.078, "kappa3": 0.0063, "mu2": 14.6}
"""MMT 2015 Fig. 4, as printed."""

MSSP_WIDTH_DEG = {"periodic": 10.5, "non_periodic": 12.3}
"""MSSP 2015 Section 8, Figs 10 and 12: peak to peak of the tracking error without feedforward."""
MSSP_RESIDUAL_DEG = {"periodic": 3.0, "non_periodic": 4.0}
"""MSSP 2015 Section 8, Figs 10 and 12: with feedforward, 'around'."""
MSSP_FRICTION_ERROR_N = 1.4216
"""MSSP 2015 Section 8, Fig. 11: peak to peak of the friction error, periodic motion."""
TRIALS = {
    "periodic": {
        "position_mean": _trials("deg", 0.0150, -0.0036, 0.0168, 0.0185, 0.0095),
        "position_std": _trials("deg", 0.5804, 0.6001, 0.5963, 0.5803, 0.5937),
        "friction_mean": _trials("N", -0.0124, -0.0018, -0.0035, -0.0125, -0.0096),
        "friction_std": _trials("N", 0.2261, 0.2253, 0.2227, 0.2241, 0.2243),
    },
    "non_periodic": {
        "position_mean": _trials("deg", 0.0602, -0.0804, -0.0165, -0.0659, -0.0878),
        "position_std": _trials("deg", 0.8157, 0.8007, 0.7937, 0.7917, 0.7829),
        "friction_mean": _trials("N", 0.1070, -0.0188, 0.1335, -0.1015, 0.1187),
        "friction_std": _trials("N", 0.2351, 0.2325, 0.2360, 0.2318, 0.2231),
    },
}
"""MSSP 2015 Tables 1 and 2: five trials each."""

PRESSURE_N = (1.25, 1.36, 1.46, 1.53, 1.68, 1.77, 1.88, 2.0, 2.07, 2.16)
TENSION_N = (0.07, 0.27, 0.43, 0.63, 0.94, 1.22, 2.1, 2.42, 2.74, 3.02)
"""AME 2020 Table 1."""
PRELOAD_N = (0.0, 0.6, 1.1, 1.7, 1.9)
DIFFERENCE_MM = (2.8, 2.2, 1.7, 4.2, 5.1)
DEVIATION_MM = (1.5, 1.0, 1.1, 1.1, 2.2)
"""AME 2020 Figs 9 and 10, text below Fig. 8: mean and standard deviation of the displacement difference."""

CASES: tuple[str, ...] = ("m05_180", "m05_540", "m10_180", "m10_540")
"""AME 2020: load of 0.5 or 1 kg, total bend of 180 or 540 deg."""
NAMES: dict[str, str] = dict(
    zip(CASES, ("0.5 kg, 180 deg", "0.5 kg, 540 deg", "1 kg, 180 deg", "1 kg, 540 deg"), strict=True)
)
G = 9.81
"""Gravity [m/s2]."""
MASS_KG: dict[str, float] = dict(zip(CASES, (0.5, 0.5, 1.0, 1.0), strict=True))
"""Load of the cases."""
WEIGHT_N: dict[str, float] = {case: mass * G for case, mass in MASS_KG.items()}
"""Their weight m g."""
FORWARD_MM: dict[str, float] = dict(zip(CASES, (1.77, 3.21, 4.808, 10.37), strict=True))
"""AME 2020 Fig. 16: largest error forward."""
REVERSE_MM: dict[str, float] = dict(zip(CASES, (156.28, 187.06, 202.33, 205.99), strict=True))
"""AME 2020 Fig. 17: largest error in reverse."""
MAXIMUM_FORWARD_MM = {"m05_180": 2.88, "m10_540": 5.35}
"""AME 2020 Fig. 13."""
MAXIMUM_REVERSE_MM = {"m05_180": 6.41, "m10_540": 13.22}
"""AME 2020 Fig. 14."""
SAME_BEND = ("m05_540", "m10_540")
"""Cases of AME 2020 Fig. 18: its reverse errors are those of Fig. 17 at 540 deg."""
SAME_BEND_MM = {"forward": (3.85958, 7.42479), "reverse": (187.09167, 205.99708)}
"""AME 2020 Fig. 18: 0.5 and 1 kg."""
RESIDUAL_FORWARD_MM, RESIDUAL_REVERSE_MM = (1.14, 1.24), (1.32, 1.59)
"""AME 2020 Figs 19 and 20: with compensation, one pair of ranges for both cases."""
