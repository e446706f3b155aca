"""AME 2020: winding, preload, tendon and LuGre set of the LeBus drive; its displacement errors are a file apart."""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from ...kernels.kernel import kernel
from ...models.lebus.geometry import wheel_friction
from ...scenarios.papers import (
    CASES,
    DEVIATION_MM,
    DIFFERENCE_MM,
    FORWARD_MM,
    NAMES,
    PRELOAD_N,
    PRESSURE_N,
    RESIDUAL_REVERSE_MM,
    REVERSE_MM,
    TENSION_N,
    WEIGHT_N,
)
from ..claims import Claim, Condition, Reported, Span, Verdict, number_claim, open_claim, statement_claim
from ..numbers import REPORTED
from ..result import PaperResult
from . import transmission as ame2020_transmission
from .drive import (
    MODEL,
    STRENGTH_N_TEX,
    printed_error,
    profile_integral,
    stiffness_band,
    tension_at_driver,
    tex,
)
from .figures import (
    audit_table,
    calibration_figure,
    preload_figure,
    transmission_figures,
    winding_figure,
)
from .winding import rows_of_eq4, winding_position


def result() -> PaperResult:
    claims = [_winding(), *_wheel_friction(), *_preload(), _strength(), *_calibration(), *_lugre()]
    figures = {"Fig. 3": winding_figure(), "Fig. 10": preload_figure(), "Table 1": calibration_figure()}
    return PaperResult(
        (*claims, *ame2020_transmission.claims()),
        {**figures, **transmission_figures()},
        {"Fig. 16": audit_table()},
        {"Fig. 10": f"Optimum of the preload as data: {_resolved_text()}."},
    )


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
        "Eq. (4) gives the place z_p of the tendon",
        {"as printed": Condition(max(spread) / p.P_s, "<=", 1e-9)},
        {
            Verdict.CONTRADICTS: "the ranges of rows 2 to 4 overlap; with those of a half turn each z_p is continuous "
            f"(at most {step:.2g} of the pitch in a degree) and falls by a pitch per turn; pitch and angles are assumed"
        },
    )


def _wheel_friction() -> list[Claim]:
    p = kernel(MODEL).params("m05_180")
    per_length = [1e-3 * wheel_friction(p.mu, tension_at_driver("m05_180"), 0.0, p.D, p.d, n) for n in (0, 1)]
    low, _ = stiffness_band()
    readings = {}
    for case in CASES:
        excess = FORWARD_MM[case] - printed_error(case, low)
        readings[NAMES[case]] = Condition(-excess * 1e-3 * low / profile_integral(case), ">=", 0.0)
    return [
        statement_claim(
            "ame2020.wheel_friction_sign",
            "Fig. 4",
            "F_f2 that makes Eq. (24) give the forward error of Fig. 16",
            "N",
            "the wheels' friction changes the forward error by -F_f2 I/EA",
            readings,
            {
                Verdict.CONTRADICTS: "a friction cannot be negative: Eq. (24) subtracts it where the measured errors "
                "are already larger (EA at the soft end of the fibre's range)"
            },
        ),
        open_claim(
            "ame2020.wheel_friction_unit",
            "Fig. 4",
            "F_f1 and F_f2 by Eqs (9) and (13), 0.5 kg, 180 deg",
            Span.of(*per_length),
            "2 F_c/D is a force per length; Eq. (24) takes it from a tension, and the length s_w that would make it a "
            "force is not published",
            unit="N/mm",
        ),
    ]


def _preload() -> list[Claim]:
    grid = np.linspace(PRELOAD_N[0], PRELOAD_N[-1], 1901)
    best = float(grid[np.argmin(Akima1DInterpolator(PRELOAD_N, DIFFERENCE_MM)(grid))])
    return [
        number_claim(
            "ame2020.optimum",
            "Fig. 10",
            "preload of the least displacement difference, Akima spline through the five means",
            REPORTED["ame2020.optimum"],
            best,
            {},
        ),
        number_claim(
            "ame2020.optimum_resolved",
            "Fig. 10",
            "preloads whose mean is within the combined deviation of the least one",
            REPORTED["ame2020.optimum"],
            Span.of(*_resolved()),
            {
                Verdict.NOT_DETERMINED: "with the printed deviations the minimum is resolved against higher preloads "
                "only, not against 0 and 0.6 N"
            },
        ),
    ]


