"""Haptic torque estimate in the MSSP loop: MSSP 60-61 (2015), Figs 9, 11, 13, friction columns of Tables 1 and 2.

::

    motor x, v, a, and the torque measured on the drive pulley -> estimator -> distal torque, against the load's own

Two estimators see the same proximal signals. ``haptic`` is the plant's own friction model with its parameters: exact,
which shows that signs and timing of the chain are right. ``haptic_lugre`` is `DistalEstimator`, which knows angle and
torque alone: LuGre friction with the level, stiffness and damping of the same set, without its position-dependent
part, its lag and its offset. The reported errors are of a fit to measurements and have no counterpart here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cosim.metric import Metric, Reported, spread
from ..cosim.system import Component, Connection, System, Value
from ..cosim.trajectory import Trajectory
from ..kernels.kernel import kernel
from ..report import Line, Section, Table, loop_figure, time_figure
from .papers import MSSP_FRICTION_ERROR_N, TRIALS

ESTIMATORS = ("haptic", "haptic_lugre")
RECORD = ("motor.omega", "haptic.tau_out", "haptic_lugre.tau_out")
FROM = 10.0
"""Evaluated from here on [s], as the tracking error."""

WIDTH = {"periodic": {"peak_to_peak": Metric(MSSP_FRICTION_ERROR_N, "N")}}
REPORTED: Reported = {
    f"{motion}.law_1": {
        "mean": columns["friction_mean"],
        "std": columns["friction_std"],
        **WIDTH.get(motion, {}),
    }
    for motion, columns in TRIALS.items()
}
"""MSSP 2015: friction columns of Tables 1 and 2 (five trials), and Fig. 11."""


def with_estimators(system: System, fmus: Mapping[str, Path], backlash: Mapping[str, Value]) -> System:
    """Add both estimators to the loop of `mssp_feedforward`."""
    components = (
        Component("haptic", fmus["PairedTsmFriction"], {"tau_load": 0.0}),
        Component("haptic_lugre", fmus["DistalEstimator"], {**backlash, **lugre()}),
    )
    wires = (
        ("motor.phi", "haptic.x"),
        ("motor.omega", "haptic.v"),
        ("motor.domega", "haptic.a"),
        ("friction.tau_drive", "haptic.tau_in"),
        ("motor.phi", "haptic_lugre.x_in"),
        ("friction.tau_drive", "haptic_lugre.tau_in"),
    )
    connections = (*system.connections, *(Connection(*wire) for wire in wires))
    return replace(system, components=(*system.components, *components), connections=connections)


def lugre() -> dict[str, Value]:
    """LuGre part of DistalEstimator with level, presliding stiffness and damping of PairedTsmFriction."""
    p = kernel("PairedTsmFriction").params("published")
    torque = p.R * p.force_scale
    level = torque * p.k_zeta
    return {
        "ratio": 1.0,
        "sigma0": level * p.rho,
        "sigma1": 0.0,
        "sigma2": torque * p.upsilon,
        "tau_c": level,
        "tau_s": level,
    }


def quantities(name: str, run: Trajectory) -> dict[str, Metric]:
    """Errors of the distal torque, as friction force at the pulley like Tables 1 and 2."""
    window = run.time >= FROM - 1e-9
    found: dict[str, Metric] = {}
    for estimator in ESTIMATORS:
        if f"{estimator}.tau_out" not in run.columns or not window.any():
            continue
        error = friction_error(run, estimator)[window]
        found |= {f"{estimator}_{k}": metric for k, metric in spread(error, "N").metrics().items()}
    if found:
        found["friction_std"] = Metric(float(np.std(run.columns["friction.F"][window])), "N")
    return found


def friction_error(run: Trajectory, estimator: str) -> NDArray[np.float64]:
    """Estimated minus true distal torque over the pulley radius [N]."""
    radius = kernel("PairedTsmFriction").params("published").R
    return (run.columns[f"{estimator}.tau_out"] - run.columns["load.tau"]) / radius


def section(runs: Mapping[str, Trajectory]) -> Section | None:
    """Report section; None if no run has an estimator."""
    rows, figures = [], []
    for name, run in runs.items():
        found, paper = quantities(name, run), REPORTED.get(name, {})
        for estimator in ESTIMATORS:
            if f"{estimator}_std" in found:
                values = (found[f"{estimator}_{k}"].value for k in ("mean", "std", "peak_to_peak"))
                rows.append((name, estimator, *(round(v, 6) + 0.0 for v in values)))
        if found and paper:
            rows.append((name, "paper", *(_printed(paper.get(k)) for k in ("mean", "std", "peak_to_peak"))))
            stds = [trial.value for trial in TRIALS[name.partition(".")[0]]["friction_std"]]
            share = 100.0 * float(np.mean(stds)) / found["friction_std"].value
            rows.append((name, "paper, std over that of F here", "", f"{share:.1f} %", ""))
        if found:
            figures += _figures(name, run)
    if not rows:
        return None
    text = (
        "Distal torque estimated from the drive side, against the torque of the load; errors as friction force at the "
        "pulley. The reported errors are those of a fit to measurements that are not published: a level that is off by "
        "the given share of the friction would cause as much. The force unit of the published set is uncertain "
        "(force_scale), so only shares compare.\n\nThe bands in the friction are chatter: the k_x term of Eq (7) jumps "
        "with the sign of the acceleration, and in a loop the acceleration answers to that jump."
    )
    table = Table(("case", "estimator", "mean [N]", "std [N]", "peak to peak [N]"), rows)
    return Section(
        "Haptic torque estimate (Figs 9, 11, 13; friction columns of Tables 1 and 2)", text, (table,), figures
    )


def _printed(found: Metric | tuple[Metric, ...] | None) -> float | str | None:
    if isinstance(found, tuple):
        return f"{min(m.value for m in found):g} to {max(m.value for m in found):g}"
    return None if found is None else found.value


def _figures(name: str, run: Trajectory) -> list[Any]:
    shown = run.time >= FROM - 1e-9
    time, force = run.time[shown], run.columns["friction.F"][shown]
    estimate = {e: (friction_error(run, e))[shown] for e in ESTIMATORS}
    speed = np.degrees(run.columns["motor.omega"][shown])
    torque = [Line("load", time, run.columns["load.tau"][shown])]
    torque += [Line(e, time, run.columns[f"{e}.tau_out"][shown], e == "haptic") for e in ESTIMATORS]
    return [
        time_figure(
            [Line("plant", time, force), *(Line(e, time, force - estimate[e], e == "haptic") for e in ESTIMATORS)],
            f"Friction, {name}",
            "F [N]",
        ),
        loop_figure(
            [Line("plant", speed, force), *(Line(e, speed, force - estimate[e], e == "haptic") for e in ESTIMATORS)],
            f"Friction over speed, {name}",
            "v [deg/s]",
            "F [N]",
        ),
        time_figure(torque, f"Distal torque, {name}", "torque [N m]"),
    ]
