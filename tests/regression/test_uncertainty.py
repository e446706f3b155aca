"""Covariances against closed forms of linear fits: per-run values, two channels, what no log determines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from statsmodels.stats.sandwich_covariance import S_hac_simple

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression import uncertainty as module
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.specification import per_run_fields, search_space
from tsm_fmu.regression.uncertainty import BANDWIDTH, autocorrelation_time, uncertainty


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


def offset_only(noise: list[np.ndarray]) -> Problem:
    """A backlash whose x_0 alone is free, and whose runs err by this noise: the estimate is a mean."""
    model, runs = kernel("PairedTsmBacklash"), []
    for number, one in enumerate(noise):
        t = 0.011 * np.arange(one.size)
        x = 0.6 * np.sin(3.1 * t + number)
        runs.append(FitRun(f"r{number}", t, x[:, None], np.zeros((one.size, 1))))
    problem = Problem(model, runs, ("x_out",), search_space(model).freeing_only(["x_0"]))
    outputs = problem.outputs_of_all(problem.start())
    exact = [replace(r, targets=y - n[:, None]) for r, y, n in zip(runs, outputs, noise, strict=True)]
    return replace(problem, runs=exact)


@pytest.mark.parametrize(("rows", "pole"), [(900, 0.0), (900, 0.6), (300, 0.97), (37, 0.9)])
def test_the_error_of_a_mean_is_newey_wests(rows: int, pole: float) -> None:
    """Lags by the autocorrelation time, but not beyond a tenth of the run."""
    noise = lfilter([0.1], [1.0, -pole], np.random.default_rng(rows).standard_normal(rows))
    known = uncertainty(offset_only([noise]), offset_only([noise]).start(), frozenset())
    tau = autocorrelation_time(noise)
    lags = min(int(np.ceil(BANDWIDTH * tau)), max(1, rows // 10))
    variance = float(S_hac_simple(noise[:, None], nlags=lags - 1)[0, 0]) / rows**2
    assert known.stderr["x_0"] == pytest.approx(np.sqrt(variance), rel=1e-5)
    assert known.effective_samples == pytest.approx(rows / tau, rel=1e-9)
    assert known.correlation_time == pytest.approx(tau)
    assert known.calibration["x_0"] == pytest.approx(variance * rows, rel=1e-4) or known.calibration["x_0"] > 0.0


def test_runs_add_their_information_and_each_its_own_correlation() -> None:
    rng = np.random.default_rng(3)
    slow, quick = lfilter([0.1], [1.0, -0.95], rng.standard_normal(800)), 0.3 * rng.standard_normal(500)
    problem = offset_only([slow, quick])
    known = uncertainty(problem, problem.start(), frozenset())
    total = 0.0
    for noise in (slow, quick):
        lags = min(int(np.ceil(BANDWIDTH * autocorrelation_time(noise))), noise.size // 10)
        total += float(S_hac_simple(noise[:, None], nlags=lags - 1)[0, 0])
    assert known.stderr["x_0"] == pytest.approx(np.sqrt(total) / 1300, rel=1e-5)
    assert known.correlation_time == pytest.approx(max(map(autocorrelation_time, (slow, quick))))
    assert known.effective_samples == pytest.approx(sum(n.size / autocorrelation_time(n) for n in (slow, quick)))


def test_each_run_has_the_error_of_its_own_mean() -> None:
    noise = [size * np.random.default_rng(k).standard_normal(600) for k, size in enumerate((0.02, 0.31))]
    whole = offset_only(noise)
    each = replace(whole, space=whole.space.with_per_run(per_run_fields(whole.kernel)))
    known = uncertainty(each, each.start(), frozenset())
    assert known.stderr == {}
    for found, one in zip(known.per_run, noise, strict=True):
        (alone,) = (offset_only([one]),)
        assert found["x_0"] == pytest.approx(uncertainty(alone, alone.start(), frozenset()).stderr["x_0"], rel=1e-5)


def test_a_parameter_of_each_channel_has_the_error_that_its_channel_gives() -> None:
    """x_out with noise of 0.003 rad gives x_0, tau_in with 0.2 N.m the ratio: white, so by the usual formula."""
    rng, model = np.random.default_rng(8), kernel("TendonDrive")
    t = 0.013 * np.arange(1500)
    load = 1.1 + 0.3 * np.cos(0.7 * t)
    run = FitRun("r", t, np.column_stack([0.9 * np.sin(2.3 * t), load]), np.zeros((1500, 2)))
    problem = Problem(model, [run], ("x_out", "tau_in"), search_space(model).freeing_only(["x_0", "ratio"]))
    (exact,) = problem.outputs_of_all(problem.start())
    noisy = exact + rng.standard_normal((1500, 2)) * (0.003, 0.2)
    problem = replace(problem, runs=[replace(run, targets=noisy)])
    known = uncertainty(problem, problem.start(), frozenset())
    assert known.stderr["x_0"] == pytest.approx(0.003 / np.sqrt(1500), rel=0.25)
    assert known.stderr["ratio"] == pytest.approx(0.2 / np.sqrt(np.sum(load**2)), rel=0.25)
    assert known.correlation == pytest.approx(np.eye(2), abs=0.2)
    held = uncertainty(problem, problem.start(), frozenset({"ratio"}))
    assert held.names == ("x_0",)
    assert held.stderr["x_0"] == pytest.approx(known.stderr["x_0"], rel=0.05)
