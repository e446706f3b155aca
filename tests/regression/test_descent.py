"""The optimiser's view of a refit: few rows, the same problem."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.descent import LONGER, PROMISING_STEPS, Descent, Objective, triangle
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


class Curved:
    """A narrow curved valley with noise at its ground, or scattered exponentials; counts its derivatives."""

    def __init__(self, valley: bool, lo: float, seed: int) -> None:
        self.noise = 0.3 * np.random.default_rng(seed).normal(size=40)
        self.valley, self.slopes_asked, self.t = valley, 0, np.linspace(0.0, 2.0, 40)
        self.variables = SimpleNamespace(axes=[0, 1], lo=np.full(2, lo), hi=np.full(2, np.inf))

    def at(self, q: np.ndarray) -> np.ndarray:
        return self.residual(q)

    def residual(self, q: np.ndarray) -> np.ndarray:
        if self.valley:
            return np.concatenate([[10.0 * (q[1] - q[0] ** 2), 1.0 - q[0]], 0.1 * self.noise])
        return np.exp(-q[0] * self.t) + q[1] * self.t - np.exp(-0.7 * self.t) - 0.4 * self.t + self.noise

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        self.slopes_asked += 1
        if self.valley:
            return np.vstack([[[-20.0 * q[0], 10.0], [-1.0, 0.0]], np.zeros((40, 2))])
        return np.column_stack([-self.t * np.exp(-q[0] * self.t), self.t])


@pytest.mark.parametrize("valley", [True, False])
@pytest.mark.parametrize("lo", [-np.inf, -1.3, 0.45])
@pytest.mark.parametrize(("change", "steps"), [(1e-4, 2), (1e-4, 5), (1e-1, 60), (1e-4, 60), (1e-9, 60)])
def test_a_descent_ends_where_scipys_does_and_asks_for_no_slope_that_is_not_used(
    valley: bool, lo: float, change: float, steps: int
) -> None:
    asked = []
    for seed in range(20):
        start = np.maximum(np.random.default_rng(seed).normal(size=2) * [1.0, 2.0], lo + 0.01)
        here, there = Curved(valley, lo, seed), Curved(valley, lo, seed)
        found = Descent(change, 1e-9, 1e-9, steps).descend(here, start)  # pyright: ignore[reportArgumentType]
        whole = least_squares(
            there.residual, start, there.jacobian, (there.variables.lo, there.variables.hi), x_scale="jac",
            ftol=change, xtol=1e-9, gtol=1e-9, max_nfev=steps,
        )  # fmt: skip
        assert found.tolist() == whole.x.tolist()
        asked.append((here.slopes_asked, there.slopes_asked))
    assert all(one <= other for one, other in asked)
    assert any(one < other for one, other in asked) or change < 1e-8  # which ends where the slope vanishes


@pytest.mark.parametrize("lo", [-np.inf, -1.3])
def test_a_descent_that_comes_near_what_is_of_use_goes_on_as_ever_and_another_is_given_up(lo: float) -> None:
    given_up = 0
    for seed in range(20):
        start = np.maximum(np.random.default_rng(seed).normal(size=2) * [1.0, 2.0], lo + 0.01)
        free, tied = Curved(True, lo, seed), Curved(True, lo, seed)
        whole = Descent(1e-9, 1e-9, 1e-9).descend(free, start)  # pyright: ignore[reportArgumentType]
        at_most = 1.1 * float(np.sum(free.residual(whole) ** 2)) + 0.5
        found = Descent(1e-9, 1e-9, 1e-9, at_most=at_most).descend(tied, start)  # pyright: ignore[reportArgumentType]
        if found.tolist() == whole.tolist():
            continue
        given_up += 1
        assert float(np.sum(tied.residual(found) ** 2)) > at_most
        assert float(np.sum(tied.residual(found) ** 2)) <= float(np.sum(tied.residual(start) ** 2))
        assert tied.slopes_asked < min(free.slopes_asked, PROMISING_STEPS)
    assert 0 < given_up < 20


@pytest.mark.parametrize("steps", [4, 7])
def test_a_descent_that_is_under_way_goes_on_and_one_that_has_nearly_arrived_ends(steps: int) -> None:
    """Down a curved valley whose ground leaves nothing: each step gains a part of what is left."""
    arrived, longer = 0, 0
    for seed in range(20):
        start = np.random.default_rng(seed).normal(size=2) * [1.0, 2.0]
        short, far = Curved(True, -np.inf, seed), Curved(True, -np.inf, seed)
        at_once = Descent(1e-9, 1e-9, 1e-9, steps).descend(short, start)  # pyright: ignore[reportArgumentType]
        found = Descent(1e-9, 1e-9, 1e-9, steps, 0.01).descend(far, start)  # pyright: ignore[reportArgumentType]
        before, after = (float(np.sum(far.residual(q) ** 2)) for q in (at_once, found))
        least = float(np.sum((0.1 * far.noise) ** 2))
        assert after <= before
        assert far.slopes_asked < LONGER * steps
        longer += far.slopes_asked > short.slopes_asked
        if far.slopes_asked < LONGER * steps - 5:  # steps that are refused ask for no slope
            arrived += 1
            assert after <= 1.1 * least or far.slopes_asked <= steps
    assert 0 < longer
    assert 0 < arrived
