"""The natural loop of a tendon-sheath drive: motion goes to the distal side, its load comes back onto the motor.

::

    reference -> controller -> motor -> drive -> load           error = reference - x_out
                     ^-- phi ---' ^       ^-- tau_out --'
                                  '-- tau_in (friction and load)

All are FMUs. `TendonDrive` hands the load torque back over its friction at once, but angle and speed of its distal side
follow the drive side alone, so no loop is algebraic: the inertia of the motor is the state that closes it. One step
late are the voltage and the torque on the motor, and the torque of the load on the drive.

Cases are named ``feedback.load``. Feedback: ``motor`` (the controller sees the motor, as on a real robot; the error is
the hysteresis), ``compensated`` (the same with the reference through `FeedforwardCompensator`) and ``distal`` (it sees
the distal angle, which no robot does: what is left is the loop's own). Loads: ``spring`` (with a damper) and
``pendulum``. Power is counted at both ends of the drive: what goes in and does not come out is friction.
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
from .pid_design import design_pid

NAME = "tendon_drive_loop"
FMUS = (
    "ReferenceSignal",
    "FeedforwardCompensator",
    "PidController",
    "DcMotor",
    "TendonDrive",
    "RotationalLoad",
    "Sum",
)
RECORD = (
    "reference.y",
    "controller.u",
    "motor.phi",
    "motor.omega",
    "drive.x_out",
    "drive.v_in",
    "drive.tau_in",
    "load.tau",
    "error.y",
)
EXPERIMENT = Experiment(stop=10.0, step=1e-3, evaluate_from=5.0, tracking_error="error.y")
LOADS: dict[str, dict[str, Value]] = {
    "spring": {"k": 0.03, "d": 2e-3},
    "pendulum": {"k": 0.0, "d": 1e-3, "m": 0.12, "r": 0.045},
}
FEEDBACKS = ("motor", "compensated", "distal")


def cases(fmus: Mapping[str, Path]) -> dict[str, Case]:
    """All cases, from the FMUs by model name."""
    return {
        f"{feedback}.{load}": (loop(fmus, f"{feedback}.{load}", feedback, values), EXPERIMENT)
        for feedback in FEEDBACKS
        for load, values in LOADS.items()
    }


def loop(fmus: Mapping[str, Path], name: str, feedback: str, load: Mapping[str, Value]) -> System:
    """Return the closed loop with a feedback and the parameters of a load."""
    # distal: the play between motor and distal side leaves less margin
    crossover = 40.0 if feedback == "distal" else 300.0
    gains: dict[str, Value] = dict(design_pid(step=EXPERIMENT.step, crossover=crossover).gains)
    p = kernel("TendonDrive").params()
    play: dict[str, Value] = {"c": p.c, "beta": p.beta, "alpha": p.alpha}
    components = [
        Component("reference", fmus["ReferenceSignal"], {"amplitude_1": 0.8, "frequency_1": 0.2}),
        Component("controller", fmus["PidController"], gains),
        Component("motor", fmus["DcMotor"]),
        Component("drive", fmus["TendonDrive"], play),
        Component("load", fmus["RotationalLoad"], load),
        Component("error", fmus["Sum"], {"k2": -1.0, "u3": 0.0}),
    ]
    wires = [
        ("controller.u", "motor.u"),
        ("motor.phi", "drive.x_in"),
        ("drive.x_out", "load.phi"),
        ("load.tau", "drive.tau_out"),
        ("drive.tau_in", "motor.tau_load"),
        ("drive.x_out" if feedback == "distal" else "motor.phi", "controller.y"),
        ("reference.y", "error.u1"),
        ("drive.x_out", "error.u2"),
    ]
    if feedback == "compensated":
        components.insert(1, Component("compensator", fmus["FeedforwardCompensator"], {**play, "law": 1}))
        wires += [("reference.y", "compensator.x_r"), ("compensator.x_ff", "controller.r")]
    else:
        wires += [("reference.y", "controller.r")]
    return System(tuple(components), tuple(Connection(*wire) for wire in wires), name)


def quantities(name: str, run: Trajectory) -> dict[str, Metric]:
    """Work at both ends of the drive over the window, and the largest torque and voltage."""
    window = EXPERIMENT.window(run.time)
    angle_in, angle_out = (run.columns[c][window] for c in ("motor.phi", "drive.x_out"))
    torque_in, torque_out = (run.columns[c][window] for c in ("drive.tau_in", "load.tau"))
    work_in, work_out = _work(torque_in, angle_in), _work(torque_out, angle_out)
    return {
        "work_in": Metric(work_in, "J"),
        "work_out": Metric(work_out, "J"),
        "work_lost": Metric(work_in - work_out, "J"),
        "torque_peak": Metric(float(np.max(np.abs(torque_in))), "N.m"),
        "voltage_peak": Metric(float(np.max(np.abs(run.columns["controller.u"][window]))), "V"),
    }


def _work(torque: Any, angle: Any) -> float:
    return float(np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle)))


def comparison(cases: Mapping[str, Case]) -> dict[str, Any]:
    """Nothing stands beside the metrics: this loop is of no paper."""
    return {}


def write_scenario_report(
    path: Path, runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]
) -> Path:
    """Write the HTML report; return its path."""
    rows, tracking, curves = [], [], []
    for name, run in runs.items():
        window = EXPERIMENT.window(run.time)
        error = metrics[name].tracked()
        numbers = (metric.value for metric in metrics[name].quantities.values())
        rows.append((name, error.mean, error.std, error.peak_to_peak, *numbers))
        tracking.append(Line(name, run.time, np.degrees(run.columns["error.y"])))
        curves.append(Line(name, np.degrees(run.columns["motor.phi"][window]), run.columns["drive.tau_in"][window]))
    heading = (
        "case",
        "error: mean [deg]",
        "std [deg]",
        "peak to peak [deg]",
        "work in [J]",
        "work out [J]",
        "lost [J]",
        "peak torque [N.m]",
        "peak voltage [V]",
    )
    text = (
        "Motor, PID controller, tendon-sheath drive and load, all FMUs. With the controller on the motor the error is "
        "the hysteresis of the drive; with the feedforward law a smaller one; on the distal angle the loop's own."
    )
    figures = [
        time_figure(tracking, "Tracking error", "reference - x_out [deg]"),
        loop_figure(curves, "Drive torque over angle", "motor [deg]", "tau_in [N.m]"),
    ]
    sections = [Section("Tracking and work", text, (Table(heading, rows),), figures), *beside["ending"]]
    errors = ", ".join(f"{name} {metrics[name].tracked().std:.3g}" for name in runs)
    answer = f"Tracking error of the distal angle, standard deviation [deg]: {errors}."
    return write_report(path, "Tendon drive loop", answer, sections, {"tsm-fmu": __version__})
