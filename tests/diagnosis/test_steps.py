"""Steps of the diagnosis, each against a case with a known answer; data never come from the code under test."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.gaps import closure
from tsm_fmu.diagnosis.choice.floors import white_noise
from tsm_fmu.diagnosis.fits.refit import Task, as_given, refit
from tsm_fmu.diagnosis.residual.locate import locate
from tsm_fmu.diagnosis.residual.predictable import predictable_share
from tsm_fmu.diagnosis.runs.gate import gate
from tsm_fmu.diagnosis.runs.motion_signals import coordinates_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.residuals import noise_floor
from tsm_fmu.regression.thinning import thinned

DT = 0.01


def coloured(n: int, sigma: float, rng: np.random.Generator, rho: float = 0.95) -> np.ndarray:
    """First-order autoregressive noise."""
    y, e = np.zeros(n), rng.normal(size=n)
    for k in range(1, n):
        y[k] = rho * y[k - 1] + np.sqrt(1.0 - rho**2) * e[k]
    return sigma * y


def lugre_run(seed: int, noise: float = 0.003, extra: float = 0.0) -> FitRun:
    """Friction 0.7 tanh(v/0.02) + 0.11 v over a motion of three sines; ``extra`` times a cosine of the position."""
    rng = np.random.default_rng(seed)
    t = np.arange(3000) * DT
    v = sum(
        a * np.sin(2 * np.pi * f * t + p)
        for a, f, p in zip((1.1, 0.6, 0.3), (0.13, 0.37, 0.83), rng.random(3) * 6, strict=True)
    )
    x = np.cumsum(v) * DT
    force = 0.7 * np.tanh(v / 0.02) + 0.11 * v + extra * np.cos(5.3 * x) + coloured(t.size, noise, rng)
    return FitRun(f"run{seed}", t, v[:, None], force[:, None])


VALUES = {"sigma0": 120.0, "sigma1": 0.1, "sigma2": 0.2, "F_c": 0.5, "F_s": 0.55, "v_s": 0.3}


def task(*seeds: int, fixed: tuple[str, ...] = ()) -> Task:
    return Task("LuGreFriction", [lugre_run(seed) for seed in seeds], ("F",), VALUES, fixed=fixed)


def test_refit_is_never_worse_than_its_start_and_finds_the_friction() -> None:
    two = task(1, 2)
    start, found = as_given(two, ()), refit(two, (), {})
    assert found.cost < 0.1 * start.cost
    assert found.rmse[0] < 0.06 * found.spread[0]
    again = refit(two, (), found.values)
    assert again.cost <= found.cost * (1.0 + 1e-12)


def test_a_fixed_parameter_stays() -> None:
    found = refit(task(3, fixed=("sigma2",)), (), {})
    assert found.values["sigma2"] == 0.2


def test_thinning_keeps_runs_long_enough() -> None:
    runs = thinned(kernel("LuGreFriction"), [lugre_run(4)] * 5, rows=6000, shortest=1000)
    assert [r.time.size for r in runs] == [1500] * 5
    assert np.array_equal(runs[0].time, lugre_run(4).time[::2])


def test_thinning_still_follows_every_stroke() -> None:
    t = np.arange(20_000) * 0.005
    v = np.cos(2.0 * np.pi * 0.83 * t + 0.2)
    run = FitRun("long", t, v[:, None], v[:, None])
    (kept,) = thinned(kernel("LuGreFriction"), [run], rows=300, shortest=100)
    assert np.diff(kept.time).max() <= 0.5 / 0.83 / 25.0


def test_noise_is_not_a_law_but_a_hidden_cosine_is() -> None:
    runs = [lugre_run(k) for k in range(3)]
    places = [coordinates_of(kernel("LuGreFriction"), run, None) for run in runs]
    rng = np.random.default_rng(17)
    noise = [coloured(r.time.size, 0.01, rng)[:, None] for r in runs]
    law = [n + 0.02 * np.sign(r.inputs) * np.exp(-np.abs(r.inputs) / 0.23) for n, r in zip(noise, runs, strict=True)]
    assert predictable_share(noise, places, "m", "N")[0] < 0.08
    true = np.mean([np.mean((b - a) ** 2) / np.mean(b**2) for a, b in zip(noise, law, strict=True)])
    assert predictable_share(law, places, "m", "N")[0] == pytest.approx(true, abs=0.12)


def test_repeats_give_the_noise_and_white_differences_a_lower_bound() -> None:
    t = np.arange(8000) * DT
    x = np.sin(2 * np.pi * 0.1 * t)
    rng = np.random.default_rng(5)
    noise = coloured(t.size, 0.037, rng, 0.7)
    floor = noise_floor(FitRun("sine", t, x[:, None], (3.0 * x**3 + noise)[:, None]))
    assert floor is not None
    assert floor[0] == pytest.approx(0.037, rel=0.1)
    left: Any = SimpleNamespace(residuals=[noise[:, None]])
    assert 0.3 * 0.037 < white_noise(left)[0] < 0.037
    left.residuals = [(0.037 * rng.normal(size=t.size) + 2.3 * x)[:, None]]
    assert white_noise(left)[0] == pytest.approx(0.037, rel=0.05)


def test_no_repeats_no_floor_from_them() -> None:
    assert noise_floor(lugre_run(6)) is None


def test_locate_finds_where_the_residual_lives() -> None:
    runs = [lugre_run(8), lugre_run(9)]
    model = kernel("LuGreFriction")
    places = [coordinates_of(model, run, None) for run in runs]
    rng = np.random.default_rng(3)
    residuals = [
        (0.2 * (np.abs(r.inputs[:, 0]) < 0.2) * np.sign(r.inputs[:, 0]) + 0.01 * rng.normal(size=r.time.size))[:, None]
        for r in runs
    ]
    found = locate(residuals, places, ["F"], "rad", "1")
    assert found[0].coordinate == "v"
    assert found[0].significant
    assert found[0].share_of_gap > 0.9
    assert -0.45 < found[0].range[0] < found[0].range[1] < 0.45


def test_locate_says_nothing_of_coloured_noise() -> None:
    runs = [lugre_run(k) for k in (10, 11)]
    places = [coordinates_of(kernel("LuGreFriction"), run, None) for run in runs]
    rng = np.random.default_rng(29)
    residuals = [coloured(r.time.size, 0.1, rng, 0.98)[:, None] for r in runs]
    assert not any(p.significant for p in locate(residuals, places, ["F"], "rad", "1"))


def test_closure_by_hand() -> None:
    assert closure(np.array([25.0]), np.array([9.0]), np.array([3.0])) == pytest.approx(1.0)
    assert closure(np.array([25.0]), np.array([16.0]), np.array([3.0])) == pytest.approx(9.0 / 16.0)
    assert closure(np.array([9.0]), np.array([9.0]), np.array([3.0])) is None
    assert closure(np.array([25.0, 4e-6]), np.array([5.0, 0.0]), np.zeros(2)) == pytest.approx(0.9)  # no noise at all
    two = np.array([25.0, 8.0]), np.array([16.0, 8.0]), np.array([3.0, 2.0])  # the weights are 1/9 and 1/4
    assert closure(*two) == pytest.approx(1.0 - (7.0 / 9.0 + 1.0) / (16.0 / 9.0 + 1.0))


def test_gate_refuses_a_drive_that_stands_still() -> None:
    t = np.arange(500) * DT
    columns = {"v": np.zeros(500), "F": np.random.default_rng(1).normal(size=500)}
    said = gate([Record("still", t, columns, {"v": "rad/s", "F": "N"})], kernel("LuGreFriction"), ["F"])
    assert "v does not move in any run" in said.refused


def test_a_short_held_out_run_is_refused() -> None:
    found = as_given(task(12), ())
    short = FitRun("short", *(a[:100] for a in (lugre_run(13).time, lugre_run(13).inputs, lugre_run(13).targets)))
    with pytest.raises(InputError, match=r"held-out run short of 0.99 s -- expected more than the 2 s"):
        found.held_out_errors([short])
