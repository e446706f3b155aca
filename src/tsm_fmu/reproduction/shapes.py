"""Independence of the sheath's shape, which IFToMM 2013 and MMT 2015 show by experiment, from loops of FMUs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from ..cosim.trajectory import Trajectory
from ..report import Figure, Line
from ..scenarios import configuration_independence as scenario
from .claims import Claim, Method, Open, statement_claim
from .draw import plot
from .loops import FMUS, co_simulate
from .verdict import Condition, Kind, Verdict

BENT_ALIKE = ("uniform", "bends_at_driver", "bends_at_follower", "bends_apart")
STIFFNESS_N = {"fibre of AME 2020": 6786.0, "steel rope": 2.4e3 * 3.46}
"""EA of the tendon: AME 2020, and 49 wires of 0.03 mm with 240 GPa reduced by the stranding."""
ROUTE = Open("route and load", "four routes of 540 deg in 1.5 m, 4.9 N", "assumed: Fig. 8 shows shapes without a scale")
TENDON = Open("EA", "6786 and 8304 N", "not printed: AME 2020's fibre; a steel rope WR7x7D0.27")
STATES = (
    "'there is no change or little change in the estimated friction force when the accumulated curve angles are "
    "maintained'"
)


@cache
def runs(quick: bool) -> Mapping[str, Trajectory]:
    """The routes with either tendon, ``quick`` with the first only; ``tendon.route``."""
    cases = scenario.cases({model: FMUS[model] for model in scenario.FMUS})
    jobs = {
        f"{tendon}.{route}": (system.with_values({"transmission.EA": repr(EA)}), replace(experiment, stop=10.0))
        for tendon, EA in list(STIFFNESS_N.items())[: 1 if quick else None]
        for route, (system, experiment) in cases.items()
        if route in BENT_ALIKE
    }
    return co_simulate(jobs, ["motor.phi", "transmission.stage", "friction.y"])


def transition_claim(key: str, item: str, least: float, quick: bool) -> Claim:
    """While all slides, and in transitions, where friction turns along the sheath; ``least`` is no change [N]."""
    tendons = {name.partition(".")[0]: None for name in runs(quick)}
    readings = {"sliding": max(_apart(t, quick, sliding=True) * _largest(t, quick) for t in tendons)}
    readings |= {f"transitions, {tendon}": _apart(tendon, quick, sliding=False) for tendon in tendons}
    return statement_claim(
        key,
        item,
        "largest difference of friction between routes of 540 deg",
        "N",
        STATES,
        {name: Condition(value, "<=", least) for name, value in readings.items()},
        kind=Kind.MEASUREMENT,
        assumed=(ROUTE, TENDON),
        why={
            Verdict.NOT_DETERMINED: "an elastic tendon under capstan friction loses its motion where the bends are: "
            f"the transitions differ by more than the {least:g} N that the model misses. How long they last hangs on "
            "stiffness, load and shapes, which are not printed"
        },
        method=Method.CO_SIMULATION,
    )


def _largest(tendon: str, quick: bool) -> float:
    return max(float(np.max(np.abs(runs(quick)[f"{tendon}.{route}"].columns["friction.y"]))) for route in BENT_ALIKE)


def _apart(tendon: str, quick: bool, *, sliding: bool) -> float:
    found = [runs(quick)[f"{tendon}.{route}"] for route in BENT_ALIKE]
    window = found[0].time >= 5.0
    force = np.array([run.columns["friction.y"][window] for run in found])
    slides = np.all([run.columns["transmission.stage"][window] == 2 for run in found], axis=0)
    if sliding:
        return float(np.max(np.ptp(force[:, slides], axis=0)) / np.max(np.abs(force)))
    return float(np.max(np.ptp(force[:, ~slides], axis=0)))


def shape_figures(quick: bool) -> tuple[Figure, ...]:
    """Friction over time and travel on four routes, and how far they are apart."""
    tendon = next(iter(STIFFNESS_N))
    own = {route: runs(quick)[f"{tendon}.{route}"] for route in BENT_ALIKE}
    first = own[BENT_ALIKE[0]]
    shown = first.time >= 5.0
    t, travel = first.time[shown], 1e3 * scenario.RADIUS * first.columns["motor.phi"][shown]
    force = {route.replace("_", " "): run.columns["friction.y"][shown] for route, run in own.items()}
    apart = {route: f - force["uniform"] for route, f in force.items() if route != "uniform"}
    return (
        plot([Line(n, travel, f) for n, f in force.items()], "Friction over position", "driver [mm]", "T_a - m g [N]"),
        plot(
            [Line(n, t, f) for n, f in apart.items()], "Difference from the uniform route", "time [s]", "difference [N]"
        ),
    )
