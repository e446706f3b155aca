"""ICINCO 2013: Dahl friction with branched sliding force, 1 and 0.8 Hz."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from ...kernels.kernel import kernel
from ...report import Line
from ..claims import Claim, Condition, Span, Verdict, open_claim, statement_claim
from ..draw import panels, plot
from ..motions import FloatArray, Motion, friction, sines
from ..result import PaperResult

MODEL = "SingleTsmDahl"
AMPLITUDES = (1e-3, 2e-3, 5e-3, 10e-3)
"""[m]; the paper prints none."""
DRAWN = 5e-3
FREQUENCIES = {"Fig. 6": 1.0, "Fig. 7": 0.8}


def result() -> PaperResult:
    runs = {item: {a: _cycles(a, f) for a in AMPLITUDES} for item, f in FREQUENCIES.items()}
    claims = [claim for item, cycles in runs.items() for claim in _ranges(item, cycles)]
    force = runs["Fig. 6"][DRAWN][1]
    return PaperResult(
        (*claims, _level(), _signs(force), _steady()),
        {item: _figure(*cycles[DRAWN]) for item, cycles in runs.items()},
        texts={
            item: f"Drawn for an amplitude of {1e3 * DRAWN:g} mm at {f:g} Hz; the amplitude is not published."
            for item, f in FREQUENCIES.items()
        },
    )


def _cycles(amplitude: float, frequency: float) -> tuple[Motion, FloatArray]:
    motion = sines([(amplitude, frequency)], 3.0 / frequency, 1e-4 / frequency)
    return motion, friction(MODEL, motion)


def _limit_cycle(motion: Motion, force: FloatArray) -> FloatArray:
    return force[motion.time > motion.time[-1] / 3.0]


def _ranges(item: str, cycles: dict[float, tuple[Motion, FloatArray]]) -> list[Claim]:
    frequency = FREQUENCIES[item]
    ends = {a: _limit_cycle(*run) for a, run in cycles.items()}
    millimetres = f"{1e3 * min(ends):g} to {1e3 * max(ends):g} mm"
    missing = f"the amplitude is not published, nor are the measurements; amplitudes here are {millimetres}"
    key = item[-1]
    return [
        open_claim(
            f"icinco2013.fig{key}_high",
            item,
            f"largest F of the limit cycle at {frequency:g} Hz",
            Span.of(*(f.max() for f in ends.values())),
            missing,
            unit="N",
        ),
        open_claim(
            f"icinco2013.fig{key}_low",
            item,
            f"lowest F of the limit cycle at {frequency:g} Hz",
            Span.of(*(f.min() for f in ends.values())),
            missing,
            unit="N",
        ),
    ]


def _level() -> Claim:
    k = kernel(MODEL)
    p = k.params("published")
    speeds, rates = np.geomspace(1e-9, 0.1, 60), np.geomspace(1e-9, 1.0, 40)
    lowest = min(
        k.module.sliding_force(p, way * v, s * a, s) for v in speeds for a in rates for way in (-1, 1) for s in (-1, 1)
    )
    return statement_claim(
        "icinco2013.positive",
        "Table 1",
        "lowest F_f of the identified set",
        "N",
        "F_f is the force in the sliding regime",
        {"published set": Condition(lowest, ">=", 1e-9)},
        {Verdict.REPRODUCED: "the set is bounded as printed, |F| <= max(|F at the start|, sup F_f)"},
    )


def _signs(force: FloatArray) -> Claim:
    return statement_claim(
        "icinco2013.balance",
        "Eq. (1)",
        "largest F = -(T_in + T_out) in the cycle",
        "N",
        "T_in + T_out + F = 0 with tensions from load cells",
        {"tensions >= 0": Condition(float(force.max()), "<=", 0.0)},
        {
            Verdict.CONTRADICTS: "two tensions cannot add up to less than nothing; F = T_in - T_out (MMT 2015 Eq. (1)) "
            "serves, Eq. (1) holds for signed axial forces only"
        },
    )


def _steady() -> Claim:
    k = kernel(MODEL)
    p = k.params("published", {"mu3": 0.0})
    v = 3e-3
    rows = np.tile([v, 0.0, 0.0, 0.0], (2, 1))
    force = k.simulate(p, np.array([0.0, 100.0]), rows)[-1, 0]
    level = k.module.sliding_force(p, v, 0.0, 0.0)
    zeta = force / (p.sigma * 1e-3)
    return statement_claim(
        "icinco2013.steady",
        "Section 3.2",
        "|zeta/F_f - 1| after 100 s at 3 mm/s",
        "1",
        "at steady state zeta = F_c",
        {"Eq. (4)": Condition(abs(zeta / level - 1.0), "<=", 1e-6)},
        {
            Verdict.CONTRADICTS: f"by Eq. (4) it is sigma zeta that settles there: |sigma zeta/F_f - 1| = "
            f"{abs(force / level - 1.0):.1g}"
        },
    )


def _figure(motion: Motion, force: FloatArray) -> go.Figure:
    x, v = motion.x * 1e3, motion.v * 1e3
    last = motion.time > motion.time[-1] / 3.0
    return panels(
        [
            plot([Line("model", motion.time, force)], "Friction over time", "time [s]", "F [N]"),
            plot([Line("model", v[last], force[last])], "over velocity", "velocity [mm/s]", "F [N]"),
            plot([Line("model", x[last], force[last])], "over position", "position [mm]", "F [N]"),
        ],
        columns=3,
    )
