"""Motion of the jaw from the motion of the spindle: one parameter set for all runs against one for each run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tsm_fmu.identification.fit import Fit, fit
from tsm_fmu.kernels.arrays import FloatArray
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.residuals import noise_floor
from tsm_fmu.regression.specification import per_run_fields, search_space

from .davinci_data import SETTLED, THINNED, Logs, Split, fit_from, fit_runs, rmse, values_of

BACKLASH = kernel("PairedTsmBacklash")
STRETCHED = chain("TendonDrive", ("tendon_elasticity@x_out", "slack@x_out"))
"""Offset that moves with the load: the tendon's stretch, with the measured jaw and drive torque as its tensions."""
CHANNELS = ("x_out",)
START = {"c": 0.9, "beta": -0.5, "alpha": 20.0, "x_0": -1.2}
STRETCH_START = {**START, "x_out.tendon_elasticity.compliance": 1.0, "x_out.slack.w": 0.05}
STRETCH_FREE = (
    *START,
    "x_out.tendon_elasticity.compliance",
    "x_out.slack.w",
    "x_out.slack.F_0",
)


def settled(runs: Sequence[FitRun]) -> list[FitRun]:
    """The runs without their start-up."""
    return [FitRun(r.name, *(a[r.time > SETTLED] for a in (r.time, r.inputs, r.targets))) for r in runs]


def repeats(logs: Logs) -> float:
    """RMS by which the jaw angle does not repeat from period to period [rad], where the motion repeats.

    Raises
    ------
    ValueError
        If the motion of no run repeats.
    """
    floors = [noise_floor(run) for run in settled(fit_runs(BACKLASH, logs, CHANNELS, 1))]
    found = [floor[0] for floor in floors if floor is not None]
    if not found:
        raise ValueError("the motion of no run repeats")
    return float(np.sqrt(np.mean(np.square(found))))


def lines(logs: Logs) -> FloatArray:
    """RMSE of a straight line through x_out over x_in of each run [rad]."""
    errors = []
    for run in settled(fit_runs(BACKLASH, logs, CHANNELS, 1)):
        x, y = run.inputs[:, 0], run.targets[:, 0]
        errors.append(float(np.std(np.polynomial.Polynomial.fit(x, y, 1)(x) - y)))
    return np.array(errors)


def own_offsets(fitted: Logs, held_out: Logs | None = None, thin: int = THINNED) -> Fit:
    """PairedTsmBacklash with one gain and loop for all runs; offset and initial state are those of each run.

    A held-out run gives its offset and initial state in its first 2 s, which are not scored.
    """
    held = settled(fit_runs(BACKLASH, held_out, CHANNELS, thin)) if held_out else ()
    space = search_space(BACKLASH, None, START, per_run=per_run_fields(BACKLASH))
    runs = settled(fit_runs(BACKLASH, fitted, CHANNELS, thin))
    return fit(BACKLASH, runs, CHANNELS, space, holdout=held)


def each_alone(logs: Logs) -> FloatArray:
    """RMSE of PairedTsmBacklash fitted to each run alone [rad]."""
    return np.array([own_offsets({n: log}).measured["x_out"].rmse for n, log in logs.items()])


def stretched(logs: Logs, thin: int = THINNED) -> dict[str, float]:
    """Parameters of the stretched drive: one set, offset and initial state included, for all runs."""
    runs = fit_runs(STRETCHED, logs, CHANNELS, thin)
    return values_of(fit_from(STRETCHED, STRETCH_START, STRETCH_FREE, runs, CHANNELS))


def table(logs: Logs, divisions: Sequence[Split]) -> Iterator[str]:
    """Rows of the table, in degrees."""

    def row(what: str, fitted: float, held: float | None = None) -> str:
        return f"| {what} | {np.degrees(fitted):.3f} | {'' if held is None else f'{np.degrees(held):.3f}'} |"

    def spread(what: str, each: FloatArray) -> str:
        low, high = np.degrees([each.min(), each.max()])
        return row(f"{what}, pooled (each {low:.2f} to {high:.2f})", float(np.sqrt(np.mean(each**2))))

    yield "| motion: x_out from x_in, RMSE [deg] | fitted runs | held-out runs |"
    yield "| --- | ---: | ---: |"
    yield row("does not repeat from period to period (floor for any such model)", repeats(logs))
    yield spread("straight line fitted to each run", lines(logs))
    yield spread("PairedTsmBacklash fitted to each run", each_alone(logs))
    yield row("PairedTsmBacklash, one set, own offset, all runs", own_offsets(logs).measured["x_out"].rmse)
    for s in divisions:
        found = own_offsets(s.fitted, s.held_out)
        yield row(
            f"PairedTsmBacklash, own offset from 2 s, {s.name}",
            found.measured["x_out"].rmse,
            found.holdout["x_out"].rmse,
        )
    yield _stretched_row(row, "all runs", logs, None)
    for s in divisions:
        yield _stretched_row(row, s.name, s.fitted, s.held_out)


def _stretched_row(
    row: Callable[[str, float, float | None], str], what: str, fitted: Logs, held_out: Logs | None
) -> str:
    values = stretched(fitted)
    judged = None if held_out is None else float(rmse(STRETCHED, values, held_out, CHANNELS)[0])
    return row(
        f"TendonDrive + tendon_elasticity + slack, one set and offset, {what}",
        float(rmse(STRETCHED, values, fitted, CHANNELS)[0]),
        judged,
    )
