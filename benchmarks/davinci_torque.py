"""Drive torque from drive angle and jaw torque: constant friction against friction that grows with the load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel, kernel

from .davinci_data import THINNED, Logs, Split, fit_from, fit_runs, rmse, values_of

CHANNELS = ("tau_in",)
CONSTANT = kernel("TendonDrive")
LOADED = chain("TendonDrive", ("load_dependence",))
COMPLETE = chain("TendonDrive", ("load_dependence", "offset_drift", "stiffness_hardening"))
SPEED_FILTER = {"tau_v": 0.02}
"""One count of the spindle a sample is 44 deg/s: the speed is averaged over more samples than by default [s]."""
CONSTANT_START = {**SPEED_FILTER, "tau_c": 0.05, "tau_s": 0.06}
LOADED_START = {**SPEED_FILTER, "tau_c": 0.05, "tau_s": 0.01, "v_s": 0.005, "load_dependence.k": 0.3}
"""Rest below sliding friction: with `fit`'s many starts both end in this basin, from tau_s > tau_c in a worse one."""
LUGRE = ("ratio", "sigma0", "sigma1", "sigma2", "tau_c", "tau_s", "v_s")
FREE: Mapping[str, tuple[str, ...]] = {
    "LuGre friction": LUGRE,
    "LuGre + load_dependence": (*LUGRE, "load_dependence.k"),
    "LuGre + load_dependence + offset + stiffness": (
        *LUGRE,
        "load_dependence.k",
        "offset_drift.b",
        "stiffness_hardening.k_1",
        "stiffness_hardening.k_3",
    ),
}
MODELS: Mapping[str, Kernel] = dict(zip(FREE, (CONSTANT, LOADED, COMPLETE), strict=True))


def fitted(what: str, logs: Logs, thin: int = THINNED) -> dict[str, float]:
    """Parameters of one of `MODELS`, fitted to the drive torque of all runs."""
    model = MODELS[what]
    start = CONSTANT_START if model is CONSTANT else LOADED_START
    return values_of(fit_from(model, start, FREE[what], fit_runs(model, logs, CHANNELS, thin), CHANNELS))


def error(what: str, values: Mapping[str, float], logs: Logs) -> float:
    """RMSE of the drive torque [N.m]."""
    return float(rmse(MODELS[what], values, logs, CHANNELS)[0])


def table(divisions: Sequence[Split], other_tool: Logs) -> Iterator[str]:
    """Rows of the table, in mN.m."""
    yield "| drive torque: tau_in from x_in and tau_out, RMSE [mN.m] | fitted runs | held-out runs | T4L2 |"
    yield "| --- | ---: | ---: | ---: |"
    for split in divisions:
        for what in MODELS:
            values = fitted(what, split.fitted)
            numbers = (1e3 * error(what, values, logs) for logs in (split.fitted, split.held_out, other_tool))
            yield f"| {what}, {split.name} | {' | '.join(f'{n:.2f}' for n in numbers)} |"
