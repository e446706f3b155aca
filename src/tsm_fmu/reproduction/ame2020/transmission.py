"""AME 2020, Figs 13 to 20: what elasticity and capstan friction give for the reported displacement errors."""

from __future__ import annotations

import math

import numpy as np

from ...kernels.kernel import kernel
from ...scenarios.papers import (
    CASES,
    FORWARD_MM,
    MAXIMUM_FORWARD_MM,
    MAXIMUM_REVERSE_MM,
    NAMES,
    RESIDUAL_FORWARD_MM,
    RESIDUAL_REVERSE_MM,
    REVERSE_MM,
    SAME_BEND,
    SAME_BEND_MM,
)
from ..claims import Claim, Condition, Reported, Span, Verdict, number_claim, open_claim, statement_claim
from ..numbers import REPORTED, displacement
from .drive import (
    MODEL,
    compensated_error,
    fitted_stiffness,
    forward_error,
    lost_motion,
    printed_error,
    stiffness_band,
)


def forward_span(case: str) -> Span:
    """Forward error [mm] by Eqs (23), (30) over the fibre's stiffness, as printed and with T_0 L for T_0 I."""
    band = stiffness_band()
    return Span.of(*(f for EA in band for f in (forward_error(case, EA=EA)[-1], printed_error(case, EA))))


def reverse_span(case: str) -> Span:
    """Elastic lost motion [mm] over the fibre's stiffness and both ways in which the weight can hang."""
    band = stiffness_band()
    return Span.of(*(lost_motion(case, changes_sides=s, slack=0.0, EA=EA) for EA in band for s in (True, False)))


def claims() -> list[Claim]:
    """Claims on Figs 13 to 20 and on the tendon's stiffness."""
    forward = {case: forward_span(case) for case in CASES}
    reverse = {case: reverse_span(case) for case in CASES}
    return [
        *_forward(forward),
        *_stiffness(),
        *_exponents(),
        *_shape(),
        *_reverse(reverse),
        *_same_bend(forward, reverse),
        *_residuals(),
    ]


def _forward(forward: dict[str, Span]) -> list[Claim]:
    low = stiffness_band()[0]
    found = []
    for case, span in forward.items():
        with_winding = forward_error(case, EA=low, winding_strain=1)[-1]
        why = {
            Verdict.CONTRADICTS: f"EA would have to be {low * span.hi / FORWARD_MM[case]:.0f} N, the fibre has "
            f"{low:.0f} N or more; with the strain that the wheels wind (ours) it is up to {with_winding:.4g} mm"
        }
        reported = displacement(FORWARD_MM[case], "Fig. 16")
        found.append(
            number_claim(
                f"ame2020.forward_{case}", "Fig. 16", f"forward error at 785 mm, {NAMES[case]}", reported, span, why
            )
        )
    for case, value in MAXIMUM_FORWARD_MM.items():
        beside = FORWARD_MM[case]
        why = {
            Verdict.CONTRADICTS: f"and Fig. 16 has {beside:g} mm at the end of the same stroke"
            + (", more than this maximum" if beside > value else "")
        }
        reported = displacement(value, "text to Fig. 13")
        found.append(
            number_claim(
                f"ame2020.maximum_forward_{case}",
                "Fig. 13",
                f"largest forward error, {NAMES[case]}",
                reported,
                forward[case],
                why,
            )
        )
    return found


def _stiffness() -> list[Claim]:
    band = Reported(Span.of(*stiffness_band()), "N", "91-140 N/tex and 0.305 mm", 0.0, "a range of the maker")
    found = []
    for winding, name in ((0, "path strain, Eqs (23), (30)"), (1, "path and winding strain (ours)")):
        EA, rms = fitted_stiffness(winding)
        why = {
            Verdict.CONTRADICTS: f"and leaves {rms:.2f} mm rms: the equations need a tendon softer than its fibre",
            Verdict.CONSISTENT: f"it leaves {rms:.2f} mm rms, as much: preferred only because EA is that of the fibre",
        }
        key = f"ame2020.stiffness_{'winding' if winding else 'path'}"
        found.append(
            number_claim(key, ("Fig. 16", "Fig. 12"), f"EA that fits the four forward errors, {name}", band, EA, why)
        )
    return found


def _exponents() -> list[Claim]:
    found = []
    for bend in ("180", "540"):
        light, heavy = f"m05_{bend}", f"m10_{bend}"
        ratio, accuracy = FORWARD_MM[heavy] / FORWARD_MM[light], 0.05 / FORWARD_MM[light]
        reported = Reported(
            Span.of(math.log2(ratio)), "1", "Fig. 16", accuracy / math.log(2.0), "0.05 mm in the smaller error"
        )
        ours = Span.of(
            *(
                math.log2(at(heavy) / at(light))
                for at in (lambda c: forward_error(c)[-1], lambda c: forward_error(c, T_0=0.0)[-1])
            )
        )
        found.append(
            number_claim(
                f"ame2020.load_exponent_{bend}",
                "Fig. 16",
                f"exponent of the load in the forward error, {bend} deg",
                reported,
                ours,
                {
                    Verdict.CONTRADICTS: "no linear elastic model does that, whatever its EA and friction, preload "
                    "from 0 to 1.1 N"
                },
            )
        )
    return found


