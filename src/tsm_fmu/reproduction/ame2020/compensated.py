"""AME 2020, Figs 19 and 20: what compensation leaves on the way there and in the hysteresis stage, from its loop.

Two ways: the gain and offset that follow from the follower's first displacement (way there only), and the feedforward
of Eqs (39), (40), `LebusCompensator`, with and without the strain of the tendon that is wound.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...cosim.trajectory import Trajectory
from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ...report import Figure, Line, Table
from ...scenarios import lebus_drive
from ...scenarios.papers import WEIGHT_N
from ..claims import Claim, Method, Open, number_claim
from ..draw import plot
from ..verdict import Span, Verdict, number
from .loops import Drive, error, travel
from .printed import RESIDUAL

PAIR = {"Fig. 19": "m05_180", "Fig. 20": "m10_540"}
FIRST = "first displacement"
EQ_39 = {"Eq. (39)": {}, "Eq. (39), no winding strain": {"winding_strain": 0}}
WAYS = (FIRST, *EQ_39)
STAGES = {"forward": "there", "reverse": "hysteresis stage"}
BEGUN_MM = 20.0
"""Before it the driver takes up what it measures."""
KNOWN = Open("strain of the wound tendon", "known to the compensator or not", "not in Eq. (39)")
LAYERS = Open("layers of the winding", "one radius, or 5 to 10 turns a layer", "not printed")
RATE = Open("highest speed of the motor", "0.25 m/s", "not printed; it sets how long the slack takes only")


class Left(NamedTuple):
    """Error of one stage [mm]: mean of its size, standard deviation, largest."""

    mean: float
    sd: float
    most: float


def drives() -> dict[str, Drive]:
    """``way.case``: both cases, each compensated in each way."""
    found = {}
    for case in PAIR.values():
        found[f"{FIRST}.{case}"] = Drive(case, there=True, command=from_first_displacement(case))
        for way, values in EQ_39.items():
            found[f"{way}.{case}"] = Drive(case, compensator=values)
    return found


def from_first_displacement(case: str) -> tuple[float, float]:
    """Gain and offset of the command, from what the driver travels before the follower moves ("initial stage").

    The travel s0 is the path's stretch, (T_a0 I - T_0 L)/EA: that gives T_a0, and with it the strain that is wound.
    The encoder of the follower resolves 0.1 deg.
    """
    p = kernel("LebusTransmission").params(case)
    lam = p.mu * math.radians(float(case.rpartition("_")[2]))
    length = p.L[0]
    integral = length * -math.expm1(-lam) / lam
    pull = WEIGHT_N[case] * math.exp(lam)
    true = (pull * integral - p.T_0 * length) / p.EA
    count = math.radians(0.1) * p.D / 2.0
    measured = count * round(true / count)
    strain = ((measured * p.EA + p.T_0 * length) / integral - p.T_0) / p.EA
    return 1.0 + strain, measured / (p.D / 2.0)


def compensated_error(run: Trajectory) -> FloatArray:
    """Commanded minus followed tendon [mm], the communication step left out by which the command is late."""
    return lebus_drive.error_mm(run, late=True)


def left(runs: Mapping[str, Trajectory], case: str) -> dict[tuple[str, str], Left]:
    """What stays, by stage and way; without compensation under ``without``."""
    found = {}
    for way in ("without", *WAYS):
        run = runs[f"cycle.{case}" if way == "without" else f"{way}.{case}"]
        off = error(run) if way == "without" else compensated_error(run)
        variant = lebus_drive.Variant(compensator=None if way == "without" else {})
        stages = {
            "forward": (travel(run) > BEGUN_MM) & (run.time < lebus_drive.TURN),
            "reverse": run.time > lebus_drive.settled_from(case, variant),
        }
        for stage, rows in stages.items():
            if rows.any():
                e = off[rows]
                found[stage, way] = Left(float(np.mean(np.abs(e))), float(np.std(e)), float(np.abs(e).max()))
    return found


def residual_claims(runs: Mapping[str, Trajectory]) -> list[Claim]:
    """Rows on the two printed ranges."""
    both = [left(runs, case) for case in PAIR.values()]
    layered = max(float(np.abs(error(run)).max()) for name, run in runs.items() if name.startswith("layers."))
    claims = []
    for stage, stage_text in STAGES.items():
        own = {way: [found[stage, way].mean for found in both] for way in WAYS if (stage, way) in both[0]}
        means_text = ", ".join(f"{way} {number(min(v))} and {number(max(v))}" for way, v in own.items())
        ends = [v for values in own.values() for v in values] + ([layered] if stage == "forward" else [])
        claims.append(
            number_claim(
                f"ame2020.residual_{stage}",
                tuple(PAIR),
                f"error that compensation leaves, {stage_text}",
                RESIDUAL[stage],
                Span.of(*ends),
                assumed=(KNOWN, LAYERS) if stage == "forward" else (KNOWN, RATE),
                why={
                    Verdict.NOT_DETERMINED: f"a compensator that knows the drive leaves what the stepper gives way, "
                    f"one that does not know the wound strain leaves that: mean {means_text} mm"
                    + (f"; layers that it does not know leave up to {number(layered)} mm" if stage == "forward" else "")
                },
                method=Method.CO_SIMULATION,
            )
        )
    return claims


def residual_table(runs: Mapping[str, Trajectory], item: str) -> Table:
    """Mean, deviation and largest error by stage and way, as Figs 19(b) and 20(b) show them."""
    rows = [
        [
            STAGES[stage],
            way,
            number(found.mean),
            number(found.sd),
            number(found.most),
            "" if way == "without" else RESIDUAL[stage].text,
        ]
        for (stage, way), found in sorted(left(runs, PAIR[item]).items())
    ]
    return Table(
        ["stage", "compensation", "mean [mm]", "standard deviation [mm]", "largest [mm]", "printed [mm]"],
        rows,
        "Errors with stepper motor, wheel friction and weight; one printed range is for both cases.",
    )


def residual_figures(runs: Mapping[str, Trajectory], item: str) -> tuple[Figure, ...]:
    """Errors there and back with compensation, and their mean and standard deviation by stage."""
    case = PAIR[item]
    bands = {s: [(f"printed: {RESIDUAL[s].text} mm", *RESIDUAL[s].span.ends)] for s in STAGES}
    there, back = [], []
    for way in WAYS:
        run = runs[f"{way}.{case}"]
        on_way = (run.time < lebus_drive.TURN) & (run.time > 0.0)
        there.append(Line(way, travel(run)[on_way], compensated_error(run)[on_way]))
        if way != FIRST:
            settled = run.time > lebus_drive.settled_from(case, lebus_drive.Variant(compensator={}))
            back.append(Line(way, 785.0 - travel(run)[settled], compensated_error(run)[settled]))
    bars = []
    for k, way in enumerate(WAYS):
        at, heights = [], []
        for place, stage in enumerate(STAGES, 1):
            found = left(runs, case).get((stage, way))
            if found:
                x = place + 0.1 * (k - 1)
                at += [x - 0.03, x + 0.03, x, x, x, math.nan]
                heights += [found.mean, found.mean, found.mean, found.mean - found.sd, found.mean + found.sd, math.nan]
        bars.append(Line(way, at, heights))
    return (
        plot(there, "(a) Forward, compensated", "s_in [mm]", "error [mm]", bands=bands["forward"]),
        plot(back, "(a) Back, slack taken up", "travel back [mm]", "error [mm]", bands=bands["reverse"]),
        plot(
            bars,
            "(b) Mean and standard deviation",
            "stage: 1 forward, 2 hysteresis",
            "size of the error [mm]",
            bands=[(f"printed, {STAGES[s]}: {RESIDUAL[s].text} mm", *RESIDUAL[s].span.ends) for s in STAGES],
        ),
    )
