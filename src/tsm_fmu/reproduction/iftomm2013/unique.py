"""IFToMM 2013: is its set of parameters unique? An identification as an experiment: the published set, played and lost.

The FMU of the model plays the multi-periodic motion; its force gets the noise that the reported error of 0.4 N peak
to peak leaves room for, and the 15 values are identified from it, by the papers' way (genetic search, then simplex)
and by ours (least squares from several starts).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...cosim.trajectory import Trajectory
from ...identification.fit import fit
from ...kernels.kernel import kernel
from ...regression.problem import FitRun
from ...regression.specification import search_space
from ..claims import Claim, Method, Open, statement_claim
from ..verdict import Condition, Kind, Verdict
from .printed import ERROR

MODEL = "SingleTsmBoucWen"
ROWS_S = 1e-2
NOISE_N = ERROR.span.middle / 6.0
"""Normal noise whose +-3 sigma is the reported error."""
FIXED = ("zeta_0",)


@dataclass(frozen=True)
class Recovered:
    """What one method found: values over true ones, half-widths of the 95 % intervals over the value, rms left [N]."""

    ratios: Mapping[str, float]
    widths: Mapping[str, float]
    rms: float


def recovered(run: Trajectory, method: str) -> Recovered:
    """Identify the published set from the FMU's force with noise; start values are 20 % off."""
    every = max(1, round(ROWS_S / (run.time[1] - run.time[0])))
    kept = slice(0, round(10.0 / (run.time[1] - run.time[0])), every)
    rng = np.random.default_rng(2013)
    force = run.columns["plant.F"][kept]
    rest = np.zeros(force.size)
    inputs = np.column_stack([run.columns["reference.dy"][kept], run.columns["reference.ddy"][kept], rest, rest])
    noisy = force + rng.normal(0.0, NOISE_N, force.size)
    k = kernel(MODEL)
    truth = {v.name: float(getattr(k.params("published"), v.field)) for v in k.parameters}
    names = [v.name for v in k.parameters if v.name not in FIXED]
    off = {n: truth[n] * (1.0 + 0.2 * (-1.0) ** i) for i, n in enumerate(names)}
    space = search_space(k, "published", off, FIXED)
    found = fit(
        k, [FitRun("multi-periodic", run.time[kept], inputs, noisy[:, None])], ["F"], space, method=method, seed=1
    )
    fitted = {v.name: found.parameters[v.field] for v in k.parameters if v.name in names}
    widths = {
        n: 1.96 * p.stderr / abs(p.value) if p.stderr is not None and p.value else float("inf")
        for n, p in fitted.items()
    }
    values = {n: float(p.value) for n, p in fitted.items()}
    model = k.simulate(k.params("published", values), run.time[kept], inputs)[:, 0]
    return Recovered({n: values[n] / truth[n] for n in names}, widths, float(np.sqrt(np.mean((model - force) ** 2))))


def unique_claim(run: Trajectory, quick: bool) -> Claim:
    """Row on the sentence that the parameters are unique."""
    methods = {"least squares": "fast"} | ({} if quick else {"genetic search, simplex": "paper"})
    found = {name: recovered(run, method) for name, method in methods.items()}
    readings = {
        name: Condition(float(max(abs(ratio - 1.0) for ratio in r.ratios.values())), "<=", 1.0)
        for name, r in found.items()
    }
    ours = found["least squares"]
    loose = sorted(n for n, width in ours.widths.items() if width > 1.0)
    readings["95 % interval over value"] = Condition(float(min(max(ours.widths.values()), 1e9)), "<=", 1.0)
    rms = ", ".join(f"{r.rms:.3f} N ({name})" for name, r in found.items())
    return statement_claim(
        "iftomm2013.unique",
        ("Fig. 4", "Prop. 1"),
        "largest relative deviation of a recovered parameter from the published one",
        "1",
        "'help to ensure that the model parameters in the identification process are unique'",
        readings,
        kind=Kind.MEASUREMENT,
        assumed=(
            Open("noise", f"{NOISE_N:.3f} N rms", "what fits into the reported 0.4 N peak to peak"),
            Open("motion", "3 mm at 0.2 Hz and 2 mm at 0.35 Hz", "not printed"),
        ),
        why={
            verdict: f"the force is recovered to {rms} rms, but "
            + (f"{', '.join(loose)} are not: other values serve as well" if loose else "no value is lost")
            for verdict in (Verdict.NOT_DETERMINED, Verdict.NOT_EXPLAINED)
        },
        method=Method.CO_SIMULATION,
    )