def _shape() -> list[Claim]:
    rise = forward_error("m05_180", rows=4)  # at 0, 1/3, 2/3 and all of the stroke
    peaks = []
    for n_t in (5.0, 6.67, 10.0):
        layered = forward_error("m05_180", rows=301, layers=1, n_t=n_t)
        peaks.append(float(np.argmax(layered)) / 300.0)
    return [
        statement_claim(
            "ame2020.shape",
            "Fig. 16",
            "error at 2/3 of the stroke less that at its end, Eqs (23), (30)",
            "mm",
            "the error grows to about 2/3 of the stroke, then falls",
            {"m05_180": Condition(float(rise[2] - rise[3]), ">=", 0.05)},
            {Verdict.CONTRADICTS: "with one radius for all layers the error does not depend on the stroke"},
        ),
        number_claim(
            "ame2020.peak",
            "Fig. 16",
            "place of the largest error over the stroke, radii growing by layer (ours), 5 to 10 turns a layer",
            REPORTED["ame2020.peak"],
            Span.of(*peaks),
            {Verdict.CONSISTENT: "turns per layer are not published; 6.67 turns put it at 2/3"},
        ),
    ]


def _reverse(reverse: dict[str, Span]) -> list[Claim]:
    found = []
    low = stiffness_band()[0]
    radius = kernel(MODEL).params("published").D / 2.0
    for case, span in reverse.items():
        value = REVERSE_MM[case]
        needed = low * lost_motion(case, changes_sides=True, slack=0.0, EA=low) / value
        reported = displacement(value, "Fig. 17")
        found.append(
            number_claim(
                f"ame2020.reverse_{case}",
                ("Fig. 17", "Fig. 15"),
                f"reverse error, elastic part of Eqs (32)-(36), {NAMES[case]}",
                reported,
                span,
                {Verdict.CONTRADICTS: f"{value / (2e3 * math.pi * radius):.1f} turns; it takes EA = {needed:.0f} N"},
            )
        )
        found.append(
            open_claim(
                f"ame2020.slack_{case}",
                ("Fig. 17", "Fig. 15"),
                f"slack that the reverse error needs, {NAMES[case]}",
                Span.of(value - span.hi, value - span.lo),
                "no equation of the paper gives the slack of the loose tendon: it is an input",
                unit="mm",
            )
        )
    for case, value in MAXIMUM_REVERSE_MM.items():
        found.append(
            number_claim(
                f"ame2020.maximum_reverse_{case}",
                "Fig. 14",
                f"largest reverse error, {NAMES[case]}",
                displacement(value, "text to Fig. 14"),
                reverse[case],
                {Verdict.CONTRADICTS: f"and it is {REVERSE_MM[case] / value:.0f} times below Fig. 17 for the same run"},
            )
        )
    return found


def _same_bend(forward: dict[str, Span], reverse: dict[str, Span]) -> list[Claim]:
    found = []
    for way, figure, spans, other in (("forward", 16, forward, FORWARD_MM), ("reverse", 17, reverse, REVERSE_MM)):
        for case, value in zip(SAME_BEND, SAME_BEND_MM[way], strict=True):
            found.append(
                number_claim(
                    f"ame2020.same_bend_{way}_{case}",
                    "Fig. 18",
                    f"{way} error, {NAMES[case]}",
                    displacement(value, "text to Fig. 18"),
                    spans[case],
                    {Verdict.CONTRADICTS: f"Fig. {figure} has {other[case]:g} mm for the same case"},
                )
            )
    return found


def _residuals() -> list[Claim]:
    found = []
    for item, case in (("Fig. 19", "m05_180"), ("Fig. 20", "m10_540")):
        wanted, path_only = compensated_error(case, winding_strain=0)
        _, exact = compensated_error(case)
        turn = int(np.argmax(wanted))
        errors = [
            Span.of(*(float(np.abs(e[part]).max()) for e in (exact, path_only)))
            for part in (slice(1, turn + 1), slice(turn + 2, None))
        ]
        ranges = (("forward", Span(*RESIDUAL_FORWARD_MM)), ("reverse", Span(*RESIDUAL_REVERSE_MM)))
        for (way, printed_range), error in zip(ranges, errors, strict=True):
            reported = Reported(printed_range, "mm", f"text to {item}", 0.005, "half of the last printed digit")
            found.append(
                open_claim(
                    f"ame2020.residual_{way}_{case}",
                    item,
                    f"{way} error with compensation, {NAMES[case]}; ours: from exact parameters to no winding strain",
                    error,
                    "no equation gives the residual: what differs between plant and compensator is not published",
                    reported=reported,
                )
            )
    return found
