"""Zeros that move slowly: what is compared is what their free amplitudes would leave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.conftest import exponential
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.descent import Descent
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.slow_zero import SlowZero
from tsm_fmu.regression.specification import search_space

FUNCTIONS = 5


def stamps(seconds: float = 23.7, rows: int = 911) -> np.ndarray:
    """Uneven, and not from nought."""
    steps = np.random.default_rng(40).uniform(0.4, 1.6, rows)
    return 3.1 + np.cumsum(steps) * seconds / steps.sum()


def run_of(channels: int = 2) -> tuple[FitRun, np.ndarray]:
    """A run with noise for targets, and what a model might give."""
    rng, t = np.random.default_rng(41), stamps()
    y, x = rng.standard_normal((2, t.size, channels))
    return FitRun("r", t, x[:, :1], y), x


def waves(t: np.ndarray) -> np.ndarray:
    """The functions as the class says them, one a column."""
    return np.cos(np.pi * np.outer((t - t[0]) / (t[-1] - t[0]), np.arange(1, FUNCTIONS + 1)))


@pytest.mark.parametrize("constant", [False, True])
def test_functions_are_orthonormal_and_span_the_cosines(constant: bool) -> None:
    t = stamps()
    basis = SlowZero((0,), t[0], t[-1], FUNCTIONS, constant).basis(t)
    assert basis.shape == (t.size, FUNCTIONS + constant)
    np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-12)
    spanned = waves(t) if constant else waves(t) - waves(t).mean(axis=0)
    np.testing.assert_allclose(basis @ (basis.T @ spanned), spanned, atol=1e-12)
    ones = np.ones(t.size) / np.sqrt(t.size)
    assert float(np.sum((basis.T @ ones) ** 2)) == pytest.approx(float(constant), abs=1e-12)


@pytest.mark.parametrize("constant", [False, True])
def test_a_part_of_a_run_holds_fewer_of_them(constant: bool) -> None:
    """Slow functions are nearly alike within a short part: free there, all of them would be fast ones."""
    t = stamps()
    whole = SlowZero((0,), t[0], t[-1], FUNCTIONS, constant)
    sizes = [whole.basis(t[:n]).shape[1] for n in (911, 400, 91, 2, 1, 0)]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] == FUNCTIONS + constant
    assert sizes[2] <= 1 + constant
    assert sizes[-2:] == [int(constant), 0]


@pytest.mark.parametrize("constant", [False, True])
@pytest.mark.parametrize("compared", [1.0, 0.6])
def test_what_is_left_is_what_free_amplitudes_leave(constant: bool, compared: float) -> None:
    """Against ordinary least squares; of samples that are not compared nothing is asked."""
    run, y = run_of()
    known = np.random.default_rng(42).random(run.time.size) < compared
    if compared < 1.0:
        run = run.doubting(np.repeat(np.where(known, 0.0, np.inf)[:, None], 2, axis=1))
    free = run.with_slow_zero([1], FUNCTIONS, constant=constant)
    functions = waves(run.time) - (0.0 if constant else waves(run.time)[known].mean(axis=0))
    functions = np.column_stack([functions, np.ones(run.time.size)]) if constant else functions
    error = (y - run.targets)[:, 1]
    amplitudes = np.linalg.lstsq(functions[known], error[known], rcond=None)[0]
    expected = np.where(known, error - functions @ amplitudes, 0.0)
    np.testing.assert_allclose(free.excess(y)[1], expected, atol=1e-10)
    np.testing.assert_allclose((free.compared(y) - run.targets)[:, 1], expected, atol=1e-10)
    np.testing.assert_array_equal(free.excess(y)[0], run.excess(y)[0])
    np.testing.assert_array_equal(free.as_measured.excess(y), (y - run.targets).T)


def test_parts_and_thinned_copies_keep_the_functions_of_the_whole_run() -> None:
    run, _ = run_of()
    free = run.with_slow_zero([0], FUNCTIONS, constant=False)
    for part in (free.compared_from(300), free.only(run.time < 9.0), free.every(3)):
        assert part.slow_zero == free.slow_zero
    moved = replace(run, targets=run.targets + (waves(run.time) @ np.linspace(0.3, -0.7, FUNCTIONS))[:, None])
    for part in (slice(300, None), slice(None, None, 3)):
        one, other = (
            r.with_slow_zero([0, 1], FUNCTIONS, constant=True).only(np.isin(run.time, run.time[part]))
            for r in (run, moved)
        )
        y = np.zeros((one.time.size, 2))
        difference = np.sqrt(np.mean((one.excess(y) - other.excess(y)) ** 2))
        assert difference < 0.03, "a zero that moves slowly changes nothing but what a part hardly holds of it"


def test_a_model_that_stops_is_still_seen() -> None:
    run, y = run_of()
    y[411:] = np.nan
    free = run.with_slow_zero([0], FUNCTIONS, constant=False)
    assert np.isnan(free.excess(y)[0]).any()
    assert np.isnan(free.compared(y)[:, 0]).any()


def test_parameters_are_those_without_a_zero_that_wanders() -> None:
    """Of a Coulomb-and-viscous force in closed form; the wander is no sum of the cosines that are free."""
    t = np.arange(3000) * 0.01
    x = 0.11 * np.sin(7.3 * t) + 0.04 * np.sin(17.9 * t + 1.0)
    v = np.gradient(x, t)
    force = 0.83 * exponential(x, 0.0041) + 0.217 * v + 0.003 * np.random.default_rng(43).standard_normal(t.size)
    wander = 0.4 * np.tanh((t - 11.3) / 4.1) + 0.2 * np.exp(-(((t - 21.0) / 5.2) ** 2))
    model = kernel("LuGreFriction")
    start = {"F_c": 0.6, "F_s": 0.6, "v_s": 0.01, "sigma0": 150.0, "sigma1": 0.0, "sigma2": 0.1}
    space = search_space(model, None, start, ["v_s", "sigma1"])

    def found(y: np.ndarray, free: bool) -> tuple[dict[str, float], float]:
        """Parameters, and the RMS that is left."""
        run = FitRun("r", t, v[:, None], y[:, None])
        run = run.with_slow_zero([0], 6, constant=True) if free else run
        problem = Problem(model, [run], ("F",), space)
        table = Descent(1e-8, 1e-8, 1e-8, 60, 1e-5).refined(problem, problem.start())
        left = float(np.sqrt(np.mean(problem.gaps(table)[0] ** 2)))
        return dict(zip(problem.fields, table[0].tolist(), strict=True)), left

    clean, form = found(force, False)
    taken_out, left = found(force + wander, True)
    for name in ("F_c", "sigma0", "sigma2"):
        assert taken_out[name] == pytest.approx(clean[name], rel=0.02)
    assert left < 0.2 * wander.std()
    assert left > form, "a zero that is free explains nothing else"