def _resolved() -> list[float]:
    least = int(np.argmin(DIFFERENCE_MM))
    return [
        load
        for load, mean, sd in zip(PRELOAD_N, DIFFERENCE_MM, DEVIATION_MM, strict=True)
        if mean - DIFFERENCE_MM[least] <= math.hypot(sd, DEVIATION_MM[least])
    ]


def _resolved_text() -> str:
    found = ", ".join(f"{load:g}" for load in _resolved())
    return f"means of the preloads {found} N differ by less than their combined standard deviations"


def _strength() -> Claim:
    return number_claim(
        "ame2020.strength",
        "Fig. 12",
        "breaking load of a solid fibre of 0.305 mm, 2.8 to 4 N/tex",
        REPORTED["ame2020.break"],
        Span.of(*(s * tex() for s in STRENGTH_N_TEX)),
        {Verdict.CONSISTENT: f"at {REPORTED['ame2020.break'].value.lo / tex():.2f} N/tex"},
    )


def _calibration() -> list[Claim]:
    slope, intercept = (float(c) for c in np.polyfit(PRESSURE_N, TENSION_N, 1))
    off = np.polyval([slope, intercept], PRESSURE_N) - np.array(TENSION_N)
    linearity = f"the fit is off by {np.sqrt(np.mean(off**2)):.3f} N rms and {np.abs(off).max():.2f} N at most"
    return [
        number_claim(
            "ame2020.slope", "Table 1", "slope of Eq. (37), fitted anew", REPORTED["ame2020.slope"], slope, {}
        ),
        number_claim(
            "ame2020.intercept",
            "Table 1",
            "intercept of Eq. (37), fitted anew",
            REPORTED["ame2020.intercept"],
            intercept,
            {Verdict.REPRODUCED: f"{linearity}, against a preload of 1.1 N"},
        ),
        number_claim(
            "ame2020.pressure",
            "Table 1",
            "pressure at a preload of 1.1 N",
            REPORTED["ame2020.pressure"],
            (1.1 - intercept) / slope,
            {},
        ),
    ]


def _lugre() -> list[Claim]:
    k = kernel("LuGreFriction")
    p = k.params("published")
    low, _ = stiffness_band()
    length = kernel(MODEL).params("published").L[0]
    per_weight = p.F_c / WEIGHT_N["m05_180"]
    effect = {case: 1e3 * per_weight * WEIGHT_N[case] * length / low for case in ("m05_180", "m10_540")}
    left = max(RESIDUAL_REVERSE_MM)
    v = 0.05
    spike = 1e3 * p.sigma1 * v
    strength = STRENGTH_N_TEX[1] * tex()
    steady = k.simulate(p, [0.0, 1.0], [[v], [v]], compiled=False)[-1, 0] - p.sigma2 * v
    return [
        number_claim(
            f"ame2020.lugre_{case}",
            ("Eq. (40)", "Fig. 19" if case == "m05_180" else "Fig. 20"),
            f"part of the reverse error that the LuGre friction can take away, {NAMES[case]}",
            Reported(
                Span.of(REVERSE_MM[case] - left),
                "mm",
                "Fig. 17 less the residual of Figs 19, 20",
                1.0,
                "the residual is an average with a deviation",
            ),
            Span.of(0.0, reach),
            {Verdict.CONTRADICTS: "f_c L/EA at most: what goes is the slack, taken up by the angle of Eq. (28)"},
        )
        for case, reach in effect.items()
    ] + [
        statement_claim(
            "ame2020.sigma1_unit",
            "Eq. (40)",
            "sigma1 v at a reversal at 0.05 m/s with sigma1 in N s/mm",
            "N",
            "sigma1 = 10^2.5 N s/mm",
            {"as printed": Condition(spike, "<=", strength)},
            {Verdict.CONTRADICTS: f"the tendon breaks at {strength:.0f} N; N s/m is meant ({1e-3 * spike:.1f} N)"},
        ),
        statement_claim(
            "ame2020.lugre_state",
            "Eq. (40)",
            "steady sigma0 z with dz/dt = v - |v| z/g as printed, over f_c",
            "1",
            "g is the friction between f_c and f_s",
            {"as printed": Condition(p.sigma0 * p.F_c / p.F_c, "<=", 1.0 + 1e-6)},
            {
                Verdict.CONTRADICTS: f"sigma0 is missing in the equation of z; with it the friction settles at "
                f"{steady / p.F_c:.4g} f_c"
            },
        ),
    ]
