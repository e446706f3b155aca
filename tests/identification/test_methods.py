"""The papers' search ends where the fast one ends; residual tests and the noise floor say what they should."""

from __future__ import annotations

import math

import numpy as np
import pytest
import rig

from tsm_fmu.identification.fit import fit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.residuals import noise_floor, residual_tests
from tsm_fmu.regression.specification import per_run_fields, search_space

BACKLASH = kernel("PairedTsmBacklash")


@pytest.fixture(scope="module")
def run() -> FitRun:
    return rig.backlash_run("r", 21, noise=0.002)


def test_paper_method_ends_at_the_minimum_of_the_fast_one(run: FitRun) -> None:
    options = {"seed": 3}
    fast = fit(BACKLASH, [run], ("x_out",), search_space(BACKLASH, per_run=per_run_fields(BACKLASH)), **options)
    paper = fit(
        BACKLASH, [run], ("x_out",), search_space(BACKLASH, per_run=per_run_fields(BACKLASH)), method="paper", **options
    )
    assert paper.measured["x_out"].rmse == pytest.approx(fast.measured["x_out"].rmse, rel=1e-6)
    for name in ("c", "beta", "alpha", "x_0"):
        assert paper.parameters[name].value == pytest.approx(fast.parameters[name].value, rel=2e-3)
    assert paper.evaluations > 5 * fast.evaluations


def test_evolution_does_not_gather_behind_a_joint_condition() -> None:
    """The set of MSSP 2015 lies near c + beta = 0; what is drawn back on to it fits 20 times worse."""
    true = {"c": 1.0006, "beta": -0.917, "alpha": 10.1}
    time = np.arange(401) * 0.025
    x = 0.53 * np.sin(1.27 * time) + 0.49 * np.sin(2.71 * time)
    x_h = np.zeros(time.size)
    for k, dx in enumerate(np.diff(x)):  # Eq. (10) in closed form where x moves one way
        rest = math.exp(-true["alpha"] * abs(dx))
        x_h[k + 1] = x_h[k] * rest + true["beta"] / true["alpha"] * math.copysign(1.0 - rest, dx)
    y = true["c"] * x + x_h + np.random.default_rng(5).normal(0.0, 4.4e-4, time.size)
    space = search_space(BACKLASH, values={"c": 1.2, "beta": -0.73, "alpha": 12.0}, fixed=["x_0", "x_h_0"])
    found = fit(BACKLASH, [FitRun("r", time, x[:, None], y[:, None])], ("x_out",), space, method="paper", seed=1)
    assert found.measured["x_out"].rmse == pytest.approx(4.4e-4, rel=0.1)
    for name, value in true.items():
        assert found.parameters[name].value == pytest.approx(value, rel=5e-3), name
    assert not found.at_bound


def test_paper_method_repeats_itself(run: FitRun) -> None:
    results = [
        fit(
            BACKLASH,
            [run],
            ("x_out",),
            search_space(BACKLASH, fixed=["beta", "x_0", "x_h_0"]),
            method="paper",
            seed=9,
        )
        for _ in range(2)
    ]
    assert results[0].parameters.valuesdict() == results[1].parameters.valuesdict()


def test_white_residuals_pass_and_coloured_ones_do_not() -> None:
    time = np.arange(4000) * 0.005
    white = np.random.default_rng(31).standard_normal(4000)
    passed = residual_tests([time], [white])
    assert passed.ljung_box_p > 0.01
    assert passed.jarque_bera_p > 0.01
    assert passed.durbin_watson == pytest.approx(2.0, abs=0.1)
    failed = residual_tests([time, time], [white, rig.coloured(4000, 1.0, 32)])
    assert failed.ljung_box_p < 1e-6
    assert failed.correlation_time_s == pytest.approx(0.005 * 1.9 / 0.1, rel=0.3)


def test_heavy_tails_are_not_normal() -> None:
    time = np.arange(4000) * 0.005
    heavy = np.random.default_rng(33).standard_t(2.5, 4000)
    assert residual_tests([time], [heavy]).jarque_bera_p < 1e-6


def test_noise_floor_is_what_does_not_repeat() -> None:
    t = np.arange(0.0, 14.0, 0.005)
    x = 0.5 * np.sin(2.0 * math.pi * 0.5 * t)
    shape = 0.9 * x + 0.03 * np.tanh(8.0 * np.cos(2.0 * math.pi * 0.5 * t))
    noise = 0.0031 * np.random.default_rng(34).standard_normal(t.size)
    floor = noise_floor(FitRun("p", t, x[:, None], (shape + noise)[:, None]))
    assert floor is not None
    assert floor[0] == pytest.approx(0.0031, rel=0.05)


@pytest.mark.parametrize("growth", [0.0, 0.01])
def test_a_floor_that_the_fit_undercuts_is_not_told(growth: float) -> None:
    """Strokes that differ by a per cent differ in their outputs too, which is no noise: the fit explains it."""
    rng = np.random.default_rng(35)
    t = np.arange(0.0, 14.0, 0.005)
    x = 0.5 * np.sin(math.pi * t) * (1.0 + growth * np.repeat(rng.standard_normal(7), 400))
    x_out = 0.9 * x - 1.2 + 0.0011 * rng.standard_normal(t.size)
    fixed = {"beta": -1e-9, "alpha": 10.0, "x_h_0": 0.0}
    space = search_space(BACKLASH, values=fixed, fixed=list(fixed))
    found = fit(BACKLASH, [FitRun("p", t, x[:, None], x_out[:, None])], ("x_out",), space)
    assert found.measured["x_out"].rmse == pytest.approx(0.0011, rel=0.1)
    assert found.noise_floor == ({} if growth else {"x_out": pytest.approx(0.0011, rel=0.1)})


def test_no_noise_floor_without_a_period() -> None:
    t = np.arange(0.0, 14.0, 0.005)
    chirp = 0.5 * np.sin(2.0 * math.pi * (0.2 + 0.05 * t) * t)
    assert noise_floor(FitRun("chirp", t, chirp[:, None], chirp[:, None])) is None
    assert noise_floor(FitRun("ramp", t, t[:, None], t[:, None])) is None
