"""AME 2020: its drive as a loop of FMUs, with stepper motor, wheel friction and hanging load.

::

    reference [-> compensation -> command] -> drive of `lebus_drive`: stepper, winding, transmission, weight

The wheel has the friction of Eqs (7)-(13) with the slip length ``slip``; it loads the motor.
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
from ...scenarios.papers import MASS_KG, G
from ..loops import FMUS, co_simulate

RADIUS, STEP = lebus_drive.RADIUS, lebus_drive.STEP
RECORD = lebus_drive.RECORD


@dataclass(frozen=True)
class Drive:
    """One run: load and bend, changed parameters of the transmission, how the weight hangs, and how far.

    Attributes
    ----------
    case : str
        ``m05_180`` ... ``m10_540``.
    values : mapping
        Of LebusTransmission; ``n_t`` and ``n_layers`` go to the winding as well.
    slip : float
        Length over which the tendon slips on the wheel [m].
    there : bool
        The way there only.
    command : tuple of float
        Gain and offset [rad] of the command, from a compensation; the offset is taken up at the speed of the stroke.
    lead : float
        Angle at which the driver starts [rad]: inside the grooves of the transmission, where these begin at 0.
    kept : float
        Tension that tendon b keeps, and that tendon a carries besides the weight [N].
    compensator : mapping or None
        Parameters of a LebusCompensator with those of the transmission otherwise; None: there is none.
    """

    case: str
    values: Mapping[str, Value] = field(default_factory=dict)
    slip: float = 0.0
    there: bool = False
    command: tuple[float, float] = (1.0, 0.0)
    lead: float = 0.0
    kept: float = 0.0
    compensator: Mapping[str, Value] | None = None


def runs(drives: Mapping[str, Drive]) -> dict[str, Trajectory]:
    """Co-simulate all drives."""
    return co_simulate({name: _case(drive) for name, drive in drives.items()}, RECORD)


def _case(drive: Drive) -> Case:
    experiment = lebus_drive.EXPERIMENT
    if drive.there:
        experiment = replace(experiment, stop=round(lebus_drive.TURN / STEP) * STEP)
    return _system(drive), experiment


def _system(drive: Drive) -> System:
    fmus, variant = (
        {m: FMUS[m] for m in lebus_drive.FMUS},
        lebus_drive.Variant(lead=drive.lead, compensator=drive.compensator),
    )
    loop = lebus_drive.loop(fmus, drive.case, variant, drive.case, slip=drive.slip)
    shared = {f"winding.{n}": repr(drive.values[n]) for n in ("n_t", "n_layers") if n in drive.values}
    load = {"load.m": repr(MASS_KG[drive.case] + drive.kept / G)} if drive.kept else {}
    loop = loop.with_values({f"transmission.{n}": repr(v) for n, v in drive.values.items()} | shared | load)
    if drive.command == (1.0, 0.0):
        return loop
    gain, offset = drive.command
    take_up: dict[str, Value] = {"kind": 2, "speed": lebus_drive.SPEED, "stroke": offset, "cycles": 0.5}
    command = (
        Component("command", FMUS["Sum"], {"k1": gain, "u3": 0.0}),
        Component("take_up", FMUS["ReferenceSignal"], take_up),
    )
    wires = (
        Connection("reference.y", "command.u1"),
        Connection("take_up.y", "command.u2"),
        Connection("command.y", "stepper.theta_cmd"),
    )
    kept = tuple(w for w in loop.connections if w.target != "stepper.theta_cmd")
    return replace(loop, components=(*loop.components, *command), connections=(*kept, *wires))


def travel(run: Trajectory) -> FloatArray:
    """Commanded tendon [mm]."""
    return 1e3 * RADIUS * (run.columns["reference.y"] - run.columns["reference.y"][0])


def error(run: Trajectory) -> FloatArray:
    """Commanded minus followed tendon [mm]."""
    return lebus_drive.error_mm(run)


def at_end(run: Trajectory) -> float:
    """Error at the end of the way there [mm]."""
    turn = int(np.argmax(run.columns["reference.y"]))
    return float(error(run)[turn])


def lost_motion(run: Trajectory) -> float:
    """Driver travel at the turn until the follower moves back [mm]."""
    turn = int(np.argmax(run.columns["reference.y"]))
    return float(error(run)[turn] - np.min(error(run)[turn:]))
