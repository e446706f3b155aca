"""LeBus drive over a double tendon-sheath, there and back, without and with compensation: Adv. Mech. Eng. 2020.

::

    reference (785 mm there and back, 0.05 m/s) -> stepper -> transmission <-> weight on the follower (HangingLoad)
                                                     ^---- torque: tau_in ----'|
                                                     '---- torque: tau_w -- winding (grooves, wheel friction)

The motor is the stepper motor of the paper on 16 micro-steps: the load turns it back by a part of a step. Its wheel has
the grooves of `LebusWinding`, on which the tendon slips by s_w (not published; 5 mm here), so that winding friction
loads the motor. A compensator asks for the whole slack in one step, which no stepper follows: the motion card sends
its pulses at 0.25 m/s at most (`RATE`, assumed), so the slack is taken up in about a second after the turn, while the
reference goes on, and then made up for. ``compensated_jump`` has no such limit: steps are lost and the slack stays.
``ideal_drive`` is ``uncompensated`` without motor and winding.

How the weight hangs is not published, and decides what a reversal shows:

* ``hanging``: m g on tendon a whichever way the driver turns. The weight turns the follower back at once, tendon b is
  never needed, and its slack is never seen: the lost motion is elastic.
* all others: the weight resists either way. It hangs on tendon a on the way there, is set down while the driver takes
  up the slack, and hangs on tendon b on the way back. Only so is there a lost motion of 156 to 206 mm, and its main
  part is the slack, a parameter taken from those very numbers (`LebusTransmission`): no prediction.

Cases are named ``condition.variant``; conditions ``m05_180`` ... ``m10_540`` are load (0.5 or 1 kg) and total bend.
Further variants: ``layers`` (winding radii grow by layer), ``compensated`` (compensator with the parameters of the
transmission), ``compensated_path_only`` (without winding strain: the equations of the paper, on a transmission that has
it) and ``compensated_lugre`` (with the LuGre term of Eq (40), on a transmission that has none).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
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
    MASS_KG,
    RESIDUAL_FORWARD_MM,
    RESIDUAL_REVERSE_MM,
    REVERSE_MM,
    SAME_BEND_MM,
    G,
)

NAME = "lebus_drive"
FMUS = (
    "ReferenceSignal",
    "LebusCompensator",
    "StepperMotor",
    "LebusTransmission",
    "LebusWinding",
    "HangingLoad",
    "Sum",
)
RECORD = (
    "reference.y",
    "load.tau",
    "load.h",
    "transmission.theta_out",
    "transmission.T_a",
    "transmission.T_b",
    "transmission.elongation",
    "transmission.slack_b",
    "transmission.stage",
    "stepper.theta",
    "compensator.theta_ff",
    "torque.y",
    "winding.F_w",
    "winding.layer",
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
        "reverse_settled": tuple(Metric(v, "mm") for v in RESIDUAL_REVERSE_MM),
    }
    for case in ("m05_180", "m10_540")
}
"""AME 2020: Figs 16 and 17; Figs 19 and 20 (one pair of ranges for both cases)."""

CONTRADICTIONS = tuple(
    (
        f"Fig. 18: forward error, {mass}, one bend not named",
        value,
        f"{FORWARD_MM[f'{key}_180']:g} or {FORWARD_MM[f'{key}_540']:g} in Fig. 16",
    )
    for key, mass, value in zip(("m05", "m10"), ("0.5 kg", "1 kg"), SAME_BEND_MM["forward"], strict=True)
)
"""Numbers of the paper [mm] that others of its own contradict."""
SLIP = 5e-3
"""Length over which the tendon slips on the wheel [m]; assumed."""
RATE = 0.25 / RADIUS
"""Highest speed of the pulses to the stepper [rad/s]: five times the stroke's; assumed. 0.5 m/s would take more torque
than its damping leaves."""
STRETCH = 0.02
"""More than the tendon stretches [m]."""
SETTLED = 0.5
"""After the slack has been taken up, and made up for, the errors of a compensated drive count from here on [s]."""
LEAD = 0.02
"""Where wheels with grooves stand at the start [rad]: these begin at 0, and the load turns the motor back by 0.01."""


@dataclass(frozen=True)
class Variant:
    """What a case changes.

    Attributes
    ----------
    transmission : mapping
        Parameters of it.
    compensator : mapping or None
        Parameters of it; None: there is none.
    changes_sides : bool
        Whether the weight hangs on tendon b on the way back.
    stepper : bool
        Whether motor and winding are there; else the wheel is where it is commanded.
    lead : float
        Angle at which driver and reference start [rad].
    rate : float
        Highest speed of the pulses to the stepper [rad/s]; 0 is no limit.
    """

    transmission: Mapping[str, Value] = field(default_factory=dict)
    compensator: Mapping[str, Value] | None = None
    changes_sides: bool = True
    stepper: bool = True
    lead: float = 0.0
    rate: float = RATE


VARIANTS = {
    "uncompensated": Variant(),
    "hanging": Variant(changes_sides=False),
    "ideal_drive": Variant(stepper=False),
    "compensated": Variant(compensator={}),
    "layers": Variant({"layers": 1}, lead=LEAD),
    "compensated_path_only": Variant(compensator={"winding_strain": 0}),
    "compensated_lugre": Variant(compensator={"lugre": 1}),
    "compensated_jump": Variant(compensator={}, rate=0.0),
}
COMMON = ("uncompensated", "hanging", "ideal_drive", "compensated")
CASES = {
    "m05_180": tuple(VARIANTS),
    "m05_540": COMMON,
    "m10_180": COMMON,
    "m10_540": tuple(VARIANTS),
}


def cases(fmus: Mapping[str, Path]) -> dict[str, Case]:
    """All cases, from the FMUs by model name."""
    return {
        f"{condition}.{name}": (loop(fmus, condition, VARIANTS[name], f"{condition}.{name}"), EXPERIMENT)
        for condition, names in CASES.items()
        for name in names
    }


def loop(fmus: Mapping[str, Path], condition: str, variant: Variant, name: str, *, slip: float = SLIP) -> System:
    """Return the drive under one load and bend; ``slip`` as `SLIP` [m]."""
    preset = kernel("LebusTransmission").presets[condition].si
    weight: dict[str, Value] = {"m": MASS_KG[condition], "g": G, "r": RADIUS, "phi_0": variant.lead}
    cord: dict[str, Value] = {"k1": 0.5, "k2": 0.5, "k3": 0.0, "u3": 0.0}
    if not variant.changes_sides:
        cord = {"k1": 0.0, "k2": 0.0, "k3": 1.0, "u3": 1.0}
    stroke: dict[str, Value] = {"kind": 2, "speed": SPEED, "stroke": STROKE, "cycles": 1.0, "offset": variant.lead}
    components = [
        Component("reference", fmus["ReferenceSignal"], stroke),
        Component("set_down", fmus["ReferenceSignal"], square_wave(TURN + 0.5 * STEP)),
        Component("hung_on_b", fmus["ReferenceSignal"], square_wave(TURN + 0.5 * STEP + take_up(condition, variant))),
        Component("cord", fmus["Sum"], cord),
        Component("load", fmus["HangingLoad"], weight),
        Component("transmission", fmus["LebusTransmission"], {**preset, **variant.transmission}),
    ]
    wires = [
        Connection("set_down.dy", "cord.u1"),
        Connection("hung_on_b.dy", "cord.u2"),
        Connection("cord.y", "load.s"),
        Connection("transmission.theta_out", "load.phi"),
        Connection("load.tau", "transmission.tau_load"),
    ]
    command = "reference.y"
    if variant.compensator is not None:
        components.append(Component("compensator", fmus["LebusCompensator"], {**preset, **variant.compensator}))
        wires += [
            Connection("reference.y", "compensator.theta_r"),
            Connection("load.tau", "compensator.T_measured", 1.0 / RADIUS, convert_units=False),
        ]
        command = "compensator.theta_ff"
    if variant.stepper:
        # wound at first, for slack and stretch on the way back
        before = 0.0 if variant.compensator is None else (_slack(condition) + STRETCH) / RADIUS
        components += _driver(fmus, slip, variant, before + LEAD - variant.lead)
        wires += [Connection(command, "stepper.theta_cmd"), *_DRIVEN]
    else:
        wires.append(Connection(command, "transmission.theta_in"))
    return System(tuple(components), tuple(wires), name)


def take_up(condition: str, variant: Variant) -> float:
    """How long the weight stays set down after the turn [s]: until the driver has taken up the slack of tendon b.

    Without a compensator the driver does so at the speed of the stroke; with one at `RATE`, after a reference that
    goes on; one in a single step has no limit, and the weight changes sides at once.
    """
    if variant.compensator is None:
        return _slack(condition) / (SPEED * RADIUS)
    if not variant.stepper or variant.rate == 0.0:
        return 0.0
    return _slack(condition) / ((variant.rate - SPEED) * RADIUS)


def settled_from(condition: str, variant: Variant) -> float:
    """When the slack has been taken up after the turn and the driver has come up with its command [s]."""
    return TURN + take_up(condition, variant) + SETTLED


def _slack(condition: str) -> float:
    return float(kernel("LebusTransmission").params(condition).slack)


def _driver(fmus: Mapping[str, Path], slip: float, variant: Variant, before: float) -> list[Component]:
    """Motor, wheel with its grooves, and the torque of tendons and wheel on the motor."""
    grooves: dict[str, Value] = {"n_t": kernel("LebusTransmission").params().n_t, "L_d0": 3.3e-3, "s_w": slip}
    return [
        Component("stepper", fmus["StepperMotor"], {"theta_0": variant.lead, "omega_max": variant.rate}),
        Component("wheel", fmus["Sum"], {"u2": before, "u3": 0.0}),
        Component("tension", fmus["Sum"], {"u3": 0.0}),
        Component("winding", fmus["LebusWinding"], grooves),
        Component("torque", fmus["Sum"], {"u3": 0.0}),
    ]


_DRIVEN = (
    Connection("stepper.theta", "transmission.theta_in"),
    Connection("stepper.theta", "wheel.u1"),
    Connection("wheel.y", "winding.theta"),
    Connection("transmission.T_a", "tension.u1"),
    Connection("transmission.T_b", "tension.u2"),
    Connection("tension.y", "winding.T"),
    Connection("transmission.tau_in", "torque.u1"),
    Connection("winding.tau_w", "torque.u2"),
    Connection("torque.y", "stepper.tau_load"),
)


def square_wave(turn: float) -> dict[str, Value]:
    """ReferenceSignal whose dy is 1 until ``turn`` [s] and -1 after it, for as long again."""
    return {"kind": 2, "speed": 1.0, "stroke": turn}


def quantities(name: str, run: Trajectory) -> dict[str, Metric]:
    """Errors of the follower [mm of tendon] on the way there and back.

    ``forward_*``: reference minus follower from the first step to the turn; ``reverse_max``: largest deviation on
    the way back, ``reverse_settled``: the same after a compensation has taken up the slack; ``lost_motion``: how much
    that error falls from the turn on. Cases with a motor also have the largest torque on it and the largest friction
    on its wheel.
    """
    condition, _, variant = name.partition(".")
    error = error_mm(run)
    there = (run.time > 0.5 * EXPERIMENT.step) & (run.time < TURN + 0.25 * STEP)
    back = run.time > TURN + 0.25 * STEP
    found: dict[str, float] = {}  # mm
    if there.any():
        worst = int(np.argmax(np.abs(error[there])))
        travel = 1e3 * RADIUS * (run.columns["reference.y"] - run.columns["reference.y"][0])
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
    if variant in VARIANTS and VARIANTS[variant].compensator is not None:
        settled = run.time > settled_from(condition, VARIANTS[variant])
        found |= {"reverse_settled": float(np.max(np.abs(error[settled])))} if settled.any() else {}
    metrics = {quantity: Metric(value, "mm") for quantity, value in found.items()}
    return metrics | _driver_metrics(run)


def _driver_metrics(run: Trajectory) -> dict[str, Metric]:
    """Largest torque on the motor, and friction on its wheel, where the case has them."""
    if "stepper.theta" not in run.columns:
        return {}
    return {
        "motor_torque_max": Metric(float(np.max(np.abs(run.columns["torque.y"]))), "N.m"),
        "wheel_friction_max": Metric(float(np.max(run.columns["winding.F_w"])), "N"),
    }


def error_mm(run: Trajectory, *, late: bool | None = None) -> NDArray[np.float64]:
    """Reference minus follower, as tendon on the wheel [mm].

    A stepper gets a command that is computed from the reference one communication step ``late``; the millimetre that
    the reference has moved on by then is no error of the drive and is not counted. None: as the run has both a
    compensator and a stepper.
    """
    wanted = run.columns["reference.y"]
    if late or (late is None and {"compensator.theta_ff", "stepper.theta"} <= set(run.columns)):
        wanted = np.concatenate([wanted[:1], wanted[:-1]])
    return 1e3 * RADIUS * (wanted - run.columns["transmission.theta_out"])


def comparison(cases: Mapping[str, Case]) -> dict[str, Any]:
    """Return what stands beside the metrics: the paper's numbers."""
    return {"reported": REPORTED}


def write_scenario_report(
    path: Path, runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]
) -> Path:
    """Write the HTML report; return its path."""
    found = {name: own.quantities for name, own in metrics.items()}
    errors = {name: error_mm(run) for name, run in runs.items()}
    return write_lebus_report(path, runs, found, errors, beside, CONTRADICTIONS)
