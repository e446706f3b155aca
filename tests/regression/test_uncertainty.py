"""Covariances against closed forms of linear fits: per-run values, two channels, what no log determines."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.regression import uncertainty as module
from tsm_fmu.regression.uncertainty import autocorrelation_time


def made(rows: int, columns: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((rows, columns)) * np.geomspace(1e-3, 1e4, columns)


def test_white_scores_give_the_inverse_of_the_information() -> None:
    """White residuals of variance 1: the meat is the information, and the sandwich its inverse."""
    j = np.random.default_rng(3).standard_normal((50, 4))
    information = j.T @ j
    covariance, inverse, lost = module._sandwich(information, information)
    assert inverse == pytest.approx(np.linalg.inv(information), rel=1e-9)
    assert covariance == pytest.approx(inverse, rel=1e-9)
    assert not lost.any()
    covariance, _, _ = module._sandwich(information, 7.3 * information)  # residuals of variance 7.3
    assert covariance == pytest.approx(7.3 * inverse, rel=1e-9)


def test_a_direction_that_is_not_determined_takes_its_parameters_and_no_other() -> None:
    """Columns 0 and 2 act alike: their sum is known, neither of them is; column 1 is as if they were one."""
    j = np.random.default_rng(5).standard_normal((60, 2))
    j = np.column_stack([j[:, 0], j[:, 1], j[:, 0]])
    covariance, _, lost = module._sandwich(j.T @ j, j.T @ j)
    assert lost.tolist() == [True, False, True]
    two = np.linalg.inv(j[:, :2].T @ j[:, :2])
    assert covariance[1, 1] == pytest.approx(two[1, 1], rel=1e-9)
    total = np.array([1.0, 0.0, 1.0])
    assert total @ covariance @ total == pytest.approx(two[0, 0], rel=1e-9)


@pytest.mark.parametrize("extra", [0, 1, 3])
def test_the_condition_number_is_that_of_the_columns_without_what_runs_have_of_their_own(extra: int) -> None:
    """By projection: the shared columns less their part along the others, each over its norm before."""
    j = made(90, 3 + extra, 11)
    j[:, 1] += 0.8 * j[:, 0] / np.linalg.norm(j[:, 0]) * np.linalg.norm(j[:, 1])
    shared, rest = j[:, :3], j[:, 3:]
    left = shared - rest @ np.linalg.lstsq(rest, shared, rcond=None)[0] if extra else shared
    values = np.linalg.svd(left / np.linalg.norm(shared, axis=0), compute_uv=False)
    assert module._condition_number(j.T @ j, 3) == pytest.approx(values[0] / values[-1], rel=1e-6)
    assert module._condition_number(j.T @ j, 0) == 1.0
    j[:, 2] = 0.0
    assert module._condition_number(j.T @ j, 3) == np.inf


def test_a_series_without_noise_or_length_counts_each_sample() -> None:
    assert autocorrelation_time(np.full(400, -3.3)) == 1.0
    assert autocorrelation_time(np.array([1.0, -2.0, 0.5])) == 1.0
    x = np.random.default_rng(1).standard_normal(5000)
    assert autocorrelation_time(x + 1e3) == pytest.approx(autocorrelation_time(x), rel=1e-6)  # the mean is no motion
    assert autocorrelation_time(np.tile([1.0, -1.0], 200)) == 1.0  # never below one
