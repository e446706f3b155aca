"""What moves a tendon in a closed loop: reference, position controller and motor, which carries the tension.

::

    reference -> controller -> motor -> (phi, omega, domega of the drive pulley)
                     ^-- phi --'  ^-- load, times its arm
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..cosim.system import Component, Connection, Value
from ..kernels.kernel import kernel
from .pid_design import design_pid

FMUS = ("ReferenceSignal", "PidController", "DcMotor")
MOTION = {"y": "motor.phi", "dy": "motor.omega", "ddy": "motor.domega"}
"""Outputs that stand for those of the reference where this is not followed at once."""


def motor_drive(
    fmus: Mapping[str, Path],
    motion: Mapping[str, Value],
    load: str,
    arm: float,
    *,
    step: float,
    gear: float,
    crossover: float,
) -> tuple[tuple[Component, ...], tuple[Connection, ...]]:
    """Components and connections of a position loop.

    Parameters
    ----------
    fmus : mapping of str to Path
        FMUs by model name.
    motion : mapping
        Parameters of ReferenceSignal, angles of the drive pulley.
    load : str
        Output that loads the pulley: the tension at the drive [N], or its torque [N.m].
    arm : float
        Of a tension: radius of the pulley [m]; 1 for a torque.
    step : float
        Communication step [s].
    gear : float
        Motor speed over pulley speed.
    crossover : float
        Of the position loop [rad/s].
    """
    gains = design_pid(kernel("DcMotor").params(values={"gear_ratio": gear}), crossover=crossover, step=step).gains
    parts = (
        Component("reference", fmus["ReferenceSignal"], motion),
        Component("controller", fmus["PidController"], dict(gains)),
        Component("motor", fmus["DcMotor"], {"gear_ratio": gear}),
    )
    wires = (
        Connection("reference.y", "controller.r"),
        Connection("motor.phi", "controller.y"),
        Connection("controller.u", "motor.u"),
        Connection(load, "motor.tau_load", arm, convert_units=arm == 1.0),
    )
    return parts, wires
