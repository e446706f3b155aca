"""Jaw angle and jaw torque from drive angle and drive torque alone, beside the published neural networks."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tsm_fmu.kernels.arrays import FloatArray
from tsm_fmu.kernels.chain import chain
from tsm_fmu.regression.specification import fit_run

from .davinci_data import Logs, Split, fit_from, fit_runs, rmse, values_of

CHANNELS = ("x_out", "tau_out")
PUBLISHED = (math.radians(0.37), 4.42e-3)
"""Errors of the neural networks [rad], [N.m]: O'Neill, Stephens, Kowalewski (2018), abstract."""
ESTIMATOR = chain(
    "DistalEstimator",
    (
        "load_dependence",
        "offset_drift",
        "stiffness_hardening",
        "tendon_elasticity@x_out",
        "creep@x_out",
        "slack@x_out",
        "stiffness_hardening@x_out",
        "load_dependence@x_out",
    ),
)
START = {
    "c": 0.9,
    "beta": -0.5,
    "alpha": 20.0,
    "x_0": -1.2,
    "ratio": 1.0,
    "tau_c": 0.05,
    "load_dependence.k": 0.3,
    "offset_drift.b": 0.0,
    "stiffness_hardening.k_1": 0.0,
    "stiffness_hardening.k_3": 0.0,
    "x_out.tendon_elasticity.compliance": 1.0,
    "x_out.tendon_elasticity.compliance_drive": 0.1,
    "x_out.creep.C": 0.1,
    "x_out.creep.tau": 3.0,
    "x_out.slack.w": 0.05,
    "x_out.slack.F_0": 0.01,
    "x_out.stiffness_hardening.k_3": 0.0,
    "x_out.stiffness_hardening.x_c": 0.5,
    "x_out.load_dependence.k": 0.0,
}
"""The fitted parameters and where they start: round numbers, the same for every split."""
THINNED_HELD = 2
"""In place of `davinci_data.THINNED`: a held load follows the peaks of a noisy torque; thinned logs have fewer."""
AT_MOST = {"x_out.slack.F_0": 0.013}
"""A tenth of the largest load [N.m], as a diagnosis bounds it (effects/slack.py): what takes more is a spring."""
FIXED = {"hold": 1, "tau_s": 0.05, "v_s": 1e-6, "sigma2": 0.0}
"""Load held while the drive sticks, Eq (D3); neither Stribeck nor viscous friction: v_s is below any speed here."""


def fitted(logs: Logs, thin: int = THINNED_HELD) -> tuple[dict[str, float], dict[str, float]]:
    """One parameter set for all runs, initial state and offset included; and its standard errors."""
    runs = fit_runs(ESTIMATOR, logs, CHANNELS, thin)
    found = fit_from(ESTIMATOR, {**FIXED, **START}, START, runs, CHANNELS, AT_MOST)
    fields = {v.name: v.field for v in ESTIMATOR.parameters}
    return values_of(found), {name: found.uncertainty.stderr.get(fields[name], math.nan) for name in START}


def error(values: Mapping[str, float], logs: Logs, clean: bool = False) -> FloatArray:
    """RMSE of jaw angle [rad] and jaw torque [N.m]; with ``clean``, without what the data gate calls disturbed."""
    return rmse(ESTIMATOR, values, logs, CHANNELS, clean)


def run_means(values: Mapping[str, float], logs: Logs) -> FloatArray:
    """RMS over the runs of each run's mean error: what a constant of its own would take away."""
    return np.sqrt(np.mean(np.square([_mean_error(values, {n: log}) for n, log in logs.items()]), axis=0))


def rezeroed(values: Mapping[str, float], logs: Logs) -> FloatArray:
    """RMSE after one constant for all runs together is taken from each channel: another zero of the sensors."""
    return np.sqrt(np.maximum(error(values, logs) ** 2 - _mean_error(values, logs) ** 2, 0.0))


def _mean_error(values: Mapping[str, float], logs: Logs) -> FloatArray:
    p = ESTIMATOR.params(None, values)
    runs = [(fit_run(ESTIMATOR, log.record, CHANNELS), log.scored()) for log in logs.values()]
    errors = [(ESTIMATOR.simulate(p, run.time, run.inputs) - run.targets)[keep] for run, keep in runs]
    return np.mean(np.concatenate(errors), axis=0)


def table(logs: Logs, divisions: Sequence[Split], other_tool: Logs) -> Iterator[str]:
    """Rows of the tables, in degrees and mN.m."""
    yield (
        "| jaw from x_in, tau_in alone: angle [deg], torque [mN.m] | fitted runs | held-out runs "
        "| of this, mean errors | no disturbance |"
    )
    yield "| --- | ---: | ---: | ---: | ---: |"
    yield f"| neural networks, published | | {_shown(np.array(PUBLISHED))} | | |"
    first: dict[str, float] = {}
    uncertain: dict[str, float] = {}
    for split in divisions:
        values, errors = fitted(split.fitted)
        first, uncertain = (first, uncertain) if first else (values, errors)
        held = error(values, split.held_out)
        clean = error(values, split.held_out, clean=True)
        yield (
            f"| {split.name} ({len(split.held_out)} runs): {_verdict(held)} | {_shown(error(values, split.fitted))} "
            f"| {_shown(held)} | {_shown(run_means(values, split.held_out))} | {_shown(clean)} |"
        )
    yield ""
    yield f"| parameters of '{divisions[0].name}' | angle [deg] | torque [mN.m] |"
    yield "| --- | ---: | ---: |"
    yield _row("T4L4, all runs", error(first, logs))
    yield _row("  of this, mean error of each run", run_means(first, logs))
    yield _row("T4L2, only judged", error(first, other_tool))
    yield _row("  less one constant for all its runs", rezeroed(first, other_tool))
    for name, key in (("A", "load"), ("Hz", "frequency")):
        groups: dict[float, dict] = defaultdict(dict)
        for n, log in logs.items():
            groups[getattr(log, key)][n] = log
        for level, group in sorted(groups.items()):
            yield _row(f"T4L4, {level} {name}", error(first, group))
    yield ""
    yield "| fitted parameter | unit | value | standard error |"
    yield "| --- | --- | ---: | ---: |"
    for v in ESTIMATOR.parameters:
        if v.name in START:
            yield f"| {v.name} | {v.quantity.unit} | {first[v.name]:.4g} | {uncertain[v.name]:.2g} |"


def _verdict(held: FloatArray) -> str:
    beaten = [what for what, ours, theirs in zip(("angle", "torque"), held, PUBLISHED, strict=True) if ours < theirs]
    return {0: "neither beaten", 1: f"{''.join(beaten)} beaten", 2: "both beaten"}[len(beaten)]


def _shown(errors: FloatArray) -> str:
    return f"{math.degrees(errors[0]):.3f}, {1e3 * errors[1]:.2f}"


def _row(what: str, errors: FloatArray) -> str:
    return f"| {what} | {math.degrees(errors[0]):.3f} | {1e3 * errors[1]:.2f} |"
