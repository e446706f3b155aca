"""IFToMM 2013: Bouc-Wen friction in the three readings of its two unnamed numbers."""

from __future__ import annotations

import itertools
import math

import numpy as np
import plotly.graph_objects as go
from scipy.integrate import solve_ivp

from ...kernels.kernel import kernel
from ...models.contract import InputError
from ...report import Line
from ...scenarios.papers import MMT_FIG_4
from ..claims import Claim, Condition, Span, Verdict, open_claim, statement_claim
from ..draw import panels, plot
from ..motions import FloatArray, Motion, friction, sines
from ..numbers import REPORTED
from ..result import PaperResult
from ..shapes import configuration_claim, configuration_figure

MODEL = "SingleTsmBoucWen"
READINGS = {"A (sigma, n)": "published", "B (k, sigma)": "reading_b", "C (k, n)": "reading_c"}
MULTI_PERIODIC = ((3e-3, 0.2), (2e-3, 0.35))
"""[m, Hz]; the paper says "multi-periodic" and prints neither amplitudes nor frequencies."""


def result() -> PaperResult:
    motion = sines(MULTI_PERIODIC, 20.0, 5e-4)
    loops = {name: friction(MODEL, motion, preset) for name, preset in READINGS.items()}
    claims = (
        *_loops(loops),
        _level(),
        _continuity(),
        _unit(),
        *_bounded(loops),
        *_dissipation(motion, loops),
        configuration_claim("iftomm2013.configuration", "Fig. 3"),
    )
    return PaperResult(
        claims, {"Fig. 3": configuration_figure(), "Fig. 4": _figure(motion, loops)}, texts={"Fig. 4": ASSUMED}
    )


ASSUMED = (
    "The last two of the 14 published numbers have lost their symbols in print. The three readings of them are drawn "
    "for x = 3 sin(2 pi 0.2 t) + 2 sin(2 pi 0.35 t) mm; the paper prints neither amplitudes nor frequencies."
)


def _loops(loops: dict[str, FloatArray]) -> list[Claim]:
    apart = max(float(np.abs(a - b).max()) for a, b in itertools.combinations(loops.values(), 2))
    missing = "the motion is not published and two of the parameters have no symbols"
    return [
        open_claim(
            "iftomm2013.force_high",
            "Fig. 4",
            "largest F over the three readings",
            Span.of(*(f.max() for f in loops.values())),
            missing,
            unit="N",
        ),
        open_claim(
            "iftomm2013.force_low",
            "Fig. 4",
            "lowest F over the three readings",
            Span.of(*(f.min() for f in loops.values())),
            missing,
            unit="N",
        ),
        open_claim(
            "iftomm2013.error",
            "Fig. 4",
            "error peak to peak; ours: largest difference between two readings",
            apart,
            "the error is against measurements that are not published; in presliding the readings differ by as much as "
            "shown",
            reported=REPORTED["iftomm2013.error"],
        ),
    ]


def _levels(mu1: float, mu3: float, mu4: float) -> float:
    """Lowest sliding force [N] over a grid of v and a."""
    k = kernel(MODEL)
    try:
        p = k.params("published", {"mu1": mu1, "mu3": mu3, "mu4": mu4})
    except InputError:
        return -math.inf
    grid = itertools.product(np.geomspace(1e-9, 0.1, 60), np.geomspace(1e-9, 1.0, 40), (-1.0, 1.0), (-1.0, 1.0))
    return min(k.module.sliding_force(p, way * v, s * a, s) for v, a, way, s in grid)


def _level() -> Claim:
    p = kernel(MODEL).params("published")
    signs = list(itertools.product((-1.0, 1.0), repeat=2))
    readings = {
        f"mu1 {'<' if a < 0 else '>'} 0": Condition(
            min(_levels(a * abs(p.mu1), b * abs(p.mu3), c * abs(p.mu4)) for b, c in signs), ">=", 1e-9
        )
        for a in (-1.0, 1.0)
    }
    return statement_claim(
        "iftomm2013.positive",
        "Eq. (1)",
        "lowest F_f over v, a and the lost signs of mu3 and mu4",
        "N",
        "F_f is a friction force, bounded by its extremes (p. 4)",
        readings,
        {Verdict.REPRODUCED: "positive whatever signs the print lost; mu1 < 0 follows from MMT 2015 Fig. 4"},
    )


def _continuity() -> Claim:
    k = kernel(MODEL)
    p = k.params("published")

    def jump(v: float) -> float:
        return abs(k.module.sliding_force(p, v, 0.0, 1.0) - k.module.sliding_force(p, v, 0.0, -1.0))

    return statement_claim(
        "iftomm2013.continuous",
        "Eq. (1)",
        "jump of F_f at a = 0, v = -1 um/s",
        "N",
        "the branches must be equal at zero acceleration (p. 3)",
        {"v < 0": Condition(jump(-1e-6), "<=", 1e-9)},
        {
            Verdict.CONTRADICTS: f"it is 2 mu4 exp(-kappa5 |v|/kappa6), up to {jump(-1e-12):.3g} N near rest and "
            f"{jump(-1e-4):.1g} N from 0.1 mm/s on; for v > 0 it is {jump(1e-6):.1g} N"
        },
    )


