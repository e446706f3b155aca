"""Does the route of a sheath matter, or only its total bend? IFToMM 2013 Fig. 3, MMT 85 (2015) Fig. 8.

::

    reference -> controller -> motor -> transmission <-> hanging weight; friction F = T_a - m g
                      ^-- phi --'  ^-- torque of the drive wheel --'

Both papers measured the same friction for two shapes of 540 deg in all, and conclude that only the accumulated angle
counts. The single-tendon models of these papers have no angle in them: they cannot tell routes apart, and say nothing
on it. The capstan profile (AME 2020 Eqs (14)-(19)) does. While the whole tendon slides, T_a/(m g) = exp(+-mu Theta)
whatever the order of the bends: the claim holds. The elongation does depend on where the bends are, so the lost
motion of a reversal and the friction during it differ from route to route: there the claim is an approximation.

Cases are routes. ``uniform``, ``bends_at_driver``, ``bends_at_follower`` and ``bends_apart`` have 540 deg and 1.5 m;
``less_bent`` has 360 deg. Route shapes, load, gear and motion (two
sines, as in MMT 2015) are assumed.
"""

from __future__ import annotations

import math
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
from .motor_drive import FMUS as MOTOR_FMUS
from .motor_drive import motor_drive

NAME = "configuration_independence"
FMUS = (*MOTOR_FMUS, "LebusTransmission", "HangingLoad", "Sum")
RECORD = (
    "reference.y",
    "motor.phi",
    "controller.u",
    "transmission.theta_out",
    "transmission.T_a",
    "transmission.elongation",
    "transmission.stage",
    "friction.y",
)
EXPERIMENT = Experiment(stop=20.0, step=2e-3, evaluate_from=5.0)
RADIUS = 0.0125
"""Radius of the wheels [m]."""
LENGTH = 1.5
"""Of every route [m]."""
MASS, G = 0.5, 9.81
WEIGHT = MASS * G
"""Load m g [N]."""
GEAR = 60.0
"""Of the motor; assumed: ICINCO 2013's 134 would be too slow for this motion of a smaller wheel."""
CROSSOVER = 60.0
"""Of the position loop [rad/s]; assumed."""
MU = kernel("LebusTransmission").params().mu
MOTION: dict[str, Value] = {
    "amplitude_1": 1.7,
    "amplitude_2": 2.0,
    "frequency_1": 0.2,
    "frequency_2": 0.25 * math.sqrt(3.0),
}
"""Driver [rad, Hz]: about +-45 mm of tendon."""

HALF_TURN = (0.1 * math.pi, 0.1)
FULL_TURN = (0.08 * 2.0 * math.pi, 0.08)
STRAIGHT = LENGTH - HALF_TURN[0] - FULL_TURN[0]

Route = tuple[tuple[float, float], ...]
"""Pieces from the driver: length and bending radius [m], radius 0 if straight."""

ROUTES: dict[str, Route] = {
    "uniform": ((LENGTH, LENGTH / (3.0 * math.pi)),),
    "bends_at_driver": (HALF_TURN, FULL_TURN, (STRAIGHT, 0.0)),
    "bends_at_follower": ((STRAIGHT, 0.0), FULL_TURN, HALF_TURN),
    "bends_apart": ((0.25 * STRAIGHT, 0.0), HALF_TURN, (0.5 * STRAIGHT, 0.0), FULL_TURN, (0.25 * STRAIGHT, 0.0)),
    "less_bent": ((LENGTH, LENGTH / (2.0 * math.pi)),),
}


def angle(route: Route) -> float:
    """Total bend [rad]."""
    return sum(length / radius for length, radius in route if radius > 0.0)


def cases(fmus: Mapping[str, Path]) -> dict[str, Case]:
    """All cases, from the FMUs by model name."""
    return {name: (loop(fmus, name, route), EXPERIMENT) for name, route in ROUTES.items()}


def loop(fmus: Mapping[str, Path], name: str, route: Route) -> System:
    """Return the transmission on one route."""
    pieces: dict[str, Value] = {"n_seg": len(route)}
    for k, (length, radius) in enumerate(route, 1):
        pieces |= {f"L_{k}": length, f"R_{k}": radius}
    drive, wires = motor_drive(
        fmus, MOTION, "transmission.tau_in", 1.0, step=EXPERIMENT.step, gear=GEAR, crossover=CROSSOVER
    )
    return System(
        (
            *drive,
            Component("transmission", fmus["LebusTransmission"], {**pieces, "winding_strain": 0}),
            Component("load", fmus["HangingLoad"], {"m": MASS, "g": G, "r": RADIUS, "s": 1.0}),
            Component("friction", fmus["Sum"], {"k2": -1.0, "u2": WEIGHT, "u3": 0.0}),
        ),
        (
            *wires,
            Connection("motor.phi", "transmission.theta_in"),
            Connection("transmission.theta_out", "load.phi"),
            Connection("load.tau", "transmission.tau_load"),
            Connection("transmission.T_a", "friction.u1"),
        ),
        name,
    )


