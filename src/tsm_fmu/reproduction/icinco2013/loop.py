"""ICINCO 2013: its rig as a closed loop of FMUs: PID, motor with the gear 134:1, tendon friction, springs.

::

    reference -> PID -> motor 2642W024CR, 134:1 -> pulley -> tendon in its sheath (friction) -> springs
                  ^------ encoder ------'             ^------------- tension R -------------'

The paper prints motor, gear and encoder (5 um); amplitude, pulley, springs and gains are not printed.
"""

from __future__ import annotations

from collections.abc import Mapping

from ...cosim.ssp import Case
from ...cosim.system import Component, Connection, Experiment, System, Value
from ...cosim.trajectory import Trajectory
from ...kernels.kernel import kernel
from ...scenarios.pid_design import design_pid
from ...scenarios.single_tsm_force import T_MEAN, R
from ..loops import FMUS, co_simulate
from ..motions import signal

GEAR = 134.0
"""Printed, Section 2.1."""
STIFFNESS = 1000.0
"""Of the springs [N/m]; assumed, with the pretension of `single_tsm_force`."""
AMPLITUDES_MM = (1.0, 2.0, 5.0, 10.0)
FREQUENCIES_HZ = {"Fig. 6": 1.0, "Fig. 7": 0.8}
TOO_LARGE_MM = 25.0
"""More than the drive can follow at 1 Hz: shows where its voltage ends."""
SENSOR = "PidController+quantisation@y"
ENCODER = 5e-6
"""Of the linear encoder at the drive [m], Section 2.1."""
RECORD = (
    "reference.y",
    "motor.phi",
    "motor.omega",
    "motor.domega",
    "plant.F",
    "plant.T_drive",
    "load.tau",
    "controller.u",
)


def runs(quick: bool) -> dict[str, Trajectory]:
    """``item.amplitude`` in mm, ``reach`` at an amplitude beyond the drive, ``coarse`` with twice the step."""
    amplitudes = AMPLITUDES_MM[::2] if quick else AMPLITUDES_MM
    jobs = {f"{item}.{a:g}": _case(a, f, 5e-4) for item, f in FREQUENCIES_HZ.items() for a in {*amplitudes, 5.0}}
    jobs["reach"] = _case(TOO_LARGE_MM, 1.0, 5e-4)
    jobs["coarse"] = _case(5.0, 1.0, 1e-3)
    return co_simulate(jobs, RECORD)


def _case(amplitude_mm: float, frequency: float, step: float) -> Case:
    motor: dict[str, Value] = {"gear_ratio": GEAR}
    gains = design_pid(kernel("DcMotor").params(values={"gear_ratio": GEAR}), crossover=120.0, step=step).gains
    spring: dict[str, Value] = {"k": STIFFNESS * R * R, "d": 0.0, "phi_0": -T_MEAN / (STIFFNESS * R)}
    plant = kernel("SingleTsmDahl").presets["published"].si
    parts = (
        Component("reference", FMUS["ReferenceSignal"], signal([(1e-3 * amplitude_mm / R, frequency)])),
        Component("controller", FMUS[SENSOR], {**gains, "y.quantisation.q": ENCODER / R}),
        Component("motor", FMUS["DcMotor"], motor),
        Component("load", FMUS["RotationalLoad"], spring),
        Component("plant", FMUS["SingleTsmDahl"], {**plant, "T_in": 0.0}),
    )
    wires = (
        Connection("reference.y", "controller.r"),
        Connection("motor.phi", "controller.y"),
        Connection("controller.u", "motor.u"),
        Connection("motor.phi", "load.phi"),
        Connection("motor.omega", "plant.v", R, convert_units=False),
        Connection("motor.domega", "plant.a", R, convert_units=False),
        Connection("load.tau", "plant.T_load", 1.0 / R, convert_units=False),
        Connection("plant.T_drive", "motor.tau_load", R, convert_units=False),
    )
    stop = round(3.0 / frequency / step) * step
    return System(parts, wires, "icinco2013"), Experiment(stop=stop, step=step, evaluate_from=stop / 3.0)


def followed_mm(run: Trajectory) -> float:
    """Amplitude of the tendon at the drive in the last third [mm]."""
    x = 1e3 * R * run.columns["motor.phi"]
    last = run.time > run.time[-1] * 2.0 / 3.0
    return float(0.5 * (x[last].max() - x[last].min()))


def limit_cycle(run: Trajectory) -> Mapping[str, object]:
    """Time [s], travel [mm], speed [mm/s], friction [N] and the two tensions [N] after the first cycle."""
    last = run.time > run.time[-1] / 3.0
    return {
        "t": run.time[last],
        "x": 1e3 * R * run.columns["motor.phi"][last],
        "v": 1e3 * R * run.columns["motor.omega"][last],
        "F": run.columns["plant.F"][last],
        "T_in": run.columns["plant.T_drive"][last],
        "T_out": run.columns["load.tau"][last] / R,
    }
