"""Sensitivities by finite differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.sensitivity import output_jacobian
from tsm_fmu.regression.specification import search_space

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
