"""IFToMM 2013: Bouc-Wen friction in the three readings of its two unnamed numbers."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ...cosim.system import Experiment
from ...cosim.trajectory import Trajectory
from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ...models.contract import InputError
from ...report import Figure, Line
from ...scenarios.papers import MMT_FIG_4
from ..baseline import Rubbed, left
from ..claims import Claim, Method, Open, open_claim, statement_claim
from ..draw import half_width, plot
from ..loops import co_simulate
from ..motions import driven, signal
from ..printed import last_digit
from ..recovery import recovery_table
from ..result import PaperResult
from ..shapes import shape_figures, transition_claim
from ..verdict import Condition, Kind, Span, Verdict
from .printed import ERROR
from .properties import MODEL, MOTION, READINGS, SYMBOLS, property_claims
from .tensions import tension_claim, tension_figures, tension_runs
from .unique import unique, unique_claim

MULTI_PERIODIC = ((3e-3, 0.2), (2e-3, 0.35))
"""[m, Hz]; the paper says "multi-periodic" and prints neither amplitudes nor frequencies."""
SPRING = (18.0, 1000.0)
"""Tension [N] and stiffness [N/m] at the far end; assumed, as in `single_tsm_force`."""
EXPERIMENT = Experiment(stop=20.0, step=1e-3, evaluate_from=5.0)
DIGIT_N = last_digit(value for value, unit in kernel(MODEL).presets["published"].printed.values() if unit == "N")
"""Last printed digit of the numbers of F_f [N]: what is smaller would not show in them."""


def result(quick: bool = False) -> PaperResult:
    """All claims and figures; ``quick`` identifies by one method only."""
    cases = {name: driven(MODEL, signal(MULTI_PERIODIC), EXPERIMENT, preset) for name, preset in READINGS.items()}
    runs = co_simulate(cases)
    loops = {name: run.columns["plant.F"] for name, run in runs.items()}
    first = next(iter(runs.values()))
    identified, tensions = unique(first, quick), tension_runs()
    claims = (
        tension_claim(tensions),
        *_loops(loops),
        _level(),
        _continuity(),
        _rises_and_falls(),
        _unit(),
        *property_claims(first, loops),
        _baseline(first, loops),
        unique_claim(identified),
        transition_claim("iftomm2013.configuration", "Fig. 3", ERROR.span.middle, quick),
    )
    return PaperResult(
        claims,
        {"Fig. 1": tension_figures(tensions), "Fig. 3": shape_figures(quick), "Fig. 4": _figures(first, loops)},
        {"Fig. 4": recovery_table(identified)},
        {"Fig. 4": ASSUMED},
    )


ASSUMED = (
    "The last two of the 14 published numbers have lost their symbols in print. The three readings of them are drawn "
    "for x = 3 sin(2 pi 0.2 t) + 2 sin(2 pi 0.35 t) mm; the paper prints neither amplitudes nor frequencies."
)


def _loops(loops: dict[str, FloatArray]) -> list[Claim]:
    high, low = (Span.of(*(getattr(f, how)() for f in loops.values())) for how in ("max", "min"))
    return [
        open_claim(
            "iftomm2013.range",
            "Fig. 4",
            "range of F over the three readings",
            f"the motion is not published and two of the parameters have no symbols; highest {high}, lowest {low} N",
            ours=Span.of(*high.ends, *low.ends),
            unit="N",
            assumed=(MOTION, SYMBOLS),
            method=Method.CO_SIMULATION,
        ),
        open_claim(
            "iftomm2013.error",
            "Fig. 4",
            "error of the model, peak to peak",
            "the error is against measurements that are not published",
            prints=[ERROR],
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
        assumed=(Open("signs", "of mu1, mu3, mu4", "lost in print"),),
        why={Verdict.CONSISTENT: "positive whatever signs the print lost; mu1 < 0 follows from MMT 2015 Fig. 4"},
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
        "'at zero accelerations, the values of G_anvp and G_apvp must be equal ... The same arguments are expressed "
        "for "
        "G_anvn and G_apvn'",
        {"v < 0": Condition(jump(-1e-6), "<=", 1e-9)},
        why={
            Verdict.INTERNAL_ERROR: f"it is 2 mu4 exp(-kappa5 |v|/kappa6), up to {jump(-1e-12):.3g} N near rest and "
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
        "the unit of force is not stated: MMT 2015 prints rho1, mu1 and mu2 of the same set ten times as large",
        ours=Span.of(*ratios),
        unit="1",
    )


def _rises_and_falls() -> Claim:
    """F_f along one stroke of the motion's own kind, where the acceleration falls while the speed rises."""
    k = kernel(MODEL)
    p = k.params("published")
    angle = np.linspace(0.02, 0.5 * math.pi - 0.02, 400)
    peak, w = 10e-3, math.tau
    readings = {}
    for name, way in (("v > 0", 1.0), ("v < 0", -1.0)):
        level = np.array(
            [k.module.sliding_force(p, way * peak * math.sin(x), way * w * peak * math.cos(x), way) for x in angle]
        )
        top = int(np.argmax(level))
        rise, fall = float(level[top] - level[0]), float(level[top] - level[-1])
        readings[name] = Condition(min(rise, fall), ">=", DIGIT_N)
    return statement_claim(
        "iftomm2013.rises_and_falls",
        "Eq. (1)",
        "smaller of rise and fall of F_f while the speed grows from 0 to 10 mm/s, 1 Hz",
        "N",
        "'the friction force is an increasing function in the first range of velocity and a decreasing function in the "
        "remaining range'",
        readings,
        assumed=(MOTION,),
        why={
            Verdict.CONSISTENT: "the Stribeck-like part rises, that of the acceleration falls",
            Verdict.NOT_DETERMINED: "on one side only: on the other F_f goes one way",
            Verdict.INTERNAL_ERROR: "F_f goes one way on either side",
        },
    )


