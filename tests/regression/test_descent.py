"""The optimiser's view of a refit: few rows, the same problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.descent import Objective, triangle
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.projection import Eliminated, Projection
from tsm_fmu.regression.scaled_variables import ScaledVariables
from tsm_fmu.regression.sensitivity import sensitivity_scales
from tsm_fmu.regression.specification import per_run_fields, search_space


@pytest.mark.parametrize("rows", [3, 7, 8, 4001, 30_011])
@pytest.mark.parametrize("size", [0.0, 1.7e-3, 2.9e6])
def test_norms_and_slopes_are_those_of_all_rows(rows: int, size: float) -> None:
    rng = np.random.default_rng(rows)
    residual, columns = size * rng.normal(size=rows), rng.normal(size=(rows, 7)) @ np.diag(10.0 ** np.arange(-3, 4))
    turned = triangle(residual, columns)
    assert turned.shape == (8, 7)
    scale, norm = np.linalg.norm(columns, axis=0), float(np.linalg.norm(residual))
    few, whole = turned / scale, columns / scale
    assert np.abs(few.T @ few - whole.T @ whole).max() < 1e-13
    assert np.abs(norm * few[0] - whole.T @ residual).max() <= 1e-13 * norm


def test_a_step_is_that_of_all_rows() -> None:
    rng = np.random.default_rng(3)
    residual, columns = rng.normal(size=911), rng.normal(size=(911, 5))
    turned, first = triangle(residual, columns), np.append(np.linalg.norm(residual), np.zeros(5))
    whole, few = (np.linalg.lstsq(a, -b, rcond=None)[0] for a, b in ((columns, residual), (turned, first)))
    assert np.allclose(whole, few, rtol=1e-11, atol=0.0)


@pytest.mark.parametrize("beyond", [0.3, 1e-3, 1e-5])
def test_of_many_rows_columns_that_are_nearly_alike_are_told_apart(beyond: float) -> None:
    """The products of the columns hold no digit of what is less than 1e-8 of them."""
    rng = np.random.default_rng(5)
    residual, columns = rng.normal(size=31_013), rng.normal(size=(31_013, 4))
    columns[:, 2] = columns[:, 1] + beyond * columns[:, 2]
    turned, first = triangle(residual, columns), np.append(np.linalg.norm(residual), np.zeros(4))
    whole, few = (np.linalg.lstsq(a, -b, rcond=None)[0] for a, b in ((columns, residual), (turned, first)))
    assert np.allclose(whole, few, rtol=1e-7, atol=0.0)


@pytest.mark.parametrize("lead", [0, 37])
@pytest.mark.parametrize("tie", [0.0, 3.1])
def test_slopes_are_those_of_every_value_moved_alone(lead: int, tie: float) -> None:
    """Values of runs are moved at once, and what ties them to their mean acts on the others too."""
    model, rng, runs = kernel("PairedTsmBacklash"), np.random.default_rng(9), []
    for number, size in enumerate((311, 197, 460)):
        t = 0.011 * np.arange(size)
        x = 0.6 * np.sin(3.1 * t + number)
        run = FitRun(f"run {number}", t, x[:, None], (0.8 * x + 0.05 * rng.normal(size=size))[:, None])
        runs.append(run.compared_from(lead) if lead else run)
    problem = Problem(model, runs, ("x_out",), search_space(model, per_run=per_run_fields(model)))
    start = problem.start() * rng.uniform(0.9, 1.1, (3, len(problem.fields)))
    shared = [problem.fields.index(f) for f in problem.shared]
    start[:, shared] = start[0, shared]
    problem = replace(problem, pooling={problem.per_run[0]: tie} if tie else {})
    variables = ScaledVariables(
        problem, problem.shared, problem.per_run, sensitivity_scales(problem.starting_at(start)), start
    )
    assert len(problem.per_run) == 2
    j = problem.fields.index(problem.per_run[0])

    def whole(q: np.ndarray) -> np.ndarray:
        table = variables.table(q)
        parts = [problem.residual(k, table[k]) for k in range(3)]
        return np.concatenate([*parts, tie * (table[:, j] - table[:, j].mean())])

    q, turned = variables.of(start), Objective(problem, variables, Projection(problem, Eliminated(), {}), 1e-5)
    residual = whole(q)
    columns = np.column_stack([(whole(q + h) - residual) / 1e-5 for h in 1e-5 * np.eye(q.size)])
    found = turned.jacobian(q)
    assert turned.residual(q)[0] == pytest.approx(np.linalg.norm(residual), rel=1e-13)
    assert np.allclose(found.T @ found, columns.T @ columns, rtol=0.0, atol=1e-9 * np.abs(columns.T @ columns).max())
    assert np.allclose(
        found.T @ turned.residual(q), columns.T @ residual, rtol=0.0, atol=1e-9 * np.linalg.norm(residual)
    )
