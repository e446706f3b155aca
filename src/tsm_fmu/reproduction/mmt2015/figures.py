"""MMT 2015: Figs 3, 4, 6 and 7 as the paper draws them, from FMUs, errors on axes of their own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...cosim.trajectory import Trajectory
from ...kernels.arrays import FloatArray
from ...models.laws.friction_branches import pull_level
from ...report import Figure, Line
from ...scenarios.papers import MMT_FIG_4
from ...scenarios.single_tsm_force import DRIVEN, R
from ..draw import half_width, plot
from .forces import plant
from .printed import ERROR
from .readings import PRESETS

CYCLE = 5.0
"""The first cycle [s] is not scored: zeta starts at 0."""
Panels = tuple[Figure, ...]


def fig4_acceleration(v: FloatArray) -> FloatArray:
    """Acceleration [mm/s2] at a speed of Fig. 4's signal, 18.75 cos(3.75 t - 1.56)."""
    return 3.75 * np.sqrt(np.maximum(18.75**2 - v**2, 0.0))


def fig4_level(v: float, a: float, kappa1: float, mu2: float) -> float:
    """S of Eqs (7), (8) with the numbers of Fig. 4; ``mu2`` is 0 or 1."""
    p = MMT_FIG_4
    return pull_level(v, a, p["rho1"], p["mu1"], mu2 * p["mu2"], kappa1, p["kappa2"], p["kappa3"])


def lugre_figures(run: Trajectory) -> Panels:
    """Fig. 3: LuGre beside the proposed model, and their difference."""
    scored = run.time >= CYCLE
    lines = {f"proposed, {b}": run.columns[f"{plant(b, 'Eqs (10)-(12)')}.F"][scored] for b in PRESETS}
    lines["LuGre, published"] = run.columns["lugre.F"][scored]
    x, v, t = run.columns["reference.y"][scored], run.columns["reference.dy"][scored], run.time[scored]
    apart = [Line(f"LuGre less {n}", t, lines["LuGre, published"] - f) for n, f in lines.items() if "LuGre" not in n]
    return (
        plot([Line(n, v, f) for n, f in lines.items()], "over velocity", "v [rad/s]", "F [N]"),
        plot([Line(n, x, f) for n, f in lines.items()], "over position", "x [rad]", "F [N]"),
        plot(apart, "Difference", "time [s]", "difference [N]"),
    )


def sliding_figures() -> Panels:
    """Fig. 4."""
    v = np.linspace(0.0, 18.75, 400)
    a = fig4_acceleration(v)
    lines = [
        Line(name, v, np.array([fig4_level(x, y, -MMT_FIG_4["kappa1"], mu2) for x, y in zip(v, a, strict=True)]))
        for name, mu2 in (("S+v1", 0.0), ("S+v2", 1.0))
    ]
    return (plot(lines, "Sliding functions, kappa1 = +0.341", "velocity [mm/s]", "S"),)


def force_figures(found: Mapping[str, Trajectory], item: str, motion: str) -> Panels:
    """Figs 6 and 7: input, friction, error, loops, and the estimated output tension."""
    run, loop = found[item], found[f"modified_lugre.{DRIVEN}{motion}.levels_110"]
    forces = {b: run.columns[f"{plant(b, 'Eqs (10)-(12)')}.F"] for b in PRESETS}
    after, t = run.time >= CYCLE, loop.time
    x, v = run.columns["reference.y"], run.columns["reference.dy"]
    bands = half_width(ERROR) if item == "Fig. 6" else ()
    scored = t >= CYCLE
    true = loop.columns["load.tau"] / R
    return (
        plot([Line("input", run.time, x)], "(a) input", "time [s]", "x [rad]"),
        plot([Line(b, run.time, f) for b, f in forces.items()], "(b) friction", "time [s]", "F [N]"),
        plot(
            [Line("sheath bent 10 % less", t[scored], loop.columns["error.y"][scored])],
            "(c) error of the estimate",
            "time [s]",
            "error [N]",
            bands=bands,
        ),
        plot([Line(b, v[after], f[after]) for b, f in forces.items()], "(d) over velocity", "v [rad/s]", "F [N]"),
        plot([Line(b, x[after], f[after]) for b, f in forces.items()], "(e) over position", "x [rad]", "F [N]"),
        plot(
            [
                Line("T_in", t, loop.columns["plant.T_drive"]),
                Line("T_out", t, true),
                Line("T_out estimated, bent 10 % less", t, true + loop.columns["error.y"], dashed=True),
            ],
            "(f) tensions",
            "time [s]",
            "T [N]",
        ),
    )
