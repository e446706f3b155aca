"""MSSP 2015: backlash-like hysteresis, feedforward law and friction of a pair of tendons."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...kernels.kernel import kernel
from ...scenarios.mssp_feedforward import loop_height
from ...scenarios.papers import TRIALS
from ..claims import Claim, Condition, Span, Verdict, number_claim, open_claim, statement_claim
from ..motions import SECOND, Motion, friction, sines
from ..numbers import REPORTED, trials
from ..result import PaperResult
from .drive import backlash, compensated, error_deg, numbers_of
from .figures import identified_figure, tracking_figure
from .friction import friction_claims, friction_figure

MOTIONS = {
    "periodic": ((math.radians(60.0), 0.2),),
    "non_periodic": ((math.radians(30.0), 0.2), (math.radians(30.0), SECOND)),
}
TRACKING = {"periodic": "Fig. 10", "non_periodic": "Fig. 12"}
IDENTIFIED = {"periodic": "Fig. 7", "non_periodic": "Fig. 8"}
FRICTION = {"periodic": "Fig. 11", "non_periodic": "Fig. 13"}
TABLES = {"periodic": "Table 1", "non_periodic": "Table 2"}
SUFFIX = {"periodic": "", "non_periodic": "_non_periodic"}
MILDER = {"B = 0.65": 0.65, "B = 0.70": 0.70}
"""Slopes after a reversal of plants with the published loop width; a scan after the fact."""


def result() -> PaperResult:
    motions = {name: sines(parts, 20.0, 1e-3) for name, parts in MOTIONS.items()}
    raw = {name: friction("PairedTsmFriction", motion, "raw") for name, motion in motions.items()}
    claims = [_slope(), *_law(motions["periodic"]), _count()]
    for name, motion in motions.items():
        claims += [_width(name, motion), *_residuals(name, motion)]
    claims += friction_claims(motions, raw, FRICTION, IDENTIFIED)
    figures = {TRACKING[name]: tracking_figure(motion) for name, motion in motions.items()}
    figures |= {IDENTIFIED[name]: identified_figure(motion, raw[name]) for name, motion in motions.items()}
    figures |= {FRICTION[name]: friction_figure(motion, raw[name]) for name, motion in motions.items()}
    return PaperResult(tuple(claims), figures, texts={"Fig. 10": TEXT})


TEXT = (
    "Plant and compensator are the published models with the published parameters; the drive is where it is "
    "commanded, as in Eqs (22)-(25). Errors are reference minus output from 10 to 20 s. 'tsm-fmu run "
    "mssp_feedforward' closes the loop with motor, controller, friction and load."
)


def _width(name: str, motion: Motion) -> Claim:
    p = numbers_of()
    width = float(np.ptp(error_deg(motion, motion.x, p)))
    closed = math.degrees(2.0 * loop_height(p["beta"], p["alpha"]))
    reported = REPORTED["mssp2015.width" + SUFFIX[name]]
    quantity = "uncompensated error, peak to peak"
    if name == "periodic":
        in_degrees = 2.0 * abs(p["beta"]) / p["alpha"]
        why = {
            Verdict.REPRODUCED: f"alpha is per radian (closed form {closed:.3f} deg without c); per degree it would be "
            f"{in_degrees:.2f} deg"
        }
        return number_claim("mssp2015.width", (TRACKING[name], IDENTIFIED[name]), quantity, reported, width, why)
    most = math.degrees(2.0 * abs(p["beta"]) / p["alpha"] + 2.0 * abs(p["c"] - 1.0) * np.abs(motion.x).max())
    why = {
        Verdict.CONTRADICTS: f"no motion makes the model exceed 2 |beta|/alpha + 2 |c - 1| A = {most:.2f} deg: the "
        "difference is in the plant"
    }
    return number_claim(
        "mssp2015.width_non_periodic",
        (TRACKING[name], IDENTIFIED[name]),
        quantity,
        reported,
        Span.of(width, most),
        why,
    )


def _residuals(name: str, motion: Motion) -> list[Claim]:
    own = numbers_of()
    published = error_deg(motion, compensated(motion.x, 1, own), own)
    milder = []
    for b in MILDER.values():
        parameters = numbers_of(b)
        milder.append(error_deg(motion, compensated(motion.x, 1, parameters), parameters))
        milder.append(error_deg(motion, compensated(motion.x, 1, own), parameters))
    table, columns = TABLES[name], TRIALS[name]
    std = trials("position, standard deviation", columns["position_std_deg"], "deg", table)
    mean = trials("position, mean error", columns["position_mean_deg"], "deg", table)
    reported = REPORTED["mssp2015.residual" + SUFFIX[name]]
    stays = "with the published plant the law leaves more than was measured, so the real plant is milder than the model"
    scan = "plants with B = 0.65 and 0.70 and the published width, own or published compensator; a scan after the fact"
    key = f"mssp2015.{name}_"
    return [
        number_claim(
            key + "residual",
            TRACKING[name],
            "error with feedforward, peak to peak, published plant",
            reported,
            float(np.ptp(published)),
            {Verdict.CONTRADICTS: stays},
        ),
        number_claim(
            key + "residual_milder",
            TRACKING[name],
            "error with feedforward, peak to peak, milder plants",
            reported,
            Span.of(*(float(np.ptp(e)) for e in milder)),
            {Verdict.CONSISTENT: scan},
        ),
        number_claim(
            key + "std",
            table,
            "standard deviation of that error, published plant",
            std,
            float(np.std(published)),
            {Verdict.CONTRADICTS: stays},
        ),
        number_claim(
            key + "std_milder",
            table,
            "standard deviation of that error, milder plants",
            std,
            Span.of(*(float(np.std(e)) for e in milder)),
            {Verdict.CONSISTENT: scan},
        ),
        number_claim(
            key + "mean",
            table,
            "mean of that error, published plant",
            mean,
            float(np.mean(published)),
            {Verdict.CONSISTENT: "the trials scatter around it"},
        ),
        open_claim(
            key + "friction_std",
            table,
            "friction error, standard deviation",
            None,
            "the error is against measurements that are not published",
            reported=trials("friction, standard deviation", columns["friction_std_N"], "N", table),
        ),
        open_claim(
            key + "friction_mean",
            table,
            "friction error, mean",
            None,
            "the error is against measurements that are not published",
            reported=trials("friction, mean error", columns["friction_mean_N"], "N", table),
        ),
    ]


def _slope() -> Claim:
    p = numbers_of()
    turn = 1.2
    way_back = turn - np.linspace(0.0, 0.3, 30001)
    out = backlash(np.concatenate([np.linspace(0.0, turn, 200)[:-1], way_back]), p)[199:]
    slope = (out[1] - out[0]) / (way_back[1] - way_back[0])
    back, until = np.max(out) - out[0], turn - way_back[np.argmax(out)]
    return statement_claim(
        "mssp2015.monotone",
        "Eq. (8)",
        "slope of the output just after a reversal",
        "1",
        "output and input rise and fall together between extrema for alpha > 0, B > 0, c > B",
        {"published set": Condition(float(slope), ">=", 0.0)},
        {
            Verdict.CONTRADICTS: f"the output runs backwards by {math.degrees(back):.4f} deg over the first "
            f"{math.degrees(until):.3f} deg; it takes B >= c/2"
        },
    )


def _law(motion: Motion) -> list[Claim]:
    own = numbers_of()
    law_1 = error_deg(motion, compensated(motion.x, 1, own), own)
    law_2 = error_deg(motion, compensated(motion.x, 2, own), own)
    most = math.degrees(_largest_residual(own))
    return [
        statement_claim(
            "mssp2015.eliminated",
            "Eq. (24)",
            "error with the law of Eqs (23), (25) and exact parameters, peak to peak",
            "deg",
            "with x_h estimated accurately the error is eliminated",
            {"law 1": Condition(float(np.ptp(law_1)), "<=", 0.01)},
            {
                Verdict.CONTRADICTS: f"Eq. (25) feeds the observer with x_r, the plant gets x_FF: {most:.4f} deg stay "
                f"either way; fed with x_FF (law 2) {np.ptp(law_2):.1g} deg stay"
            },
        )
    ]


def _largest_residual(p: Mapping[str, float]) -> float:
    """Largest error of law 1 in steady cycles [rad], closed form."""
    y = np.linspace(0.0, 1.0, 100001)
    width = 2.0 * abs(p["beta"])
    return width / p["alpha"] * float(np.max(y * -np.expm1(-width / p["c"] * (1.0 - y))))


def _count() -> Claim:
    models = ("PairedTsmFriction", "raw"), ("PairedTsmBacklash", "published")
    printed = sum(len(kernel(model).presets[preset].printed) for model, preset in models)
    return number_claim(
        "mssp2015.parameters",
        "Section 5",
        "number of identified parameters",
        REPORTED["mssp2015.parameters"],
        float(printed),
        {Verdict.CONTRADICTS: "Section 7 lists eight of friction and three of backlash"},
    )
