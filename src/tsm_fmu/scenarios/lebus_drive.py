"""LeBus drive over a double tendon-sheath, there and back, without and with compensation: Adv. Mech. Eng. 2020.

::

    reference (785 mm there and back, 0.05 m/s) [-> compensator] -> driver angle -> transmission -> follower
    load schedule: weight m g on the follower -> tau_load, and to the compensator as measured load tension

The stepper motor is ideal: the driver wheel is where it is commanded. Its micro-stepping is not published; full steps
of 1.8 deg would be 0.39 mm of tendon. How the weight hangs is not published either, and decides what a reversal
shows:

* ``hanging``: m g on tendon a whichever way the driver turns. The weight turns the follower back at once, tendon b is
  never needed, and its slack is never seen: the lost motion is elastic.
* all others: the weight resists either way. It hangs on tendon a on the way there, is set down while the driver takes
  up the slack, and hangs on tendon b on the way back. Only so is there a lost motion of 156 to 206 mm, and its main
  part is the slack, a parameter taken from those very numbers (`LebusTransmission`): no prediction.

A compensator takes the slack up in one step of the driver (an ideal drive), so there the load changes sides at once.

Cases are named ``condition.variant``; conditions ``m05_180`` ... ``m10_540`` are load (0.5 or 1 kg) and total bend.
Variants: ``uncompensated``, ``hanging``, ``layers`` (winding radii grow by layer), ``compensated`` (compensator with
the parameters of the transmission), ``compensated_path_only`` (without winding strain: the equations of the paper, on
a transmission that has it) and ``compensated_lugre`` (with the LuGre term of Eq (40), on a transmission that has
none).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cosim.metric import CaseMetrics, Metric, Reported
from ..cosim.ssp import Case
from ..cosim.system import Component, Connection, Experiment, System, Value
from ..cosim.trajectory import Trajectory
from ..kernels.kernel import kernel
from .lebus_report import write_lebus_report
from .papers import (
    FORWARD_MM,
    MAXIMUM_FORWARD_MM,
    MAXIMUM_REVERSE_MM,
    NAMES,
    RESIDUAL_FORWARD_MM,
    RESIDUAL_REVERSE_MM,
    REVERSE_MM,
    SAME_BEND_MM,
    WEIGHT_N,
)

NAME = "lebus_drive"
FMUS = ("ReferenceSignal", "LebusCompensator", "LebusTransmission", "Sum")
RECORD = (
    "reference.y",
    "load.y",
    "transmission.theta_out",
    "transmission.T_a",
    "transmission.T_b",
    "transmission.elongation",
    "transmission.slack_b",
    "transmission.stage",
)
RADIUS = 0.0125
"""Radius of the wheels [m]."""
SPEED, STROKE = 0.05 / RADIUS, 0.785 / RADIUS
"""Of the driver wheel [rad/s, rad]."""
TURN = STROKE / SPEED
"""When the reference turns back [s]."""
STEP = 0.02
EXPERIMENT = Experiment(stop=1570 * STEP, step=STEP, evaluate_from=STEP)
"""Evaluated from the first step on: at the start no compensator has moved the driver yet."""
REPORTED: Reported = {
    f"{case}.uncompensated": {
        "forward_max": Metric(FORWARD_MM[case], "mm"),
        "reverse_max": Metric(REVERSE_MM[case], "mm"),
    }
    for case in FORWARD_MM
} | {
    f"{case}.compensated": {
        "forward_max": tuple(Metric(v, "mm") for v in RESIDUAL_FORWARD_MM),
        "reverse_max": tuple(Metric(v, "mm") for v in RESIDUAL_REVERSE_MM),
    }
    for case in ("m05_180", "m10_540")
}
"""AME 2020: Figs 16 and 17; Figs 19 and 20 (one pair of ranges for both cases)."""

CONTRADICTIONS = (
    *(
        (f"Fig. 13: largest forward error, {NAMES[c]}", largest, f"{FORWARD_MM[c]:g} in Fig. 16")
        for c, largest in MAXIMUM_FORWARD_MM.items()
    ),
    *(
        (f"Fig. 14: largest error in reverse hysteresis, {NAMES[c]}", largest, f"{REVERSE_MM[c]:g} in Fig. 17")
        for c, largest in MAXIMUM_REVERSE_MM.items()
    ),
    *(
        (
            f"Fig. 18: forward error, {mass}, one bend not named",
            value,
            f"{FORWARD_MM[f'{key}_180']:g} or {FORWARD_MM[f'{key}_540']:g} in Fig. 16",
        )
        for key, mass, value in zip(("m05", "m10"), ("0.5 kg", "1 kg"), SAME_BEND_MM["forward"], strict=True)
    ),
)
"""Numbers of the paper [mm] that others of its own contradict."""


@dataclass(frozen=True)
class Variant:
    """Changes to transmission and compensator (None: none), and whether the weight changes sides."""

    transmission: Mapping[str, Value]
    compensator: Mapping[str, Value] | None
    changes_sides: bool


VARIANTS = {
    "uncompensated": Variant({}, None, True),
    "hanging": Variant({}, None, False),
    "compensated": Variant({}, {}, True),
    "layers": Variant({"layers": 1}, None, True),
    "compensated_path_only": Variant({}, {"winding_strain": 0}, True),
    "compensated_lugre": Variant({}, {"lugre": 1}, True),
}
COMMON = ("uncompensated", "hanging", "compensated")
CASES = {
    "m05_180": tuple(VARIANTS),
    "m05_540": COMMON,
    "m10_180": COMMON,
    "m10_540": tuple(VARIANTS),
}


def cases(fmus: Mapping[str, Path]) -> dict[str, Case]:
    """All cases, from the FMUs by model name."""
    return {
        f"{condition}.{variant}": (loop(fmus, condition, variant), EXPERIMENT)
        for condition, variants in CASES.items()
        for variant in variants
    }


def loop(fmus: Mapping[str, Path], condition: str, variant: str) -> System:
    """Return the drive under one load and bend."""
    chosen = VARIANTS[variant]
    preset = kernel("LebusTransmission").presets[condition].si
    slack = kernel("LebusTransmission").params(condition).slack
    take_up = slack / (SPEED * RADIUS) if chosen.compensator is None else 0.0
    torque = WEIGHT_N[condition] * RADIUS
    weight: dict[str, Value] = {"k1": 0.5 * torque, "k2": 0.5 * torque, "k3": 0.0, "u3": 0.0}
    if not chosen.changes_sides:
        weight = {"k1": 0.0, "k2": 0.0, "k3": torque, "u3": 1.0}
    components = [
        Component("reference", fmus["ReferenceSignal"], {"kind": 2, "speed": SPEED, "stroke": STROKE, "cycles": 1.0}),
        Component("set_down", fmus["ReferenceSignal"], square_wave(TURN + 0.5 * STEP)),
        Component("hung_on_b", fmus["ReferenceSignal"], square_wave(TURN + 0.5 * STEP + take_up)),
        Component("load", fmus["Sum"], weight),
        Component("transmission", fmus["LebusTransmission"], {**preset, **chosen.transmission}),
    ]
    wires = [
        Connection("set_down.dy", "load.u1"),
        Connection("hung_on_b.dy", "load.u2"),
        Connection("load.y", "transmission.tau_load"),
    ]
    if chosen.compensator is None:
        wires += [Connection("reference.y", "transmission.theta_in")]
    else:
        components.insert(4, Component("compensator", fmus["LebusCompensator"], {**preset, **chosen.compensator}))
        wires += [
            Connection("reference.y", "compensator.theta_r"),
            Connection("load.y", "compensator.T_measured", 1.0 / RADIUS),
            Connection("compensator.theta_ff", "transmission.theta_in"),
        ]
    return System(tuple(components), tuple(wires), f"{condition}.{variant}")


def square_wave(turn: float) -> dict[str, Value]:
    """ReferenceSignal whose dy is 1 until ``turn`` [s] and -1 after it, for as long again."""
    return {"kind": 2, "speed": 1.0, "stroke": turn}


def quantities(name: str, run: Trajectory) -> dict[str, Metric]:
    """Errors of the follower [mm of tendon] on the way there and back.

    ``forward_*``: reference minus follower from the first step to the turn; ``reverse_max``: largest deviation on
    the way back; ``lost_motion``: how much that error falls from the turn on.
    """
    error = error_mm(run)
    there = (run.time > 0.5 * EXPERIMENT.step) & (run.time < TURN + 0.25 * STEP)
    back = run.time > TURN + 0.25 * STEP
    found: dict[str, float] = {}  # mm
    if there.any():
        worst = int(np.argmax(np.abs(error[there])))
        travel = 1e3 * RADIUS * run.columns["reference.y"]
        found |= {
            "forward_max": float(np.abs(error[there])[worst]),
            "forward_max_at": float(travel[there][worst]),
            "forward_end": float(error[there][-1]),
        }
    if back.any():
        found |= {
            "reverse_max": float(np.max(np.abs(error[back]))),
            "lost_motion": float(error[there][-1] - np.min(error[back])),
        }
    return {quantity: Metric(value, "mm") for quantity, value in found.items()}


def error_mm(run: Trajectory) -> NDArray[np.float64]:
    """Reference minus follower, as tendon on the wheel [mm]."""
    return 1e3 * RADIUS * (run.columns["reference.y"] - run.columns["transmission.theta_out"])


def comparison(cases: Mapping[str, Case]) -> dict[str, Any]:
    """Return what stands beside the metrics: the paper's numbers."""
    return {"reported": REPORTED}


def write_scenario_report(
    path: Path, runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]
) -> Path:
    """Write the HTML report; return its path."""
    found = {name: own.quantities for name, own in metrics.items()}
    errors = {name: error_mm(run) for name, run in runs.items()}
    return write_lebus_report(path, runs, found, errors, beside["reported"], CONTRADICTIONS)