def _unit() -> Claim:
    ours = {name: value for name, (value, _) in kernel(MODEL).presets["published"].printed.items()}
    ratios = [MMT_FIG_4[name] / ours[name] for name in ("rho1", "mu1", "mu2")]
    return open_claim(
        "iftomm2013.force_unit",
        "Eq. (1)",
        "force scale against the same set in MMT 2015 Fig. 4",
        Span.of(*ratios),
        "the unit of force is not stated: MMT 2015 prints rho1, mu1 and mu2 of the same set ten times as large",
        unit="1",
    )


def _bounded(loops: dict[str, FloatArray]) -> list[Claim]:
    p = kernel(MODEL).params("published")
    ceiling = max(p.rho1 + max(p.mu1, 0.0) + max(p.mu2, 0.0), p.rho2 + max(p.mu3, 0.0) + abs(p.mu4))
    k, n = (value for value, _ in (kernel(MODEL).presets["reading_c"].printed[name] for name in ("k", "n")))
    escapes = {f"F_f {sign}": _largest(sign * 1.2, k, n) for sign in (1.0, -1.0)}
    return [
        statement_claim(
            "iftomm2013.bibo",
            "Prop. 2",
            "max |F| over the motion",
            "N",
            "F is bounded for sigma >= 0.5, n >= 1",
            {name: Condition(float(np.abs(f).max()), "<=", ceiling) for name, f in loops.items()},
            {Verdict.REPRODUCED: "the bound is sup F_f, for F_f > 0"},
        ),
        statement_claim(
            "iftomm2013.sign",
            "Prop. 2",
            "max |F| in 5 s of release at 3 mm/s, Eq. (2) as printed",
            "N",
            "F is bounded for all signs of v and zeta",
            {
                "F_f > 0": Condition(escapes["F_f 1.0"], "<=", ceiling),
                "F_f < 0 for v < 0": Condition(escapes["F_f -1.0"], "<=", ceiling),
            },
            {
                Verdict.NOT_DETERMINED: "Eq. (1) leaves open whether F_f is a magnitude; with a negative one the "
                "equilibrium is lost and F runs away (reading C)"
            },
        ),
    ]


def _largest(level: float, k: float, n: float, v: float = -3.0, limit: float = 1e6) -> float:
    """Largest |F| of Eq. (2) as printed (sigma = 1), with a sliding force of either sign; stops at ``limit``."""

    def rate(_: float, zeta: FloatArray) -> list[float]:
        r = zeta[0] / level
        return [k * (v - abs(v) * abs(r) ** (n - 1.0) * r)]

    def lost(_: float, zeta: FloatArray) -> float:
        return abs(zeta[0]) - limit

    lost.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    run = solve_ivp(rate, (0.0, 5.0), [0.0], events=lost, method="Radau", rtol=1e-8)
    return float(np.abs(run.y).max())


def _dissipation(motion: Motion, loops: dict[str, FloatArray]) -> list[Claim]:
    stiffness = {name: kernel(MODEL).params(preset).k * 1e-3 for name, preset in READINGS.items()}  # N/mm

    def margins(slope: dict[str, float]) -> dict[str, Condition]:
        found = {}
        for name, force in loops.items():
            work = 0.5 * (force[1:] + force[:-1]) * np.diff(motion.x) * 1e3
            stored = np.diff(force**2) / (2.0 * slope[name])
            found[name] = Condition(float(((work - stored) / np.diff(motion.time)).min()), ">=", -1e-3)
        return found

    return [
        statement_claim(
            "iftomm2013.dissipative",
            "Prop. 3",
            "least F v - dW/dt, W = zeta^2/2",
            "N.mm/s",
            "the system is dissipative with W = zeta^2/2",
            margins(dict.fromkeys(loops, 1.0)),
            {
                Verdict.NOT_DETERMINED: "it holds only where the slope k of F is 1 N/mm: mild evidence for reading A "
                "(the limit is the error of the trapezoidal rule)"
            },
        ),
        statement_claim(
            "iftomm2013.dissipative_matched",
            "Prop. 3",
            "least F v - dW/dt, W = F^2/(2 k)",
            "N.mm/s",
            "the system is dissipative",
            margins(stiffness),
            {Verdict.REPRODUCED: "with the storage that fits the slope of F it holds in all readings"},
        ),
    ]


def _figure(motion: Motion, loops: dict[str, FloatArray]) -> go.Figure:
    x, v = motion.x * 1e3, motion.v * 1e3
    last = motion.time >= 5.0
    return panels(
        [
            plot([Line(n, motion.time, f) for n, f in loops.items()], "Friction over time", "time [s]", "F [N]"),
            plot([Line(n, v[last], f[last]) for n, f in loops.items()], "over velocity", "velocity [mm/s]", "F [N]"),
            plot([Line(n, x[last], f[last]) for n, f in loops.items()], "over position", "position [mm]", "F [N]"),
        ],
        columns=3,
    )
