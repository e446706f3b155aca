"""Sensitivities by finite differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.sensitivity import output_jacobian, residual_jacobian, sensitivity_scales
from tsm_fmu.regression.specification import per_run_fields, search_space

MODEL = kernel("TendonDrive")


@pytest.fixture
def problem() -> Problem:
    t = 0.013 * np.arange(301)
    inputs = np.column_stack([0.9 * np.sin(2.3 * t), 1.1 + 0.3 * np.cos(0.7 * t)])
    run = FitRun("run", t, inputs, np.zeros((301, 2)))
    return Problem(MODEL, [run], ("x_out", "tau_in"), search_space(MODEL))


def test_the_slope_of_a_linear_parameter_is_what_it_multiplies(problem: Problem) -> None:
    """tau_in = ratio tau_out + friction."""
    weights = np.array([2.0, 5.0])
    free = replace(problem, space=problem.space.freeing_only(["ratio"]))
    slopes = output_jacobian(free, free.start(), weights).reshape(301, 2)
    assert slopes[:, 0] == pytest.approx(0.0, abs=1e-9)
    assert slopes[:, 1] == pytest.approx(5.0 * problem.runs[0].inputs[:, 1], rel=1e-6)


def test_nothing_free_is_a_matrix_without_columns(problem: Problem) -> None:
    held = replace(problem, space=problem.space.freeing_only([]))
    assert output_jacobian(held, held.start(), np.ones(2)).shape == (602, 0)


@pytest.fixture
def two_runs() -> Problem:
    model, runs = kernel("PairedTsmBacklash"), []
    for number, rows in enumerate((211, 340)):
        t = 0.011 * np.arange(rows)
        x = 0.6 * np.sin(3.1 * t + number) + 0.2
        runs.append(FitRun(f"r{number}", t, x[:, None], (0.8 * x)[:, None]))
    return Problem(model, runs, ("x_out",), search_space(model, per_run=per_run_fields(model)))


def test_an_offset_of_a_run_moves_that_run_and_by_as_much(two_runs: Problem) -> None:
    """x_out = c x_in + ... + x_0: of the outputs weighted by 3.7 the derivative is 3.7 in the run's own column."""
    only = replace(two_runs, space=two_runs.space.freeing_only(["x_0"]))
    found = output_jacobian(only, only.start(), np.array([3.7]))
    assert found.shape == (551, 2)
    assert found[:211] == pytest.approx(np.tile([3.7, 0.0], (211, 1)), abs=1e-7)
    assert found[211:] == pytest.approx(np.tile([0.0, 3.7], (340, 1)), abs=1e-7)


@pytest.mark.parametrize("at", ["lo", "hi"])
@pytest.mark.parametrize("what", ["outputs", "residuals", "scales"])
def test_differences_at_a_bound_are_taken_inside(
    two_runs: Problem, at: str, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is simulated beyond a bound, and the slope of a linear parameter is the same from either side."""
    start = two_runs.space["c"].start
    bounds = {at: start, "lo" if at == "hi" else "hi": start + (0.5 if at == "lo" else -0.5)}
    problem = replace(two_runs, space=two_runs.space.freeing_only(["c"]).with_bounds("c", **bounds))
    asked, column = [], problem.fields.index("c")
    for name in ("outputs_at", "residuals"):
        original = getattr(Problem, name)

        def spy(self, wanted, original=original):
            asked.extend(float(row[column]) for _, row in wanted)
            return original(self, wanted)

        monkeypatch.setattr(Problem, name, spy)
    if what == "outputs":
        slope = output_jacobian(problem, problem.start(), np.ones(1))
        free = replace(two_runs, space=two_runs.space.freeing_only(["c"]))
        assert slope == pytest.approx(output_jacobian(free, free.start(), np.ones(1)), rel=1e-6, abs=1e-8)
        asked = asked[: len(asked) // 2]  # those of the bounded problem
    elif what == "residuals":
        table = problem.start()
        base = problem.residuals(list(enumerate(table)))
        residual_jacobian(problem, table, base, ["c"], sensitivity_scales(problem))
    else:
        assert sensitivity_scales(problem)["c"] == pytest.approx(sensitivity_scales(two_runs)["c"], rel=1e-6)
        return
    assert len(set(asked)) > 1
    assert min(asked) >= min(bounds.values())
    assert max(asked) <= max(bounds.values())


def test_the_slope_of_a_linear_parameter_is_the_same_on_either_side_of_zero(two_runs: Problem) -> None:
    """D x_out / d x_0 = 1 at any x_0, small and large, negative too; residuals are measured minus simulated."""
    only = replace(two_runs, space=two_runs.space.freeing_only(["x_0"]))
    scales, column = sensitivity_scales(only), only.fields.index("x_0")
    for value in (-0.31, -1e-3, 0.0, 1e-3, 0.31):
        table = only.start()
        table[:, column] = value
        base = only.residuals(list(enumerate(table)))
        found = residual_jacobian(only, table, base, ["x_0"], scales)
        expected = np.zeros((551, 2))
        expected[:211, 0] = expected[211:, 1] = found[0, 0]
        assert abs(found[0, 0]) == pytest.approx(only.weights[0], rel=1e-5)
        assert found == pytest.approx(expected, rel=1e-5, abs=1e-5 * abs(found[0, 0]))


def test_the_scale_of_a_parameter_that_does_nothing_is_infinite(two_runs: Problem) -> None:
    still = [replace(run, inputs=np.zeros_like(run.inputs)) for run in two_runs.runs]
    scales = sensitivity_scales(replace(two_runs, runs=still))
    assert scales["c"] == np.inf
    assert np.isfinite(scales["x_0"])


def test_a_parameter_whose_change_overflows_has_no_scale(two_runs: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scale of zero would divide by zero where the search is scaled."""
    simulated = Problem.outputs_at

    def overflowing(self: Problem, points) -> list[np.ndarray]:
        return [y * 10.0 ** (200 * (k >= 2)) for k, y in enumerate(simulated(self, points))]

    monkeypatch.setattr(Problem, "outputs_at", overflowing)
    assert set(sensitivity_scales(two_runs).values()) == {np.inf}


def test_scales_are_of_all_runs_and_samples_together(two_runs: Problem) -> None:
    """x_0 moves every sample by itself: its scale is the spread that weights the channel, however many runs."""
    spread = 1.0 / two_runs.weights[0]
    assert sensitivity_scales(two_runs)["x_0"] == pytest.approx(spread, rel=1e-6)
    one = replace(two_runs, runs=two_runs.runs[:1])
    assert sensitivity_scales(one)["x_0"] == pytest.approx(1.0 / one.weights[0], rel=1e-6)
