"""MSSP 2015: what its equations and numbers say of themselves, run as FMUs on imposed motions."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...cosim.trajectory import Trajectory
from ...kernels.kernel import kernel
from ...scenarios import mssp_feedforward
from ..claims import Claim, Method, open_claim, statement_claim
from ..verdict import Condition, Kind, Span, Verdict
from .imposed import EXPERIMENT, TURN
from .printed import FRICTION, IDENTIFIED, MOTIONS, WIDTH


def equation_claims(runs: Mapping[str, Trajectory]) -> list[Claim]:
    """Claims that need no rig."""
    return [
        _per_degree(runs["periodic"]),
        _monotone(runs["ramp"]),
        _eliminated(runs["periodic"]),
        _count(),
        *(_smooth(motion, runs[motion]) for motion in MOTIONS),
        _range(runs),
    ]


def _per_degree(run: Trajectory) -> Claim:
    error = np.degrees(run.columns["reference.y"] - run.columns["backlash.x_out"])[EXPERIMENT.window(run.time)]
    p = kernel("PairedTsmBacklash").params("published")
    closed = math.degrees(2.0 * mssp_feedforward.loop_height(p.beta, p.alpha))
    in_degrees = 2.0 * abs(p.beta) / p.alpha
    return statement_claim(
        "mssp2015.reading_degrees",
        (IDENTIFIED["periodic"], "Fig. 10"),
        "width of the identified loop if alpha is per degree, the unit of the figures",
        "deg",
        f"{WIDTH['periodic'].text} deg, and 'the unit of displacement ... in term of degree'",
        {"per degree": Condition(in_degrees, ">=", WIDTH["periodic"].span.lo)},
        kind=Kind.READING,
        why={
            Verdict.READING_EXCLUDED: f"alpha is per radian: then the loop is {np.ptp(error):.3f} deg wide (closed "
            "form "
            f"{closed:.3f} deg without c)"
        },
        method=Method.CO_SIMULATION,
    )


def _monotone(run: Trajectory) -> Claim:
    x, out = run.columns["reference.y"], run.columns["backlash.x_out"]
    turn = int(np.argmax(x))
    slope = (out[turn + 1] - out[turn]) / (x[turn + 1] - x[turn])
    back, until = np.max(out[turn:]) - out[turn], TURN - x[turn + int(np.argmax(out[turn:]))]
    return statement_claim(
        "mssp2015.monotone",
        "Eq. (8)",
        "slope of the output just after a reversal, published set",
        "1",
        "'monotonically increasing and decreasing between the two extrema' for alpha > 0, B > 0, c > B",
        {"published set": Condition(float(slope), ">=", 0.0)},
        why={
            Verdict.INTERNAL_ERROR: f"the output runs backwards by {math.degrees(back):.3f} deg over the first "
            f"{math.degrees(until):.2f} deg; it takes B >= c/2"
        },
        method=Method.CO_SIMULATION,
    )


def _eliminated(run: Trajectory) -> Claim:
    window = EXPERIMENT.window(run.time)
    law_1, law_2 = (float(np.ptp(np.degrees(run.columns[f"error_{law}.y"][window]))) for law in (1, 2))
    p = kernel("PairedTsmBacklash").params("published")
    y, ratio = np.linspace(0.0, 1.0, 100001), 2.0 * abs(p.beta)
    most = math.degrees(ratio / p.alpha * float(np.max(y * -np.expm1(-ratio / p.c * (1.0 - y)))))
    return statement_claim(
        "mssp2015.eliminated",
        "Eq. (24)",
        "error with Eqs (23), (25) and exact parameters, peak to peak",
        "deg",
        "'the error between the reference trajectory x_r and displacement at the distal end x_out can be eliminated'",
        {"law as printed": Condition(law_1, "<=", 1e-6)},
        why={
            Verdict.INTERNAL_ERROR: f"Eq. (25) feeds the observer with x_r, the plant gets x_FF: {most:.4f} deg stay "
            f"either way; fed with x_FF {law_2:.1g} deg stay"
        },
        method=Method.CO_SIMULATION,
    )


def _count() -> Claim:
    models = ("PairedTsmFriction", "raw"), ("PairedTsmBacklash", "published")
    listed = sum(len(kernel(model).presets[preset].printed) for model, preset in models)
    return statement_claim(
        "mssp2015.parameters",
        "Section 5",
        "number of identified parameters, counted in Section 7",
        "1",
        "'the 10 model parameters, which consist of seven parameters of the friction force and three ...'",
        {"counted": Condition(float(listed), "<=", 10.0)},
        why={Verdict.INTERNAL_ERROR: "Section 7 lists eight of friction and three of backlash"},
        method=Method.PRINT,
    )


def _smooth(motion: str, run: Trajectory) -> Claim:
    """Largest jump of F where the acceleration changes sign, from the run and from |k_x x (1 - tanh v)|."""
    x, v, a = (run.columns[f"reference.{name}"] for name in ("y", "dy", "ddy"))
    force = run.columns["friction.F"]
    p = kernel("PairedTsmFriction").params("raw")
    turns = np.flatnonzero(np.sign(a[1:]) * np.sign(a[:-1]) < 0.0)
    turns = turns[turns > 1]
    around, before = np.abs(force[turns + 1] - force[turns]), np.abs(force[turns] - force[turns - 1])
    jump = float(np.max(around - before, initial=0.0))
    closed = float(np.max(np.abs(p.k_x * x[turns] * (1.0 - np.tanh(v[turns]))), initial=0.0))
    return statement_claim(
        f"mssp2015.smooth_{motion}",
        (IDENTIFIED[motion], FRICTION[motion]),
        f"largest jump of F where a changes sign, {motion.replace('_', '-')} motion, over a mean step of F",
        "1",
        "'The proposed friction model, unlike current approaches in the literature, is smooth'",
        {"run": Condition(jump / float(np.mean(np.abs(np.diff(force)))), "<=", 1.0)},
        why={
            Verdict.INTERNAL_ERROR: f"F jumps by |k_x x (1 - tanh v)|, up to {closed:.3g} as printed, where a turns "
            "away from x = 0",
            Verdict.REPRODUCED: "a sine changes the sign of its acceleration at x = 0 only",
        },
        method=Method.CO_SIMULATION,
    )


def _range(runs: Mapping[str, Trajectory]) -> Claim:
    spans = {m: Span.of(runs[m].columns["friction.F"].min(), runs[m].columns["friction.F"].max()) for m in MOTIONS}
    both = Span.of(*(end for span in spans.values() for end in span.ends))
    return open_claim(
        "mssp2015.friction_range",
        (*FRICTION.values(), *IDENTIFIED.values()),
        "range of F as Eqs (6), (7) give it with the printed numbers, both motions",
        f"periodic {spans['periodic']}, non-periodic {spans['non_periodic']}; the axes are not legible in our copy and "
        "the unit of the identified numbers is in doubt, see Fig. 11",
        ours=both,
        unit="N as printed",
        method=Method.CO_SIMULATION,
    )
