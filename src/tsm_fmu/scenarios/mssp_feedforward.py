"""Feedforward compensation of a paired tendon-sheath drive in closed loop: MSSP 60-61 (2015), Sections 6 and 8.

::

    reference -> compensator -> controller -> motor -> backlash -> load
                                    ^----- phi ---'        '-> error = x_r - x_out
    load torque -> friction (x, v, a of the motor) -> torque on the motor

Cases are named ``motion.variant``. Motions: ``periodic`` (60 deg, 0.2 Hz) and ``non_periodic`` (30 deg at 0.2 Hz and
30 deg at 0.25 sqrt(3) Hz). Variants: the published plant ``uncompensated``, with the printed law (``law_1``) and with
the exact inverse (``law_2``); plants of B = 0.65 and 0.70 with the same loop width, whose output does not run
backwards after a reversal (``b065_...``, ``b070_...``), compensated by law 1 or 2 with their own parameters or by law 1
with the published ones. In ``law_1`` the distal torque is estimated as well (`mssp_haptic`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cosim.metric import CaseMetrics, Metric, Reported, Spread, spread
from ..cosim.ssp import Case
from ..cosim.system import Component, Connection, Experiment, System, Value
from ..cosim.trajectory import Trajectory
from ..kernels.kernel import kernel
from . import mssp_haptic
from .mssp_haptic import quantities as quantities
from .mssp_report import write_mssp_report
from .papers import MSSP_RESIDUAL_DEG, MSSP_WIDTH_DEG, TRIALS
from .pid_design import controller_model, design_pid, motor_model

NAME = "mssp_feedforward"
FMUS = (
    "ReferenceSignal",
    "FeedforwardCompensator",
    "PidController",
    "DcMotor",
    "PairedTsmBacklash",
    "PairedTsmFriction",
    "RotationalLoad",
    "Sum",
    "DistalEstimator",
)
EXPERIMENT = Experiment(stop=20.0, step=1e-3, loops="delay", evaluate_from=10.0, tracking_error="error.y")
"""The friction jumps with the sign of the acceleration, which answers to it: that loop has one step of delay."""
RECORD = (
    "reference.y",
    "compensator.x_ff",
    "controller.u",
    "motor.phi",
    "motor.i",
    "backlash.x_out",
    "friction.F",
    "load.tau",
    "error.y",
    *mssp_haptic.RECORD,
)
MOTIONS = {"periodic": ("published", 9), "non_periodic": ("non_periodic", 5)}
"""Preset of ReferenceSignal, and how many of the variants below."""
AMPLITUDE = math.radians(60.0)

REPORTED: Reported = {
    f"{motion}.uncompensated": {"peak_to_peak": Metric(MSSP_WIDTH_DEG[motion], "deg")} for motion in MOTIONS
} | {
    f"{motion}.law_1": {
        "peak_to_peak": Metric(MSSP_RESIDUAL_DEG[motion], "deg"),
        "mean": TRIALS[motion]["position_mean"],
        "std": TRIALS[motion]["position_std"],
    }
    for motion in MOTIONS
}
"""Tracking errors of MSSP 2015: Section 8 (peak to peak), Tables 1 and 2 (mean and standard deviation, five trials)."""


def loop_height(beta: float, alpha: float, amplitude: float = AMPLITUDE) -> float:
    """Half-height of the hysteresis loop [rad], in closed form."""
    return abs(beta) / alpha * math.tanh(alpha * amplitude)


def plant(b: float | None = None) -> dict[str, Value]:
    """Backlash parameters: the published ones, or with slope ``b`` after a reversal and the published width."""
    published = kernel("PairedTsmBacklash").params("published")
    if b is None:
        return {"c": published.c, "beta": published.beta, "alpha": published.alpha}
    from scipy.optimize import brentq  # half a second, as below: those who only run a case need not pay

    beta, height = b - published.c, loop_height(published.beta, published.alpha)
    alpha: Any = brentq(lambda alpha: loop_height(beta, alpha) - height, 1e-3, 1e3, xtol=1e-14)
    return {"c": published.c, "beta": beta, "alpha": float(alpha)}


def cases(fmus: Mapping[str, Path]) -> dict[str, Case]:
    """All cases, from the FMUs by model name; the first is the paper's own: periodic, law 1."""
    published, mild, milder = plant(), plant(0.65), plant(0.70)
    variants: dict[str, tuple[dict[str, Value], dict[str, Value] | None]] = {
        "law_1": (published, {**published, "law": 1}),
        "uncompensated": (published, None),
        "law_2": (published, {**published, "law": 2}),
        "b065_law_1": (mild, {**mild, "law": 1}),
        "b070_law_1": (milder, {**milder, "law": 1}),
        "b065_law_2": (mild, {**mild, "law": 2}),
        "b070_law_2": (milder, {**milder, "law": 2}),
        "b065_published_law_1": (mild, {**published, "law": 1}),
        "b070_published_law_1": (milder, {**published, "law": 1}),
    }
    gains = design_pid(step=EXPERIMENT.step).gains
    systems = {
        name: loop(fmus, name, preset, gains, *variants[variant])
        for motion, (preset, wanted) in MOTIONS.items()
        for variant in list(variants)[:wanted]
        for name in [f"{motion}.{variant}"]
    }
    for name in mssp_haptic.REPORTED:
        systems[name] = mssp_haptic.with_estimators(systems[name], fmus, published)
    return {name: (system, EXPERIMENT) for name, system in systems.items()}