def quantities(name: str, run: Trajectory) -> dict[str, Metric]:
    """Tension ratio and elongation while the whole tendon slides, and how much of the time it does.

    ``ratio_*``: mean T_a/(m g) while the follower runs; ``ratio_spread``: its largest peak-to-peak value either way.
    """
    moved = np.diff(run.columns["motor.phi"], prepend=run.columns["motor.phi"][0])
    window = EXPERIMENT.window(run.time)
    runs = window & (run.columns["transmission.stage"] == 2)
    ratio = run.columns["transmission.T_a"] / WEIGHT
    pull, release = ratio[runs & (moved > 0.0)], ratio[runs & (moved < 0.0)]
    if pull.size == 0 or release.size == 0:
        return {}
    elongation = run.columns["transmission.elongation"]
    work = np.sum((run.columns["friction.y"] * moved)[window]) * RADIUS
    return {
        "ratio_pull": Metric(float(np.mean(pull)), "1"),
        "ratio_release": Metric(float(np.mean(release)), "1"),
        "ratio_spread": Metric(max(float(np.ptp(pull)), float(np.ptp(release))), "1"),
        "elongation_pull": Metric(1e3 * float(np.mean(elongation[runs & (moved > 0.0)])), "mm"),
        "elongation_release": Metric(1e3 * float(np.mean(elongation[runs & (moved < 0.0)])), "mm"),
        "running": Metric(100.0 * float(np.mean(runs[window])), "%"),
        "friction_work": Metric(float(work), "J"),
    }


def comparison(cases: Mapping[str, Case]) -> dict[str, Any]:
    """Return what stands beside the metrics: angle and capstan ratio of each route."""
    return {
        "closed_forms": {
            name: {
                "angle": Metric(math.degrees(angle(route)), "deg"),
                "ratio_pull": Metric(math.exp(MU * angle(route)), "1"),
            }
            for name, route in ROUTES.items()
        }
    }


RATIO_HEADING = ("route", "bend [deg]", "exp(mu Theta)", "T_a/(m g), pull", "T_a/(m g), release", "work [J]")
ELASTIC_HEADING = ("route", "elongation, pull", "release [mm]", "runs [% of time]", "rms F - F_1 [N]")


def write_scenario_report(
    path: Path, runs: Mapping[str, Trajectory], metrics: Mapping[str, CaseMetrics], beside: Mapping[str, Any]
) -> Path:
    """Write the HTML report; return its path."""
    forms = beside["closed_forms"]
    reference = next(iter(runs.values()))
    ratios, elastic = [], []
    for name, own in metrics.items():
        q = {quantity: metric.value for quantity, metric in own.quantities.items()}
        if not q:
            continue
        difference = runs[name].columns["friction.y"] - reference.columns["friction.y"]
        off = float(np.sqrt(np.mean(difference[EXPERIMENT.window(reference.time)] ** 2)))
        closed = (metric.value for metric in forms[name].values())
        ratios.append((name, *closed, q["ratio_pull"], q["ratio_release"], q["friction_work"]))
        elastic.append((name, q["elongation_pull"], q["elongation_release"], q["running"], off))
    text = (
        "While the whole tendon slides, routes of one angle have the same tension ratio to all digits, and a route "
        "with less angle has a smaller one. Elongation, and with it the lost motion of a reversal, depends on where "
        "the bends are: bends at the driver shield the rest from tension. So the friction signals differ after each "
        "reversal, for longer the nearer the bends are to the follower; the last column is that difference from the "
        "first route over the whole window. The papers measured no difference between two shapes of one angle."
    )
    sections = (
        Section("Routes", text, (Table(RATIO_HEADING, ratios), Table(ELASTIC_HEADING, elastic))),
        Section("Friction T_a - m g", "", (), _figures(runs)),
        *beside["ending"],
    )
    pulling = [row[3] for row in ratios if row[1] > 500.0]
    summary = (
        "Same total bend, same friction while the tendon slides: the order of the bends changes the elongation only."
    )
    if pulling:
        summary += f" Tension ratio of the routes of 540 deg: {min(pulling):.6f} to {max(pulling):.6f}."
    return write_report(path, "Configuration independence", summary, sections, {"tsm-fmu": __version__})


def _figures(runs: Mapping[str, Trajectory]) -> tuple[Any, ...]:
    over_time, over_travel = [], []
    for name, run in runs.items():
        shown = run.time >= run.time[-1] - 5.0
        force, travel = run.columns["friction.y"][shown], 1e3 * RADIUS * run.columns["motor.phi"][shown]
        over_time.append(Line(name, run.time[shown], force))
        over_travel.append(Line(name, travel, force))
    return (
        time_figure(over_time, "Friction over time (IFToMM 2013, Fig. 3)", "T_a - m g [N]"),
        loop_figure(over_travel, "Friction over position (MMT 2015, Fig. 8b)", "driver [mm]", "T_a - m g [N]"),
    )
