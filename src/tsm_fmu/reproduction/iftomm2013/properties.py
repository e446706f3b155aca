"""IFToMM 2013: the properties that its propositions claim, on the state equation and on runs of its FMU."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

import numpy as np
from scipy.integrate import solve_ivp

from ...cosim.trajectory import Trajectory
from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ..claims import Claim, Method, Open, statement_claim
from ..verdict import Condition, Kind, Verdict

MODEL = "SingleTsmBoucWen"
READINGS = {"A (sigma, n)": "published", "B (k, sigma)": "reading_b", "C (k, n)": "reading_c"}
MOTION = Open("motion", "3 mm at 0.2 Hz and 2 mm at 0.35 Hz", "'multi-periodic' is printed, no number")
SYMBOLS = Open("two parameters", "readings A, B, C", "the last two of 14 numbers have lost their symbols")


def property_claims(run: Trajectory, loops: dict[str, FloatArray]) -> list[Claim]:
    """Claims on Eq. (2) and Props 1 to 3."""
    return [_original(), _exists(), *_bounded(loops), *_dissipation(run, loops)]


def _original() -> Claim:
    """With F_f = 1, Eq. (2) against the Bouc-Wen law of its reference, right-hand sides on a grid."""
    off = 0.0
    for sigma, n, v, zeta in itertools.product((0.5, 1.3, 5.491), (1.0, 2.952), (-2.0, 3.0), (-0.9, -0.2, 0.4, 0.8)):
        eq2 = v - sigma * abs(v) * abs(zeta) ** (n - 1.0) * zeta + (sigma - 1.0) * v * abs(zeta) ** n
        bouc_wen = v * (1.0 - abs(zeta) ** n * (1.0 - sigma + sigma * math.copysign(1.0, v * zeta)))
        off = max(off, abs(eq2 - bouc_wen))
    return statement_claim(
        "iftomm2013.original",
        "Eq. (2)",
        "largest difference of Eq. (2) with F_f = 1 from the normalised Bouc-Wen law",
        "1",
        "'When F_f = 1, the Eq. (2) becomes the original Bouc-Wen model'",
        {"rates": Condition(off, "<=", 1e-12)},
    )


def _exists() -> Claim:
    """Existence and uniqueness as properties of the step: it composes, and two solutions come together."""
    k = kernel(MODEL)
    apart, grown = 0.0, 0.0
    for preset, v, a in itertools.product(READINGS.values(), (-6e-3, 2e-4, 9e-3), (-0.03, 0.02)):
        p = k.params(preset)
        u = k.module.Inputs(v, a, 0.0, 0.0)
        begin, _ = k.module.start(p, u)
        # presliding: between the two states friction has to change by all of its range
        one, _ = k.module.step(p, begin, u, 2e-2)
        half, _ = k.module.step(p, begin, u, 1e-2)
        two, _ = k.module.step(p, half, u, 1e-2)
        apart = max(apart, abs(one.zeta - two.zeta))
        other = begin._replace(zeta=begin.zeta + 0.1)
        after, _ = k.module.step(p, other, u, 2e-2)
        grown = max(grown, abs(after.zeta - one.zeta) / 0.1)
    return statement_claim(
        "iftomm2013.exists",
        "Prop. 1",
        "one step against two halves [N], and distance of two solutions after a step over that before",
        "1",
        "Prop. 1: the system 'has a unique solution over [0, T]'",
        {"step and halves": Condition(apart, "<=", 1e-6), "two solutions": Condition(grown, "<=", 1.0)},
        assumed=(SYMBOLS,),
        why={Verdict.CONSISTENT: "v and a held: the step is the flow, and the flow contracts (F_f > 0)"},
    )


def _bounded(loops: dict[str, FloatArray]) -> list[Claim]:
    p = kernel(MODEL).params("published")
    ceiling = max(p.rho1 + max(p.mu1, 0.0) + max(p.mu2, 0.0), p.rho2 + max(p.mu3, 0.0) + abs(p.mu4))
    k, n = (value for value, _ in (kernel(MODEL).presets["reading_c"].printed[name] for name in ("k", "n")))
    return [
        statement_claim(
            "iftomm2013.bibo",
            "Prop. 2",
            "max |F| over the motion",
            "N",
            "Prop. 2: for sigma >= 0.5, n >= 1 'the friction force F(t) given by Eq. (3) is bounded'",
            {name: Condition(float(np.abs(f).max()), "<=", ceiling) for name, f in loops.items()},
            assumed=(MOTION, SYMBOLS),
            why={Verdict.CONSISTENT: "the bound is sup F_f, for F_f > 0"},
            method=Method.CO_SIMULATION,
        ),
        statement_claim(
            "iftomm2013.reading_signed",
            "Prop. 2",
            "max |F| in 5 s of release at 3 mm/s if F_f is negative for v < 0, Eq. (2) as printed, reading C",
            "N",
            "Prop. 2: 'for all possibilities of the sign' of v and zeta F is bounded",
            {"F_f < 0 for v < 0": Condition(_largest(-1.2, k, n), "<=", ceiling)},
            kind=Kind.READING,
            why={Verdict.READING_EXCLUDED: "the equilibrium is lost and F runs away: F_f is a magnitude"},
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


def _dissipation(run: Trajectory, loops: dict[str, FloatArray]) -> list[Claim]:
    stiffness = {name: kernel(MODEL).params(preset).k * 1e-3 for name, preset in READINGS.items()}  # N/mm
    x = run.columns["reference.y"]

    # the unit holds v over a step: its travel is off by up to a h^2/2 from that of the reference
    held = 0.5e3 * float(np.abs(run.columns["reference.ddy"]).max()) * float(run.time[1] - run.time[0])  # mm/s

    def margins(slope: Mapping[str, float]) -> dict[str, Condition]:
        found = {}
        for name, force in loops.items():
            work = 0.5 * (force[1:] + force[:-1]) * np.diff(x) * 1e3
            stored = np.diff(force**2) / (2.0 * slope[name])
            off = float(np.abs(force).max()) * held
            found[name] = Condition(float(((work - stored) / np.diff(run.time)).min()), ">=", -off)
        return found

    return [
        statement_claim(
            "iftomm2013.storage",
            "Prop. 3",
            "least F v - dW/dt, W = zeta^2/2",
            "N.mm/s",
            "Prop. 3: dissipative 'with respect to the storage function W = zeta^2/2'",
            margins(dict.fromkeys(loops, 1.0)),
            assumed=(MOTION, SYMBOLS),
            why={
                Verdict.NOT_DETERMINED: "it holds only where the slope k of F is 1 N/mm: mild evidence for reading A "
                "(the limit is what a speed that is held over a step leaves open)"
            },
            method=Method.CO_SIMULATION,
        ),
        statement_claim(
            "iftomm2013.dissipative",
            "Prop. 3",
            "least F v - dW/dt, W = F^2/(2 k)",
            "N.mm/s",
            "Prop. 3: 'the system is dissipative'",
            margins(stiffness),
            assumed=(MOTION, SYMBOLS),
            why={Verdict.CONSISTENT: "with the storage that fits the slope of F it holds in all readings"},
            method=Method.CO_SIMULATION,
        ),
    ]
