"""MMT 2015: Figs 3, 4, 6 and 7 as the paper draws them."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from ...models.laws.friction_branches import pull_level
from ...report import Line
from ...scenarios.papers import MMT_FIG_4
from ..draw import panels, plot
from ..motions import FloatArray, Motion

CYCLE = 5.0
"""The first cycle [s] is not scored: zeta starts at 0."""


def fig4_acceleration(v: FloatArray) -> FloatArray:
    """Acceleration [mm/s2] at a speed of Fig. 4's signal, 18.75 cos(3.75 t - 1.56)."""
    return 3.75 * np.sqrt(np.maximum(18.75**2 - v**2, 0.0))


def fig4_level(v: float, a: float, kappa1: float, mu2: float) -> float:
    """S of Eqs (7), (8) with the numbers of Fig. 4; ``mu2`` is 0 or 1."""
    p = MMT_FIG_4
    return pull_level(v, a, p["rho1"], p["mu1"], mu2 * p["mu2"], kappa1, p["kappa2"], p["kappa3"])


def lugre_figure(motion: Motion, lugre: FloatArray, forces: dict[str, FloatArray], scored: Any) -> go.Figure:
    lines = {f"proposed model, {b}": f for b, f in forces.items()} | {"LuGre, published": lugre}
    return panels(
        [
            plot(
                [Line(n, motion.v[scored], f[scored]) for n, f in lines.items()], "over velocity", "v [rad/s]", "F [N]"
            ),
            plot([Line(n, motion.x[scored], f[scored]) for n, f in lines.items()], "over position", "x [rad]", "F [N]"),
        ]
    )


def sliding_figure() -> go.Figure:
    v = np.linspace(0.0, 18.75, 400)
    a = fig4_acceleration(v)
    lines = [
        Line(name, v, np.array([fig4_level(x, y, -MMT_FIG_4["kappa1"], mu2) for x, y in zip(v, a, strict=True)]))
        for name, mu2 in (("S+v1", 0.0), ("S+v2", 1.0))
    ]
    return panels([plot(lines, "Sliding functions, kappa1 = +0.341", "velocity [mm/s]", "S")], columns=1)


def force_figure(motion: Motion, forces: dict[str, FloatArray]) -> go.Figure:
    after = motion.time >= CYCLE
    return panels(
        [
            plot([Line("input", motion.time, motion.x)], "(a) input", "time [s]", "x [rad]"),
            plot([Line(b, motion.time, f) for b, f in forces.items()], "(b) friction", "time [s]", "F [N]"),
            plot(
                [Line(b, motion.v[after], f[after]) for b, f in forces.items()],
                "(d) over velocity",
                "v [rad/s]",
                "F [N]",
            ),
            plot(
                [Line(b, motion.x[after], f[after]) for b, f in forces.items()], "(e) over position", "x [rad]", "F [N]"
            ),
        ]
    )