def loop(
    fmus: Mapping[str, Path],
    name: str,
    motion: str,
    gains: Mapping[str, Value],
    backlash: Mapping[str, Value],
    compensator: Mapping[str, Value] | None,
) -> System:
    """Return the closed loop; without ``compensator`` the reference goes straight to the controller."""

    def component(label: str, model: str, values: Mapping[str, Value] | None = None) -> Component:
        return Component(label, fmus[model], values or {})

    components = [
        component("reference", "ReferenceSignal", kernel("ReferenceSignal").presets[motion].si),
        component("controller", "PidController", gains),
        component("motor", "DcMotor"),
        component("backlash", "PairedTsmBacklash", backlash),
        component("load", "RotationalLoad"),
        component("friction", "PairedTsmFriction", {"tau_in": 0.0}),
        component("error", "Sum", {"k2": -1.0, "u3": 0.0}),
    ]
    wires = [
        ("controller.u", "motor.u"),
        ("motor.phi", "controller.y"),
        ("motor.phi", "backlash.x_in"),
        ("motor.phi", "friction.x"),
        ("motor.omega", "friction.v"),
        ("motor.domega", "friction.a"),
        ("backlash.x_out", "load.phi"),
        ("load.tau", "friction.tau_load"),
        ("friction.tau_drive", "motor.tau_load"),
        ("reference.y", "error.u1"),
        ("backlash.x_out", "error.u2"),
    ]
    if compensator is None:
        wires += [("reference.y", "controller.r")]
    else:
        components.insert(1, component("compensator", "FeedforwardCompensator", compensator))
        wires += [("reference.y", "compensator.x_r"), ("compensator.x_ff", "controller.r")]
    return System(tuple(components), tuple(Connection(*wire) for wire in wires), name)


DESIGNED = ("controller.y", "motor.phi")
"""Input and output of the open loop that `designed` is about."""


def designed(case: Case) -> Any:
    """Open loop of the design (control.TransferFunction): `pid_design` with a delay of half a step."""
    import control  # two seconds, which those who only run it need not pay

    system, experiment = case
    values = next(c.parameters for c in system.components if c.name == "controller")
    gains = {name: float(values[name]) for name in ("kp", "ki", "kd", "T_f")}
    delay = control.tf(*control.pade(experiment.step / 2.0, 4))
    return controller_model(**gains) * motor_model(kernel("DcMotor").params()) * delay


def without_motor(case: Case) -> Spread:
    """Tracking error [deg] of a case if the motor followed its command exactly, from the kernels themselves."""
    system, experiment = case
    values = {c.name: c.parameters for c in system.components}
    time: NDArray[np.float64] = np.arange(round(experiment.stop / experiment.step) + 1, dtype=float) * experiment.step

    def outputs(model: str, name: str, column: NDArray[np.float64] | None) -> NDArray[np.float64]:
        k = kernel(model)
        known = {n: float(v) for n, v in values[name].items() if n in {p.name for p in k.parameters}}
        given = np.empty((time.size, 0)) if column is None else column[:, None]
        return k.simulate(k.params(values=known), time, given)[:, 0]

    x_r = outputs("ReferenceSignal", "reference", None)
    x_in = outputs("FeedforwardCompensator", "compensator", x_r) if "compensator" in values else x_r
    error = np.degrees(x_r - outputs("PairedTsmBacklash", "backlash", x_in))
    return spread(error[experiment.window(time)], "deg")


def closed_forms() -> dict[str, Metric]:
    """Peak-to-peak errors of the published plant, periodic motion: models of the paper in closed form."""
    from scipy.optimize import minimize_scalar

    p = kernel("PairedTsmBacklash").params("published")
    ratio = 2.0 * abs(p.beta) / p.c
    found: Any = minimize_scalar(
        lambda y: -y * (1.0 - math.exp(-ratio * (1.0 - y))), bounds=(0.0, 1.0), method="bounded"
    )
    y = found.x
    law_1 = 2.0 * abs(p.beta) / p.alpha * y * (1.0 - math.exp(-ratio * (1.0 - y)))
    forms = {"uncompensated": 2.0 * loop_height(p.beta, p.alpha), "law_1": 2.0 * law_1, "law_2": 0.0}
    return {variant: Metric(math.degrees(width), "deg") for variant, width in forms.items()}


def comparison(cases: Mapping[str, Case]) -> dict[str, Any]:
    """Return what stands beside the metrics: the paper's numbers, closed forms, the loop without motor, margins."""
    return {
        "reported": REPORTED,
        "reported_friction": mssp_haptic.REPORTED,
        "closed_forms": closed_forms(),
        "without_motor": {name: without_motor(case) for name, case in cases.items()},
        "controller": design_pid(step=EXPERIMENT.step).metrics(),
    }


def write_scenario_report(
    path: Path, runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]
) -> Path:
    """Write the HTML report; ``beside`` is from `comparison`. Return its path."""
    return write_mssp_report(path, runs, metrics, beside)
