"""AME 2020: its drive as a loop of FMUs, with stepper motor, wheel friction and hanging load.

::

    reference [-> compensation] -> command -> stepper -> transmission -> follower with the weight
                                                 ^-- torque: transmission tau_in, winding F_w D/2

The wheel has the friction of Eqs (7)-(13) with the slip length ``s_w``; it loads the motor, and in the transmission the
tendon.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...cosim.ssp import Case
from ...cosim.system import Component, Connection, System, Value
from ...cosim.trajectory import Trajectory
from ...kernels.arrays import FloatArray
from ...scenarios import lebus_drive
from ..loops import FMUS, co_simulate

RADIUS, STEP = lebus_drive.RADIUS, lebus_drive.STEP
RECORD = (*lebus_drive.RECORD, "winding.F_w", "stepper.theta")


@dataclass(frozen=True)
class Drive:
    """One run: load and bend, changed parameters of the transmission, how the weight hangs, and how far.

    Attributes
    ----------
    case : str
        ``m05_180`` ... ``m10_540``.
    values : mapping
        Of LebusTransmission; ``s_w``, ``n_t`` and ``n_layers`` go to the winding as well.
    variant : str
        Of `lebus_drive`.
    there : bool
        The way there only.
    command : tuple of float
        Gain and offset [rad] of the command, from a compensation; the offset is taken up at the speed of the stroke.
    lead : float
        Angle at which the driver starts [rad]: inside the grooves, where these begin at 0.
    """

    case: str
    values: Mapping[str, Value] = field(default_factory=dict)
    variant: str = "uncompensated"
    there: bool = False
    command: tuple[float, float] = (1.0, 0.0)
    lead: float = 0.0


def runs(drives: Mapping[str, Drive]) -> dict[str, Trajectory]:
    """Co-simulate all drives."""
    return co_simulate({name: _case(drive) for name, drive in drives.items()}, RECORD)


def _case(drive: Drive) -> Case:
    experiment = lebus_drive.EXPERIMENT
    if drive.there:
        experiment = replace(experiment, stop=round(lebus_drive.TURN / STEP) * STEP)
    return _with_stepper(drive), experiment


def _with_stepper(drive: Drive) -> System:
    loop = lebus_drive.loop({m: FMUS[m] for m in lebus_drive.FMUS}, drive.case, drive.variant)
    parts = {c.name: c for c in loop.components}
    transmission = parts["transmission"]
    values = {**transmission.parameters, **drive.values}
    parts["transmission"] = replace(transmission, parameters=values)
    shared = {n: values[n] for n in ("s_w", "n_t", "n_layers") if n in drive.values}
    parts["stepper"] = Component("stepper", FMUS["StepperMotor"], {"theta_0": drive.lead})
    parts["torque"] = Component("torque", FMUS["Sum"], {"k2": RADIUS, "u3": 0.0})
    parts["winding"] = Component("winding", FMUS["LebusWinding"], {"n_t": 6.67, "L_d0": 3.3e-3, **shared})
    wires = [w for w in loop.connections if w.target != "transmission.theta_in"]
    if drive.command == (1.0, 0.0):
        parts["reference"] = replace(
            parts["reference"], parameters={**parts["reference"].parameters, "offset": drive.lead}
        )
        wires += [Connection("reference.y", "stepper.theta_cmd")]
    else:
        gain, offset = drive.command
        parts["command"] = Component("command", FMUS["Sum"], {"k1": gain, "u3": 0.0})
        take_up: dict[str, Value] = {"kind": 2, "speed": lebus_drive.SPEED, "stroke": offset, "cycles": 0.5}
        parts["take_up"] = Component("take_up", FMUS["ReferenceSignal"], take_up)
        wires += [
            Connection("reference.y", "command.u1"),
            Connection("take_up.y", "command.u2"),
            Connection("command.y", "stepper.theta_cmd"),
        ]
    wires += [
        Connection("stepper.theta", "transmission.theta_in"),
        Connection("reference.y", "winding.theta"),
        Connection("transmission.T_a", "winding.T"),
        Connection("transmission.tau_in", "torque.u1"),
        Connection("winding.F_w", "torque.u2"),
        Connection("torque.y", "stepper.tau_load"),
    ]
    return replace(loop, components=tuple(parts.values()), connections=tuple(wires))


def travel(run: Trajectory) -> FloatArray:
    """Commanded tendon [mm]."""
    return 1e3 * RADIUS * run.columns["reference.y"]


def error(run: Trajectory) -> FloatArray:
    """Commanded minus followed tendon [mm]."""
    return lebus_drive.error_mm(run)


def compensated_error(run: Trajectory) -> FloatArray:
    """The same with a compensation, whose sum comes to the motor one communication step late: that is not counted."""
    wanted = run.columns["reference.y"]
    late = np.concatenate([wanted[:1], wanted[:-1]])
    return 1e3 * RADIUS * (late - run.columns["transmission.theta_out"])


def at_end(run: Trajectory) -> float:
    """Error at the end of the way there [mm]."""
    turn = int(np.argmax(run.columns["reference.y"]))
    return float(error(run)[turn])


def lost_motion(run: Trajectory) -> float:
    """Driver travel at the turn until the follower moves back [mm]."""
    turn = int(np.argmax(run.columns["reference.y"]))
    return float(error(run)[turn] - np.min(error(run)[turn:]))
