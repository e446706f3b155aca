"""Where a search starts: sizes that follow from units, and draws that are where they are said to be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun, Problem
from tsm_fmu.regression.scaled_variables import ScaledVariables
from tsm_fmu.regression.seeds import SPREAD, dimensional_scales, starts
from tsm_fmu.regression.sensitivity import sensitivity_scales
from tsm_fmu.regression.specification import per_run_fields, search_space


def rms(x: np.ndarray) -> float:
    return math.sqrt(float(np.mean(x**2)))


def made(name: str, channels: tuple[str, ...], sizes: tuple[float, float], runs: int = 2) -> Problem:
    """Runs whose input drifts and whose channels have a level: both must not count as size."""
    model, found = kernel(name), []
    for number in range(runs):
        t = 0.013 * np.arange(700) + number
        x = 5.0 + sizes[0] * (np.sin(2.3 * t + number) + 0.7 * t)
        y = -3.0 + sizes[1] * np.cos(1.9 * t)
        found.append(FitRun(f"r{number}", t, x[:, None], np.column_stack([y] * len(channels))))
    return Problem(model, found, channels, search_space(model, per_run=per_run_fields(model)))


def observed(problem: Problem) -> tuple[float, float, float]:
    """Size of the input, of its rate and of the channel over all runs."""
    x = np.concatenate([r.inputs[:, 0] for r in problem.runs])
    rates = np.concatenate([np.gradient(r.inputs[:, 0], r.time) for r in problem.runs])
    y = np.concatenate([r.targets[:, 0] for r in problem.runs])
    return rms(x - x.mean()), rms(rates), rms(y - y.mean())


@pytest.mark.parametrize("sizes", [(0.037, 2.9), (41.0, 0.0031)])
def test_friction_scales_are_those_of_force_speed_and_acceleration(sizes: tuple[float, float]) -> None:
    """Of [N] = F, [m/s] = v and [m/s2] = a: seconds are v/a, metres v^2/a."""
    problem = made("LuGreFriction", ("F",), sizes)
    v, a, force = observed(problem)
    found = dimensional_scales(problem)
    expected = {"sigma0": force * a / v**2, "sigma1": force / v, "sigma2": force / v, "F_c": force, "v_s": v}
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-9)


def test_two_sizes_of_one_unit_count_alike() -> None:
    problem = made("PairedTsmBacklash", ("x_out",), (0.53, 0.11))
    x, _, y = observed(problem)
    found = dimensional_scales(problem)
    assert (found["x_0"], found["alpha"], found["c"]) == pytest.approx((math.sqrt(x * y), 1.0 / math.sqrt(x * y), 1.0))


def test_draws_fill_the_range_around_the_given_start_and_around_the_scales() -> None:
    problem = made("LuGreFriction", ("F",), (0.037, 2.9))
    table = problem.start()
    variables = ScaledVariables(problem, problem.shared, (), sensitivity_scales(problem), table)
    points = starts(problem, variables, 27, seed=3)
    assert len(points) == 2 + 32  # the next power of two
    given, physical, *draws = points
    assert given == pytest.approx(variables.of(table))
    logarithmic = np.array([bool(axis.sign) for axis in variables.axes])
    assert logarithmic.sum() >= 4
    scales = dimensional_scales(problem)
    for axis, q in zip(variables.axes, physical, strict=True):
        value = math.exp(q) if axis.sign else axis.centre + axis.scale * q
        free = axis.lo + 1e-5 < q < axis.hi - 1e-5  # neither end drew it back
        assert not free or value == pytest.approx(scales[axis.field], rel=1e-6)
    lo, hi = variables.lo + 1e-6, variables.hi - 1e-6
    for half, around in enumerate((given, physical)):
        moved = np.array([q - around for q in draws[16 * half : 16 * (half + 1)]])
        reach = np.where(logarithmic, SPREAD, np.maximum(1.0, np.abs(around)))
        assert (np.abs(moved) <= reach + 1e-9).all()
        for i in np.flatnonzero((around - reach > lo) & (around + reach < hi)):  # nothing is cut there
            part = np.sort(moved[:, i] / reach[i])
            assert abs(part.mean()) < 0.1
            assert part[0] < -0.85
            assert part[-1] > 0.85
    assert all((q >= lo).all() and (q <= hi).all() for q in points)
    again, other = starts(problem, variables, 27, seed=3), starts(problem, variables, 27, seed=4)
    assert np.array_equal(points, again)
    assert not np.array_equal(points, other)


def test_nothing_to_search_has_one_start() -> None:
    problem = made("LuGreFriction", ("F",), (0.037, 2.9))
    assert len(starts(problem, ScaledVariables(problem, (), (), {}, problem.start()), 8, seed=0)) == 1
