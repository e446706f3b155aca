"""Distal tension of a single tendon-sheath mechanism from proximal signals: IFToMM 2013, ICINCO 2013, MMT 85 (2015).

::

    reference (x, v, a) -> plant: friction F(v, a);  T_in = T_load + F   (what a load cell at the drive reads)
          |                  ^-- T_load -- load: spring, stretched by x
          '-----------> estimator: T_out = T_in - F_estimated(v, a)      error = T_out - T_load

The motion is imposed, or that of a motor behind a position controller, which carries T_in (``driven_``); the tendon is
rigid: the far end moves as the near end does. The spring and its pretension are
not published; they are chosen so that neither end goes slack, and cancel in the error, which is F - F_estimated.

Cases are named ``model.motion.estimator``. Models and motions: ``dahl`` (ICINCO Figs 6, 7: ``1_hz`` and ``08_hz``,
amplitude assumed), ``bouc_wen`` (IFToMM Figs 3, 4: ``multi_periodic``, all of it assumed), ``modified_lugre`` (MMT
Figs 6, 7: ``periodic`` and ``non_periodic``) and ``swapped_lugre``, the same with its pull branches in the order of
the other two papers. Estimators: ``same`` (the plant's own model and parameters), ``levels_110`` (sliding levels 10 %
too high: a sheath that is bent by 10 % less than when it was identified) and ``lugre`` (a symmetric law of the speed
alone: the published one for MMT 2015; elsewhere Coulomb friction with bristles at the mean |F| of the model's first
motion, no data being published to fit more).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..cosim.metric import CaseMetrics, Metric, Reported, spread
from ..cosim.ssp import Case
from ..cosim.system import Component, Connection, Experiment, System, Value
from ..cosim.trajectory import Trajectory
from ..kernels.kernel import kernel
from .motor_drive import FMUS as MOTOR_FMUS
from .motor_drive import MOTION, motor_drive
from .papers import ERROR_N, MMT_MSE_LUGRE, MMT_MSE_NON_PERIODIC, MMT_MSE_PERIODIC
from .single_tsm_report import write_single_tsm_report

NAME = "single_tsm_force"
FMUS = (
    *MOTOR_FMUS,
    "SingleTsmDahl",
    "SingleTsmBoucWen",
    "SingleTsmLuGre",
    "LuGreFriction",
    "RotationalLoad",
    "Sum",
)
RECORD = (
    "reference.y",
    "reference.dy",
    "motor.phi",
    "motor.omega",
    "controller.u",
    "plant.F",
    "estimator.F",
    "plant.T_drive",
    "load.tau",
    "error.y",
)
R = 0.025
"""Radius of the drive pulley [m], as in MSSP 2015."""
T_MEAN = 18.0
"""Pretension of the spring at x = 0 [N]; assumed."""
GEAR = 134.0
"""Of the motor, where there is one: ICINCO 2013, Section 2.1, the rig of all three papers."""
CROSSOVER = 60.0
"""Of its position loop [rad/s]; assumed."""
DRIVEN = "driven_"
"""Before the name of a motion that a motor makes."""

REPORTED: Reported = {
    "modified_lugre.periodic.lugre": {"error_mse": Metric(MMT_MSE_LUGRE, "N2")},
    "modified_lugre.periodic.same": {
        "error_mse": Metric(MMT_MSE_PERIODIC, "N2"),
        "error_peak_to_peak": Metric(ERROR_N["mmt2015"], "N"),
    },
    "modified_lugre.non_periodic.same": {"error_mse": Metric(MMT_MSE_NON_PERIODIC, "N2")},
    "bouc_wen.multi_periodic.same": {"error_peak_to_peak": Metric(ERROR_N["iftomm2013"], "N")},
}
"""MMT 2015, Sections 3.1 and 5; IFToMM 2013, page 8: model against a measurement that is not published."""

EXPERIMENT = Experiment(stop=20.0, step=2e-3, evaluate_from=5.0)
"""The window is a whole number of periods of every periodic motion."""

Sines = tuple[tuple[float, float], ...]
"""Amplitude [rad on the pulley] and frequency [Hz] of each sine."""


@dataclass(frozen=True)
class Sheath:
    """One plant.

    Attributes
    ----------
    model, preset : str
        Its friction.
    levels : tuple of str
        Parameters that set the sliding level.
    presliding : str
        Parameter that is the presliding stiffness [N/m]; empty for MMT 2015, which has its own LuGre set.
    stiffness : float
        Of the spring at the far end [N/m]; assumed.
    motions : mapping of str to Sines
        By name; the first one identifies the estimator ``lugre``.
    estimators : tuple of str
        Of those above.
    """

    model: str
    preset: str
    levels: tuple[str, ...]
    presliding: str
    stiffness: float
    motions: Mapping[str, Sines]
    estimators: tuple[str, ...] = ("same", "levels_110", "lugre")


MMT_LEVELS = ("rho1", "rho2", "mu1", "mu2", "mu3")
MMT_MOTIONS: dict[str, Sines] = {
    "periodic": ((1.0, 0.2),),
    "non_periodic": ((0.5, 0.2), (0.6, 0.25 * math.sqrt(3.0))),
}
SHEATHS = {
    "dahl": Sheath(
        "SingleTsmDahl",
        "published",
        MMT_LEVELS,
        "sigma",
        1000.0,
        {"1_hz": ((5e-3 / R, 1.0),), "08_hz": ((5e-3 / R, 0.8),)},
    ),
    "bouc_wen": Sheath(
        "SingleTsmBoucWen",
        "published",
        (*MMT_LEVELS, "mu4"),
        "k",
        1000.0,
        {"multi_periodic": ((3e-3 / R, 0.2), (2e-3 / R, 0.35))},
    ),
    "modified_lugre": Sheath("SingleTsmLuGre", "published", MMT_LEVELS, "", 400.0, MMT_MOTIONS),
    "swapped_lugre": Sheath("SingleTsmLuGre", "swapped", MMT_LEVELS, "", 400.0, MMT_MOTIONS, ("lugre",)),
}


def cases(fmus: Mapping[str, Path]) -> dict[str, Case]:
    """All cases, from the FMUs by model name."""
    return {
        name: (loop(fmus, name, sheath, sines, estimator, driven=bool(way)), EXPERIMENT)
        for plant, sheath in SHEATHS.items()
        for motion, sines in sheath.motions.items()
        for estimator in sheath.estimators
        for way in ("", *([DRIVEN] if plant == "modified_lugre" else []))
        for name in [f"{plant}.{way}{motion}.{estimator}"]
    }


def loop(
    fmus: Mapping[str, Path], name: str, sheath: Sheath, sines: Sines, estimator: str, *, driven: bool = False
) -> System:
    """Return plant, spring and estimator with the imposed motion, or ``driven`` by a motor that carries T_in."""
    preset = kernel(sheath.model).presets[sheath.preset].si
    lugre = estimator == "lugre"
    if lugre:
        estimate = Component("estimator", fmus["LuGreFriction"], baseline(sheath))
    else:
        levels = raised_levels(sheath) if estimator == "levels_110" else {}
        estimate = Component("estimator", fmus[sheath.model], {**preset, **levels, "T_load": 0.0})
    spring: dict[str, Value] = {"k": sheath.stiffness * R * R, "d": 0.0, "phi_0": -T_MEAN / (sheath.stiffness * R)}
    drive, wires = (Component("reference", fmus["ReferenceSignal"], motion_values(sines)),), ()
    if driven:
        drive, wires = motor_drive(
            fmus, motion_values(sines), "plant.T_drive", R, step=EXPERIMENT.step, gear=GEAR, crossover=CROSSOVER
        )
    y, dy, ddy = (MOTION[name] if driven else f"reference.{name}" for name in MOTION)
    components = (
        *drive,
        Component("load", fmus["RotationalLoad"], spring),
        Component("plant", fmus[sheath.model], {**preset, "T_in": 0.0}),
        estimate,
        Component("error", fmus["Sum"], {"k2": -1.0, "k3": -1.0, **({} if lugre else {"u2": 0.0})}),
    )
    wires = [
        *wires,
        Connection(y, "load.phi"),
        Connection("load.tau", "plant.T_load", 1.0 / R, convert_units=False),
        Connection("load.tau", "error.u3", 1.0 / R),
        moved(sheath, dy, "plant.v"),
        moved(sheath, ddy, "plant.a"),
        moved(sheath, dy, "estimator.v"),
    ]
    if lugre:
        wires += [Connection("plant.T_drive", "error.u1"), Connection("estimator.F", "error.u2")]
    else:
        wires += [
            moved(sheath, ddy, "estimator.a"),
            Connection("plant.T_drive", "estimator.T_in"),
            Connection("estimator.T_out", "error.u1"),
        ]
    return System(components, tuple(wires), name)


def motion_values(sines: Sines) -> dict[str, Value]:
    """Parameters of ReferenceSignal."""
    values: dict[str, Value] = {"kind": 1}
    for k, (amplitude, frequency) in enumerate((*sines, *((0.0, 0.0),) * (3 - len(sines))), start=1):
        values |= {f"amplitude_{k}": amplitude, f"frequency_{k}": frequency}
    return values


def moved(sheath: Sheath, source: str, target: str) -> Connection:
    """Motion of the pulley to a model: in rad for MMT 2015 and its LuGre set, in metres of tendon for the others."""
    factor = 1.0 if sheath.model == "SingleTsmLuGre" else R
    return Connection(source, target, factor, convert_units=False)


def raised_levels(sheath: Sheath) -> dict[str, Value]:
    """Sliding levels of the plant times 1.1."""
    p = kernel(sheath.model).params(sheath.preset)._asdict()
    return {level: 1.1 * p[level] for level in sheath.levels}


def baseline(sheath: Sheath) -> dict[str, Value]:
    """Parameters of LuGreFriction that stand for what a symmetric law can do."""
    if not sheath.presliding:
        return dict(kernel("LuGreFriction").presets["mmt2015"].si)
    signal, friction = kernel("ReferenceSignal"), kernel(sheath.model)
    time = np.arange(0.0, EXPERIMENT.stop, EXPERIMENT.step)
    values = {n: float(v) for n, v in motion_values(next(iter(sheath.motions.values()))).items()}
    motion = signal.simulate(signal.params(values=values), time, np.empty((time.size, 0)), compiled=False)
    p = friction.params(sheath.preset)
    inputs = np.column_stack([R * motion[:, 1:], np.zeros((time.size, 2))])
    force = friction.simulate(p, time, inputs, compiled=False)[time >= EXPERIMENT.evaluate_from, 0]
    level = float(np.mean(np.abs(force)))
    stiffness = float(getattr(p, sheath.presliding))
    return {"sigma0": stiffness, "sigma1": 0.0, "sigma2": 0.0, "F_c": level, "F_s": level, "v_s": 1.0}


def quantities(name: str, run: Trajectory) -> dict[str, Metric]:
    """Error of the estimated distal tension, beside the friction that it is about."""
    window = EXPERIMENT.window(run.time)
    error, force = run.columns["error.y"][window], run.columns["plant.F"][window]
    rms = float(np.sqrt(np.mean(error**2)))
    return {
        **{f"error_{name}": metric for name, metric in spread(error, "N").metrics().items()},
        "error_rms": Metric(rms, "N"),
        "error_mse": Metric(rms * rms, "N2"),
        "friction_min": Metric(float(np.min(force)), "N"),
        "friction_max": Metric(float(np.max(force)), "N"),
        "error_over_friction": Metric(100.0 * rms / float(np.sqrt(np.mean(force**2))), "%"),
    }


def comparison(cases: Mapping[str, Case]) -> dict[str, Any]:
    """Return what stands beside the metrics: the papers' numbers."""
    return {"reported": REPORTED}


def write_scenario_report(
    path: Path, runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]
) -> Path:
    """Write the HTML report; return its path."""
    found = {name: own.quantities for name, own in metrics.items()}
    return write_single_tsm_report(path, runs, found, beside)
