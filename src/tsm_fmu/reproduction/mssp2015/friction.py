"""MSSP 2015: unit of the friction force, its estimate in the haptic loop, and what it has to do with the backlash."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...cosim.ssp import Case
from ...cosim.system import Connection, Experiment, System
from ...cosim.trajectory import Trajectory
from ...kernels.kernel import kernel
from ...scenarios import mssp_haptic
from ...scenarios.papers import TRIALS
from ..claims import Claim, Method, Open, open_claim, statement_claim
from ..loops import FMUS, co_simulate
from ..verdict import Condition, Kind, Span, Verdict
from .completion import Completion, system
from .printed import FRICTION, FRICTION_ERROR, MOTIONS, TABLES, WIDTH, table

EXPERIMENT = Experiment(stop=20.0, step=2e-3, evaluate_from=10.0, tracking_error="error.y", loops="delay")
WIRES, WIRE_M = 49, 0.27e-3 / 9.0
"""Tendon WR7x7D0.27: 49 wires, nine across the rope."""
STRENGTH_PA = (2241e6, 2448e6)
"""Tensile strength of stainless spring wire of 0.03 mm."""
STANDARD = "ASTM A313, type 302 wire of this size"

PLANTS: dict[str, dict[str, float]] = {
    "level 3 % higher": {"k_zeta": 1.03 * 127.9493},
    "no offset lambda": {"lambda": 0.0},
    "Dahl presliding": {"sigma": 1.0, "n": 1.0},
}
"""Friction of the plant in the haptic loop: not the model of the estimator, which keeps the published numbers."""
RECORD = ("motor.omega", "friction.F", "haptic.tau_out", "load.tau", "haptic.F", "friction.tau_drive")


def haptic_runs(completion: Completion, quick: bool) -> dict[str, Trajectory]:
    """The loop of Fig. 9 with plants that are not the estimator's model; ``motion.plant``."""
    cases: dict[str, Case] = {}
    for motion in MOTIONS:
        loop = mssp_haptic.with_estimators(system(completion, motion, compensated=True), FMUS, completion.backlash)
        for plant, values in list(PLANTS.items())[: 1 if quick else None]:
            cases[f"{motion}.{plant}"] = (_with_plant(loop, values), EXPERIMENT)
    return co_simulate(cases, RECORD)


def _with_plant(loop: System, values: Mapping[str, float]) -> System:
    parts = tuple(
        replace(c, parameters={**c.parameters, **values}) if c.name == "friction" else c for c in loop.components
    )
    return replace(loop, components=parts)


def frictionless(completion: Completion) -> dict[str, Trajectory]:
    """The loop without feedforward, and the same with the friction taken off the motor as if exactly compensated."""
    loop = system(completion, "periodic", compensated=False)
    kept = tuple(w for w in loop.connections if w.target != "motor.tau_load")
    free = replace(loop, connections=(*kept, Connection("load.tau", "motor.tau_load")))
    return co_simulate({"with friction": (loop, EXPERIMENT), "without": (free, EXPERIMENT)}, ["error.y"])


def friction_claims(
    imposed: Mapping[str, Trajectory], haptic: Mapping[str, Trajectory], free: Mapping[str, Trajectory]
) -> list[Claim]:
    """Claims on Figs 9, 11 and 13 and the friction columns of the tables."""
    return [_newton(imposed["periodic"]), *_estimates(haptic), _no_help(free)]


def _newton(run: Trajectory) -> Claim:
    force = run.columns["friction.F"]
    needed = 0.5 * float(np.abs(force).max())
    area = WIRES * math.pi / 4.0 * WIRE_M**2
    low, high = (area * strength for strength in STRENGTH_PA)
    std = reported_deviation()
    share = 100.0 * std / (2.0 * needed)
    return statement_claim(
        "mssp2015.newton",
        (FRICTION["periodic"], "Fig. 7"),
        "half the largest |F|, the least tension in one of the two tendons, against the load that breaks the rope",
        "N",
        "F is in newton ('peak-to-peak of 1.4216 N')",
        {f"{s:.0f} MPa": Condition(needed, "<=", load) for s, load in ((2241, low), (2448, high))},
        assumed=(Open("strength of the wire", "2241 to 2448 MPa", STANDARD),),
        why={
            Verdict.NOT_DETERMINED: f"the tendon would work at its breaking load, and the reported deviation of "
            f"{std:.3f} N would be {share:.2f} % of the amplitude; read as N.mm over the 25 mm pulley it is "
            f"{25.0 * share:.1f} %, as in MMT 2015"
        },
        method=Method.CO_SIMULATION,
    )


def _estimates(runs: Mapping[str, Trajectory]) -> list[Claim]:
    errors = {name: _error(run) for name, run in runs.items()}
    missing = (
        "the reported error is against measurements that are not published; ours is of plants that differ from the "
        "estimator's model by " + ", ".join(PLANTS)
    )
    plant = Open("what the plant has that the model has not", ", ".join(PLANTS), "assumed, a few per cent each")
    claims = [
        open_claim(
            "mssp2015.friction_error",
            (FRICTION["periodic"], "Fig. 9"),
            "error of the estimated friction, peak to peak, haptic loop",
            missing,
            ours=Span.of(*(float(np.ptp(e)) for name, e in errors.items() if name.startswith("periodic."))),
            prints=[FRICTION_ERROR],
            assumed=(plant,),
            method=Method.CO_SIMULATION,
        )
    ]
    for motion in MOTIONS:
        for column, statistic, description in (
            ("friction_std", np.std, "standard deviation"),
            ("friction_mean", np.mean, "mean"),
        ):
            claims.append(
                open_claim(
                    f"mssp2015.{motion}_{column}",
                    (TABLES[motion], FRICTION[motion]),
                    f"error of the estimated friction, {description}, {motion.replace('_', '-')} motion, haptic loop",
                    missing,
                    ours=Span.of(*(float(statistic(e)) for name, e in errors.items() if name.startswith(f"{motion}."))),
                    prints=[table(motion, column)],
                    assumed=(plant,),
                    method=Method.CO_SIMULATION,
                )
            )
    return claims


def _error(run: Trajectory) -> np.ndarray:
    return mssp_haptic.friction_error(run, "haptic")[EXPERIMENT.window(run.time)]


def _no_help(runs: Mapping[str, Trajectory]) -> Claim:
    widths = {
        name: float(np.ptp(np.degrees(run.columns["error.y"][EXPERIMENT.window(run.time)])))
        for name, run in runs.items()
    }
    change = abs(widths["with friction"] - widths["without"])
    return statement_claim(
        "mssp2015.no_help",
        ("Section 9", "Fig. 10"),
        "change of the error without feedforward when the motor is relieved of all friction",
        "deg",
        "'if we can reduce the friction, we cannot minimize the backlash hysteresis band'",
        {"best set": Condition(change, "<=", WIDTH["periodic"].span.width)},
        kind=Kind.MEASUREMENT,
        assumed=(Open("plant and drive", "the best set of Fig. 10", "the paper prints no controller"),),
        why={
            Verdict.CONSISTENT: f"{widths['with friction']:.3f} and {widths['without']:.3f} deg print alike: with a "
            "position loop at the motor, friction is the motor's burden and the backlash the tendon's"
        },
        method=Method.CO_SIMULATION,
    )


def reported_deviation() -> float:
    """Mean of Table 1's standard deviations of the friction error [N]."""
    return float(np.mean([trial.value for trial in TRIALS["periodic"]["friction_std"]]))


def radius() -> float:
    """Of the pulley [m]."""
    return float(kernel("PairedTsmFriction").params("published").R)
