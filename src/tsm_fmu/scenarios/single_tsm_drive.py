"""The rig of ICINCO 2013 as a closed loop: motor with its gear of 134:1, PID, tendon friction and springs.

::

    reference -> PID -> motor 2642W024CR, 134:1 -> pulley -> tendon in its sheath (friction) -> springs
                  ^------- angle -------'             ^------------- tension T_out -------------'

The motor carries the tension at the drive, T_in = T_out + F, so friction is a load of the position loop. The paper
prints motor, gear and encoder; amplitudes, pulley, springs and gains are not printed: the pulley is that of MSSP 2015,
the springs keep both ends taut, the gains are designed for a crossover of 120 rad/s (`pid_design`).

Cases are named ``frequency.amplitude``: 1 and 0.8 Hz as in Figs 6 and 7, amplitudes 1 to 10 mm, and 25 mm, which is
more than the motor can follow at 1 Hz: its voltage ends there.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..cosim.metric import CaseMetrics, Metric
from ..cosim.ssp import Case
from ..cosim.system import Component, Connection, Experiment, System, Value
from ..cosim.trajectory import Trajectory
from ..kernels.kernel import kernel
from ..report import Line, Section, Table, loop_figure, time_figure, write_report
from .motor_drive import motor_drive
from .single_tsm_force import GEAR, T_MEAN, R

NAME = "single_tsm_drive"
FMUS = ("ReferenceSignal", "PidController", "DcMotor", "SingleTsmDahl", "RotationalLoad")
RECORD = (
    "reference.y",
    "controller.u",
    "motor.phi",
    "motor.omega",
    "motor.domega",
    "plant.F",
    "plant.T_drive",
    "load.tau",
)
STIFFNESS = 1000.0
"""Of the springs [N/m]; assumed, with the pretension of `single_tsm_force`."""
CROSSOVER = 120.0
"""Of the position loop [rad/s]; assumed."""
STEP = 5e-4
FREQUENCIES_HZ = {"1_hz": 1.0, "08_hz": 0.8}
AMPLITUDES_MM = {"1_mm": 1.0, "2_mm": 2.0, "5_mm": 5.0, "10_mm": 10.0}
TOO_LARGE = {"25_mm": 25.0}
"""More than the drive can follow at 1 Hz."""


def cases(fmus: Mapping[str, Path]) -> dict[str, Case]:
    """All cases, from the FMUs by model name."""
    pairs = [(f, a) for f in FREQUENCIES_HZ for a in AMPLITUDES_MM] + [("1_hz", a) for a in TOO_LARGE]
    stop = _stop(min(FREQUENCIES_HZ.values()), STEP)  # one table has one time axis
    found = {}
    for frequency, amplitude in pairs:
        name = f"{frequency}.{amplitude}"
        system, _ = case(fmus, name, {**AMPLITUDES_MM, **TOO_LARGE}[amplitude], FREQUENCIES_HZ[frequency])
        found[name] = system, Experiment(stop=stop, step=STEP, evaluate_from=1.0 / FREQUENCIES_HZ[frequency])
    return found


def _stop(frequency: float, step: float) -> float:
    """End of three cycles, on the grid of the steps [s]."""
    return round(3.0 / frequency / step) * step


def case(fmus: Mapping[str, Path], name: str, amplitude_mm: float, frequency: float, *, step: float = STEP) -> Case:
    """Three cycles of a sine of the tendon at the drive, the first of them not evaluated."""
    spring: dict[str, Value] = {"k": STIFFNESS * R * R, "d": 0.0, "phi_0": -T_MEAN / (STIFFNESS * R)}
    plant = kernel("SingleTsmDahl").presets["published"].si
    motion: dict[str, Value] = {"kind": 1, "amplitude_1": 1e-3 * amplitude_mm / R, "frequency_1": frequency}
    drive, drive_wires = motor_drive(fmus, motion, "plant.T_drive", R, step=step, gear=GEAR, crossover=CROSSOVER)
    parts = (
        *drive,
        Component("load", fmus["RotationalLoad"], spring),
        Component("plant", fmus["SingleTsmDahl"], {**plant, "T_in": 0.0}),
    )
    wires = (
        *drive_wires,
        Connection("motor.phi", "load.phi"),
        Connection("motor.omega", "plant.v", R, convert_units=False),
        Connection("motor.domega", "plant.a", R, convert_units=False),
        Connection("load.tau", "plant.T_load", 1.0 / R, convert_units=False),
    )
    stop = _stop(frequency, step)
    return System(parts, wires, name), Experiment(stop=stop, step=step, evaluate_from=stop / 3.0)


def travel_mm(run: Trajectory) -> np.ndarray:
    """Tendon at the drive [mm]."""
    return 1e3 * R * run.columns["motor.phi"]


def followed_mm(run: Trajectory) -> float:
    """Its amplitude in the last third [mm]."""
    return 0.5 * float(np.ptp(travel_mm(run)[run.time > run.time[-1] * 2.0 / 3.0]))


def quantities(name: str, run: Trajectory) -> dict[str, Metric]:
    """Amplitude that is followed, tracking error of the drive, extremes of friction and tension, highest voltage.

    All but the amplitude after the first cycle.
    """
    first = 1.0 / FREQUENCIES_HZ[name.partition(".")[0]]
    later = Experiment(stop=float(run.time[-1]), step=STEP, evaluate_from=first).window(run.time)
    off = 1e3 * R * run.columns["reference.y"][later] - travel_mm(run)[later]
    force, tension = run.columns["plant.F"][later], run.columns["plant.T_drive"][later]
    return {
        "followed": Metric(followed_mm(run), "mm"),
        "error_rms": Metric(float(np.sqrt(np.mean(off**2))), "mm"),
        "friction_min": Metric(float(np.min(force)), "N"),
        "friction_max": Metric(float(np.max(force)), "N"),
        "tension_max": Metric(float(np.max(tension)), "N"),
        "voltage_max": Metric(float(np.max(np.abs(run.columns["controller.u"][later]))), "V"),
    }


def comparison(cases: Mapping[str, Case]) -> dict[str, Any]:
    """Nothing stands beside the metrics: the paper prints no number of its measurements."""
    return {}


def write_scenario_report(
    path: Path, runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]
) -> Path:
    """Write the HTML report; return its path."""
    rows = [(name, *(round(m.value, 3) for m in own.quantities.values())) for name, own in metrics.items()]
    units = next(iter(metrics.values())).quantities
    heading = ("case", *(f"{quantity.replace('_', ', ')} [{metric.unit}]" for quantity, metric in units.items()))
    text = (
        "Motor, PID, tendon friction and springs, all FMUs; the motor carries the tension at the drive. Friction has "
        "the branches of Eqs (2a)-(2d), which the acceleration of the motor itself switches. Neither amplitudes nor "
        "springs are printed, so the ranges are no counterpart of the measured ones."
    )
    return write_report(
        path,
        "Single tendon-sheath drive",
        f"Motor, gear {GEAR:g}:1, PID and tendon in a closed loop (ICINCO 2013): the drive carries friction of "
        f"{min(m.quantities['friction_min'].value for m in metrics.values()):.1f} to "
        f"{max(m.quantities['friction_max'].value for m in metrics.values()):.1f} N.",
        [Section("Closed loop", text, (Table(heading, rows),), _figures(runs)), *beside["ending"]],
        {"tsm-fmu": __version__},
    )


def _figures(runs: Mapping[str, Trajectory]) -> list[Any]:
    position, speed, tensions = [], [], []
    for name, run in runs.items():
        later = run.time >= run.time[-1] / 3.0
        force = run.columns["plant.F"][later]
        position.append(Line(name, travel_mm(run)[later], force))
        speed.append(Line(name, 1e3 * R * run.columns["motor.omega"][later], force))
        tensions.append(Line(f"T_in, {name}", run.time[later], run.columns["plant.T_drive"][later]))
        tensions.append(Line(f"T_out, {name}", run.time[later], run.columns["load.tau"][later] / R, dashed=True))
    return [
        loop_figure(position, "Friction over position (Fig. 6)", "tendon at the drive [mm]", "F [N]"),
        loop_figure(speed, "Friction over velocity (Fig. 6)", "speed [mm/s]", "F [N]"),
        time_figure(tensions, "Tensions (Fig. 3)", "T [N]"),
    ]