def _baseline(run: Trajectory, loops: dict[str, FloatArray]) -> Claim:
    x, v = run.columns["reference.y"], run.columns["reference.dy"]
    tension = SPRING[0] + SPRING[1] * x
    readings = {
        f"{name[0]}, {masses}": Condition(float(np.ptp(off)), ">=", ERROR.span.hi)
        for name, force in loops.items()
        for masses, off in left(Rubbed(run.time, x, v, tension, force, EXPERIMENT.window(run.time))).items()
    }
    return statement_claim(
        "iftomm2013.baseline",
        "Fig. 4",
        "error of lumped masses with Coulomb friction at their best, peak to peak",
        "N",
        f"lumped mass models are 'limited by discontinuous problems'; the proposed one misses {ERROR.text} N",
        readings,
        kind=Kind.MEASUREMENT,
        assumed=(MOTION, SYMBOLS, Open("far tension", "18 N and 1000 N/m", "not printed; for many masses only")),
        why={
            Verdict.CONSISTENT: "one mass jumps at each reversal; many turn over a presliding distance, but with "
            "friction in proportion to the tension, which this is not"
        },
        method=Method.CO_SIMULATION,
    )


def _figures(run: Trajectory, loops: dict[str, FloatArray]) -> tuple[Figure, ...]:
    x, v = run.columns["reference.y"] * 1e3, run.columns["reference.dy"] * 1e3
    last = run.time >= 5.0
    first = next(iter(loops.values()))
    apart = {name: f - first for name, f in loops.items() if f is not first}
    return (
        plot([Line(n, run.time, f) for n, f in loops.items()], "Friction over time", "time [s]", "F [N]"),
        plot(
            [Line(n, run.time[last], f[last]) for n, f in apart.items()],
            "Difference from reading A",
            "time [s]",
            "difference [N]",
            bands=half_width(ERROR, f"printed error: {ERROR.text} N peak to peak"),
        ),
        plot([Line(n, v[last], f[last]) for n, f in loops.items()], "over velocity", "velocity [mm/s]", "F [N]"),
        plot([Line(n, x[last], f[last]) for n, f in loops.items()], "over position", "position [mm]", "F [N]"),
    )
