"""What a held-out run's first seconds say of its own parameters, and what they cannot say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.held_out import held_out_errors, settled
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.specification import per_run_fields, search_space

MODEL = kernel("TendonDrive")
X_OUT = [v.name for v in MODEL.outputs].index("x_out")


def run(name: str, seed: int, x_0: float, alpha: float, x_h_0: float) -> FitRun:
    """Samples of the exact motion, Eqs (9) and (10) of MSSP 2015 with beta -> 0, with 0.02 rad of slow error."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 23.0, 0.0117)
    x = 1.3 * np.sin(0.83 * t + seed) + 0.41 * np.sin(2.9 * t)
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    wander = np.interp(t, np.linspace(0.0, 23.0, 47), 0.02 * rng.normal(size=47))
    y = 0.97 * x + x_0 + x_h_0 * np.exp(-alpha * travel) + wander
    return FitRun(name, t, np.column_stack([x, np.zeros_like(x)]), y[:, None])


def problem(alpha: float, starts: list[tuple[float, float]]) -> tuple[Problem, np.ndarray]:
    runs = [run(f"run {k}", k, x_0, alpha, x_h_0) for k, (x_0, x_h_0) in enumerate(starts)]
    values = {"c": 0.97, "beta": -1e-4, "alpha": alpha}
    space = search_space(MODEL, None, values, per_run=per_run_fields(MODEL))
    found = Problem(MODEL, runs, ("x_out",), space)
    table = found.start()
    for name, column in (("x_0", 0), ("x_h_0", 1)):
        table[:, found.fields.index(name)] = [start[column] for start in starts]
    return found, table


def of(problem: Problem, row: np.ndarray, name: str) -> float:
    return float(row[problem.fields.index(name)])


def test_what_two_seconds_cannot_tell_apart_stays_near_the_runs_fitted() -> None:
    fitted, table = problem(1e-3, [(0.31, 0.07), (0.22, -0.04)])
    row = settled(fitted, table, run("held out", 7, 0.27, 1e-3, 0.02), fitted.per_run)
    # the sum is seen, the parts only over a travel of 1/alpha = 1000 rad
    assert of(fitted, row, "x_0") + of(fitted, row, "x_h_0") == pytest.approx(0.29, abs=0.04)
    assert abs(of(fitted, row, "x_h_0")) < 0.3


def test_a_state_that_ran_away_in_one_run_is_none_to_begin_from() -> None:
    """As the travel before a run that came to the log worn in: any large one fits it."""
    fitted, table = problem(3e3, [(0.31, 0.07), (0.22, -0.04), (0.27, 0.05)])  # forgotten within a sample
    table[2, fitted.fields.index("x_h_0")] = 4e3
    row = settled(fitted, table, run("held out", 7, 0.27, 3e3, 0.02), fitted.per_run)
    assert of(fitted, row, "x_h_0") == pytest.approx(0.07, abs=0.1)


@pytest.mark.parametrize("offset", [-7.3, 0.9, 12.6])
def test_an_offset_far_from_those_of_the_runs_fitted_is_found(offset: float) -> None:
    fitted, table = problem(6.1, [(0.31, 0.07), (0.22, -0.04)])
    row = settled(fitted, table, run("held out", 5, offset, 6.1, 0.05), fitted.per_run)
    assert of(fitted, row, "x_0") == pytest.approx(offset, abs=0.03)


def test_the_first_two_seconds_are_not_scored_and_the_rest_is_measured_minus_simulated() -> None:
    fitted, table = problem(6.1, [(0.31, 0.07), (0.22, -0.04)])
    asked = run("held out", 5, 0.9, 6.1, 0.05)
    shifted = replace(asked, time=asked.time + 41.3)  # seconds from its own start
    for one in (asked, shifted):
        (errors,) = held_out_errors(fitted, table, [one], fitted.per_run)
        assert errors.shape == (np.count_nonzero(one.time - one.time[0] >= 2.0), 1)
        assert np.std(errors) == pytest.approx(0.02 * np.sqrt(2.0 / 3.0), rel=0.3)  # the wander, linear between draws
    late = np.where(asked.time[:, None] >= 2.0, asked.targets + 0.43, asked.targets)
    (moved,) = held_out_errors(fitted, table, [replace(asked, targets=late)], fitted.per_run)
    (before,) = held_out_errors(fitted, table, [asked], fitted.per_run)
    assert moved - before == pytest.approx(0.43, abs=1e-9)  # what comes later gives the run nothing of its own
