"""MSSP 2015: magnitude and smoothness of the friction force."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from ...kernels.kernel import kernel
from ...report import Line
from ...scenarios.papers import MMT_MSE_PERIODIC, TRIALS
from ..claims import Claim, Condition, Reported, Span, Verdict, number_claim, open_claim, statement_claim
from ..draw import panels, plot
from ..motions import FloatArray, Motion, friction
from ..numbers import REPORTED

WIRES, WIRE_M, STRENGTH_PA = 49, 0.27e-3 / 9.0, 2.0e9
"""Tendon WR7x7D0.27: 49 wires, nine across the rope; strength of hard-drawn spring wire (ours)."""


def break_load() -> float:
    """Upper estimate of the load that breaks the tendon [N]."""
    return WIRES * math.pi / 4.0 * WIRE_M**2 * STRENGTH_PA


def friction_claims(
    motions: Mapping[str, Motion],
    raw: Mapping[str, FloatArray],
    items: Mapping[str, str],
    identified: Mapping[str, str],
) -> list[Claim]:
    """Claims on Figs 7, 8, 11 and 13."""
    periodic = raw["periodic"]
    amplitude = {name: float(np.abs(f).max()) for name, f in raw.items()}
    std = float(np.mean(TRIALS["periodic"]["friction_std_N"]))
    scaled = friction("PairedTsmFriction", motions["periodic"], "published")
    return [
        statement_claim(
            "mssp2015.newton",
            (items["periodic"], identified["periodic"]),
            "half the largest |F|, the least tension in one of the two tendons",
            "N",
            "F is in newton",
            {"periodic": Condition(0.5 * amplitude["periodic"], "<=", break_load())},
            {
                Verdict.CONTRADICTS: f"the 0.27 mm rope breaks near {break_load():.0f} N, and the reported deviation "
                f"of {std:.3f} N would be {100.0 * std / amplitude['periodic']:.2f} % of the amplitude"
            },
        ),
        number_claim(
            "mssp2015.newton_mm",
            items["periodic"],
            "amplitude of F read as N.mm over the 25 mm pulley, beside that of MMT 2015",
            _mmt_amplitude(),
            float(np.abs(scaled).max()),
            {
                Verdict.CONSISTENT: f"the reported deviation is then {100.0 * std / np.abs(scaled).max():.1f} % of the "
                f"amplitude; MMT 2015 has {100.0 * math.sqrt(MMT_MSE_PERIODIC) / _mmt_force()[1]:.1f} %"
            },
        ),
        open_claim(
            "mssp2015.friction_range",
            (items["periodic"], identified["periodic"]),
            "range of F, periodic motion, raw",
            Span.of(periodic.min(), periodic.max()),
            "the unit of the identified parameters is not determined, see above; the axis is not legible in our copy",
            unit="N",
        ),
        open_claim(
            "mssp2015.friction_range_non_periodic",
            (items["non_periodic"], identified["non_periodic"]),
            "range of F, non-periodic motion, raw",
            Span.of(raw["non_periodic"].min(), raw["non_periodic"].max()),
            "as for the periodic motion",
            unit="N",
        ),
        open_claim(
            "mssp2015.friction_error",
            items["periodic"],
            "friction error, peak to peak",
            None,
            "the error is against measurements that are not published",
            reported=REPORTED["mssp2015.friction_error"],
        ),
        *(_smooth(name, motions[name], raw[name], identified[name]) for name in motions),
    ]


def _mmt_force() -> tuple[float, float]:
    """Amplitudes of MMT 2015's friction on its own motion, of both directions [N]."""
    from ..mmt2015.paper import MODEL, PERIODIC
    from ..motions import sines

    force = friction(MODEL, sines(PERIODIC, 10.0, 1e-3))
    return float(-force.min()), float(force.max())


def _mmt_amplitude() -> Reported:
    low, high = _mmt_force()
    return Reported(
        Span.of(low, high),
        "N",
        "the same tendon and sheath in MMT 2015, computed in this run",
        0.0,
        "no reading: an order of magnitude",
    )


def _smooth(name: str, motion: Motion, force: FloatArray, item: str) -> Claim:
    """Largest jump of F where the acceleration changes sign, from the run and from |k_x x (1 - tanh v)|."""
    p = kernel("PairedTsmFriction").params("raw")
    turns = np.flatnonzero(np.sign(motion.a[1:]) * np.sign(motion.a[:-1]) < 0.0)
    turns = turns[turns > 1]
    around = np.abs(force[turns + 1] - force[turns])
    before = np.abs(force[turns] - force[turns - 1])
    jump = float(np.max(around - before, initial=0.0))
    closed = float(np.max(np.abs(p.k_x * motion.x[turns] * (1.0 - np.tanh(motion.v[turns]))), initial=0.0))
    return statement_claim(
        f"mssp2015.smooth_{name}",
        item,
        f"largest jump of F where a changes sign, {name.replace('_', '-')} motion, raw",
        "N",
        "the model functions are smooth",
        {"run": Condition(jump, "<=", float(np.mean(np.abs(np.diff(force)))))},
        {
            Verdict.CONTRADICTS: f"F jumps by |k_x x (1 - tanh v)|, up to {closed:.3g}, where a turns away from x = 0 "
            "(the limit is the mean change of F in a step)",
            Verdict.REPRODUCED: "a sine changes the sign of its acceleration at x = 0 only",
        },
    )


def friction_figure(motion: Motion, raw: FloatArray) -> go.Figure:
    """Friction as in Figs 11 and 13."""
    kept = motion.time >= 10.0
    scaled = friction("PairedTsmFriction", motion, "published")
    name = "F / 25 (N.mm over the pulley)"
    return panels(
        [
            plot(
                [Line("F as printed", motion.time[kept], raw[kept])], "Estimated friction", "time [s]", "F as printed"
            ),
            plot([Line(name, motion.time[kept], scaled[kept])], "read as N.mm over 25 mm", "time [s]", "F [N]"),
            plot(
                [Line("F as printed", np.degrees(motion.v)[kept], raw[kept])],
                "over velocity",
                "velocity [deg/s]",
                "F as printed",
            ),
            plot([Line(name, np.degrees(motion.v)[kept], scaled[kept])], "over velocity", "velocity [deg/s]", "F [N]"),
        ]
    )
