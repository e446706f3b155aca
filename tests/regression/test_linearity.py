"""The probing finds linear parameters, and only these; the statistics agree with independent ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.signal import lfilter
from statsmodels.stats.sandwich_covariance import S_hac_simple

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.linearity import linear_parameters
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.sensitivity import sensitivity_scales
from tsm_fmu.regression.specification import per_run_fields, search_space
from tsm_fmu.regression.uncertainty import autocorrelation_time, long_run_covariance


def excited(name: str, channels: tuple[str, ...], fixed: tuple[str, ...] = ()) -> Problem:
    name, _, preset = name.partition(":")
    model = kernel(name)
    t = np.arange(0.0, 6.0, 0.002)
    wave = 0.43 * np.sin(1.7 * t) + 0.19 * np.sin(5.3 * t + 0.4)
    inputs = np.column_stack([(1.0 + 0.21 * j) * np.roll(wave, 37 * j) for j in range(len(model.inputs))])
    targets = np.column_stack([wave for _ in channels])
    run = FitRun("r", t, np.ascontiguousarray(inputs), targets)
    return Problem(
        model, [run], channels, search_space(model, preset or None, fixed=fixed, per_run=per_run_fields(model))
    )


@pytest.mark.parametrize(
    ("name", "channels", "linear"),
    [
        ("PairedTsmBacklash", ("x_out",), {"c", "beta", "x_0", "x_h_0"}),
        ("LuGreFriction", ("F",), {"sigma1", "sigma2"}),  # in m/s F_s and v_s do nothing here: no proof of linearity
        ("LuGreFriction:mmt2015", ("F",), {"sigma1", "sigma2"}),
        ("TendonDrive", ("x_out", "tau_in"), {"c", "beta", "x_0", "x_h_0", "ratio", "sigma1", "sigma2"}),
    ],
)
def test_linear_parameters(name: str, channels: tuple[str, ...], linear: set[str]) -> None:
    assert linear_parameters(excited(name, channels)) == linear


def test_the_run_that_moves_is_the_one_that_tells() -> None:
    moving = excited("PairedTsmBacklash", ("x_out",))
    (run,) = moving.runs
    still = replace(run, name="still", inputs=np.full_like(run.inputs, 0.2))
    expected = linear_parameters(moving)
    assert "c" in expected
    for runs in ([still, run], [run, still]):
        assert linear_parameters(moving.with_runs(runs)) == expected


def test_a_step_of_the_probe_is_a_part_of_the_range_that_bounds_leave(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = excited("PairedTsmBacklash", ("x_out",))
    narrow = {"c": (0.999, 1.002), "alpha": (10.1, 10.11), "beta": (-0.917, -0.9168)}
    space = problem.space
    for name, (lo, hi) in narrow.items():
        space = space.with_bounds(name, lo=lo, hi=hi)
    rows, original = [], Problem.outputs

    def spy(self: Problem, k: int, row: np.ndarray) -> np.ndarray:
        rows.append(row.copy())
        return original(self, k, row)

    monkeypatch.setattr(Problem, "outputs", spy)
    assert {"c", "beta"} <= linear_parameters(replace(problem, space=space))
    moves: dict[str, list[float]] = {}
    for one, other in combinations(rows, 2):
        (moved,) = np.nonzero(one != other)
        if moved.size == 1:
            moves.setdefault(problem.fields[moved[0]], []).append(abs(float((one - other)[moved[0]])))
    for name, (lo, hi) in narrow.items():
        assert 0.0 < max(moves[name]) <= 0.8 * (hi - lo) * (1.0 + 1e-9)


@pytest.mark.parametrize(("part", "shown"), [(2e-6, False), (2e-5, True)])
def test_a_parameter_that_hardly_moves_the_outputs_is_searched(
    monkeypatch: pytest.MonkeyPatch, part: float, shown: bool
) -> None:
    """Less than a millionth of the outputs shows no form, however straight: a step is 0.067 to 0.45 of the value."""
    problem = excited("PairedTsmBacklash", ("x_out",), fixed=("alpha", "beta", "x_0", "x_h_0"))
    at, value = problem.fields.index("c"), problem.space["c"].start
    monkeypatch.setattr(Problem, "outputs", lambda _, k, row: np.array([[-3.7], [3.7 * part * row[at] / value]]))
    assert linear_parameters(problem) == ({"c"} if shown else set())


def test_a_product_of_two_parameters_is_not_eliminated_as_a_pair() -> None:
    """k_x, k_zeta, upsilon and F_0 act linearly, force_scale on their sum: never both."""
    found = linear_parameters(excited("PairedTsmFriction", ("F",)))
    assert "force_scale" not in found or not found & {"k_x", "k_zeta", "upsilon", "F_0"}
    assert len(found) >= 1


def test_scale_moves_the_output_by_one_standard_deviation() -> None:
    problem = excited("PairedTsmBacklash", ("x_out",))
    spread = problem.runs[0].targets.std()
    assert sensitivity_scales(problem)["x_0"] == pytest.approx(spread, rel=1e-6)
    assert sensitivity_scales(problem)["c"] == pytest.approx(
        spread / np.sqrt(np.mean(problem.runs[0].inputs ** 2)), rel=1e-6
    )


def test_long_run_covariance_is_newey_west() -> None:
    scores = np.random.default_rng(5).standard_normal((400, 3)) @ np.array([[1.0, 0.3, 0], [0, 2.0, 0.1], [0, 0, 0.7]])
    scores = lfilter([1.0], [1.0, -0.8], scores, axis=0)
    assert long_run_covariance(scores, 13) == pytest.approx(S_hac_simple(scores, nlags=12), rel=1e-9)


@pytest.mark.parametrize("pole", [0.0, 0.6, 0.93])
def test_autocorrelation_time_of_first_order_noise(pole: float) -> None:
    noise = lfilter([1.0], [1.0, -pole], np.random.default_rng(6).standard_normal(200_000))
    assert autocorrelation_time(noise) == pytest.approx((1.0 + pole) / (1.0 - pole), rel=0.1)
