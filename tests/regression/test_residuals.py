"""Tests of residuals and the floor that repeated motions give, against what the noise was made with."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.residuals import noise_floor, period_of, residual_tests

DT = 0.0037


def first_order(pole: float, seed: int, rows: int = 6000) -> np.ndarray:
    return lfilter([1.0], [1.0, -pole], np.random.default_rng(seed).standard_normal(rows))


def times(rows: int = 6000) -> np.ndarray:
    return 1.7 + DT * np.arange(rows)


@pytest.mark.parametrize("pole", [0.0, 0.55, 0.9])
def test_first_order_noise_has_the_watson_and_the_time_of_its_pole(pole: float) -> None:
    found = residual_tests([times()], [first_order(pole, 31)])
    assert found.durbin_watson == pytest.approx(2.0 * (1.0 - pole), abs=0.1)
    assert found.correlation_time_s == pytest.approx(DT * (1.0 + pole) / (1.0 - pole), rel=0.2)
    assert (found.ljung_box_p < 1e-6) == (pole > 0.0)


def test_white_residuals_are_white_as_often_as_they_should_be() -> None:
    """P values of white noise are uniform: of 200, those below 0.1 are binomial."""
    p = [residual_tests([times(300)], [first_order(0.0, 100 + k, 300)]).ljung_box_p for k in range(200)]
    assert 6 <= sum(value < 0.1 for value in p) <= 36  # 20 expected, 3.8 deviations


def test_several_runs_take_the_worst_and_pay_for_looking_often() -> None:
    mild, white = first_order(0.05, 5, 900), first_order(0.0, 8, 900)
    alone, beside = residual_tests([times(900)], [mild]), residual_tests([times(900)] * 2, [mild, white])
    assert beside.ljung_box_p == pytest.approx(min(1.0, 2.0 * alone.ljung_box_p), rel=1e-9)
    each = [residual_tests([times(900)], [one]).durbin_watson for one in (mild, white)]
    assert beside.durbin_watson == pytest.approx(np.mean(each))
    slow = residual_tests([times(900), 3.0 * times(900)], [white, white])
    assert slow.correlation_time_s == pytest.approx(3.0 * residual_tests([times(900)], [white]).correlation_time_s)


def test_normality_is_jarque_and_bera_of_independent_samples() -> None:
    x = np.random.default_rng(4).exponential(size=500)
    z = (x - x.mean()) / x.std()
    statistic = x.size / 6.0 * (np.mean(z**3) ** 2 + 0.25 * (np.mean(z**4) - 3.0) ** 2)
    found = residual_tests([times(500)], [x])
    assert found.jarque_bera_p == pytest.approx(float(chi2.sf(statistic, 2)), abs=1e-12)
    slow = [residual_tests([times(6000)], [first_order(0.99, seed)]).jarque_bera_p for seed in range(8)]
    assert min(slow) > 1e-4  # slow, but normal


@pytest.mark.parametrize("error", [np.zeros(600), np.full(600, 0.3), np.arange(19.0)])
def test_what_cannot_be_tested_accuses_nobody(error: np.ndarray) -> None:
    found = residual_tests([times(error.size)], [error])
    assert math.isnan(found.durbin_watson)
    assert found.ljung_box_p == 1.0


def run(inputs: np.ndarray, targets: np.ndarray, t: np.ndarray | None = None) -> FitRun:
    return FitRun("one", DT * np.arange(len(inputs)) if t is None else t, inputs, targets)


def motion(period: int, rows: int, harmonic: float = 0.4) -> np.ndarray:
    phase = 2.0 * np.pi * np.arange(rows) / period
    return np.sin(phase + 0.3) + harmonic * np.sin(3.0 * phase)


@pytest.mark.parametrize("period", [131, 200, 477])
@pytest.mark.parametrize("second", [1.0, 1e6])
def test_the_floor_is_the_noise_that_does_not_repeat(period: int, second: float) -> None:
    """A law of the motion, however wild, repeats; two channels of very different noise keep their own."""
    rng, x = np.random.default_rng(period), motion(period, 3000)
    law = np.column_stack([np.sign(x) + x**3, second * np.cos(5.0 * x)])
    noise = rng.standard_normal((3000, 2)) * (0.013, 0.21 * second)
    found = run(np.column_stack([x, -40.0 * x]), law + noise)
    assert period_of(found) == period
    floor = noise_floor(found)
    assert floor is not None
    assert floor == pytest.approx([0.013, 0.21 * second], rel=0.05)


def test_no_period_no_floor() -> None:
    x = motion(200, 3000)
    chirp = np.sin(1e-5 * np.arange(3000.0) ** 2)
    uneven = np.cumsum(np.random.default_rng(2).uniform(0.5, 1.5, 3000)) * DT
    targets = np.zeros((3000, 1))
    assert period_of(run(x[:, None], targets)) == 200
    assert period_of(run(chirp[:, None], targets)) is None
    assert period_of(run(x[:, None], targets, uneven)) is None
    assert period_of(run(motion(2000, 3000)[:, None], targets)) is None  # not even twice
    assert period_of(run(np.column_stack([x, np.arange(3000.0)]), targets)) is None  # one input alone is not enough
    assert period_of(run(np.column_stack([x, 1e-7 * chirp]), targets)) is None  # nor counts its unit
    assert period_of(run(np.full((3000, 1), 0.7), targets)) is None
    assert noise_floor(run(chirp[:, None], targets)) is None
