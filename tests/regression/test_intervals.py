"""Intervals from the profile of the error: the linear ones where the model is linear, better ones where it is not."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import lmfit
import numpy as np
import pytest
import rig
from scipy.stats import chi2

from tsm_fmu.cli.app import run as run_command
from tsm_fmu.identification import fit as fit_module
from tsm_fmu.identification.fit import Fit, FitInterrupted, fit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import write_record
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.specification import per_run_fields, search_space

BACKLASH = kernel("PairedTsmBacklash")


def identified(
    runs: list[FitRun], fixed: tuple[str, ...] = (), intervals: str = "profile", c: float = math.inf, **options: Any
) -> Fit:
    space = search_space(
        BACKLASH, values={**rig.TRUE, "c": min(0.9, c - 1e-3)}, fixed=fixed, per_run=per_run_fields(BACKLASH)
    )
    space = space.with_bounds("c", hi=c)
    return fit(BACKLASH, runs, ("x_out",), space, intervals=intervals, **options)


def noisy(seed: int, noise: float, seconds: float) -> FitRun:
    """White noise on the output."""
    run = rig.backlash_run(f"r{seed}", seed, seconds=seconds)
    added = np.random.default_rng(seed).normal(0.0, noise, run.targets.shape)
    return FitRun(run.name, run.time, run.inputs, run.targets + added)


@pytest.fixture(scope="module")
def weak() -> FitRun:
    """Four seconds with noise of half the motion: the loop is hardly seen."""
    return noisy(105, 0.2, 4.0)


def test_linear_parameter_has_the_linear_interval_beside_values_per_run() -> None:
    """With beta and alpha held x_out is linear in c and in each run's offset and initial state."""
    runs = [rig.backlash_run(f"r{k}", 40 + k, x_0=-1.2 + 0.1 * k, noise=0.02, seconds=5.0) for k in range(2)]
    result = identified(runs, ("beta", "alpha"))
    p = result.parameters["c"]
    low, high = result.intervals["c"]
    assert low == pytest.approx(p.value - 1.96 * p.stderr, abs=0.005 * p.stderr)
    assert high == pytest.approx(p.value + 1.96 * p.stderr, abs=0.005 * p.stderr)


def test_nonlinear_parameters_of_a_weak_log_have_lopsided_intervals_of_the_right_sign(weak: FitRun) -> None:
    linear, profile = identified([weak], intervals="linear"), identified([weak])
    assert linear.intervals["alpha"][0] < 0.0  # alpha is positive: the linear interval says nothing there
    low, high = profile.intervals["alpha"]
    value = profile.parameters["alpha"].value
    assert 0.0 < low < rig.TRUE["alpha"] < high
    assert high - value > 2.0 * (value - low)
    assert profile.intervals["beta"][0] < rig.TRUE["beta"] < profile.intervals["beta"][1] < 0.0
    assert profile.parameters["alpha"].value == linear.parameters["alpha"].value


def test_profile_covers_the_truth() -> None:
    """Of twenty weak logs one interval in twenty misses on average; five missing have a chance of 0.3 %."""
    covered = dict.fromkeys(rig.TRUE, 0)
    for seed in range(120, 140):
        result = identified([noisy(seed, 0.1, 4.0)], single_start=True)
        for name, true in rig.TRUE.items():
            low, high = result.intervals[name]
            covered[name] += low < true < high
    assert min(covered.values()) > 15, covered


def test_ends_are_those_of_lmfit() -> None:
    """The own search of lmfit for the ends, on the same levels of the sum of squares; offset and start held in both."""
    fixed = ("x_0", "x_h_0")
    run = noisy(23, 0.03, 4.0)
    parameters = search_space(BACKLASH, values={**rig.TRUE, "x_0": -1.2617, "x_h_0": 0.0113}, fixed=fixed)
    result = fit(BACKLASH, [run], ("x_out",), parameters, intervals="profile")
    weight = 1.0 / float(np.std(run.targets))
    kappa = result.uncertainty.calibration

    def residual(p: lmfit.Parameters) -> np.ndarray:
        values = BACKLASH.params(values={name: p[name].value for name in parameters.parameters})
        return weight * (BACKLASH.simulate(values, run.time, run.inputs)[:, 0] - run.targets[:, 0])

    start = result.parameters.copy()
    free = ("c", "beta", "alpha")
    minimizer = lmfit.Minimizer(residual, start)
    best = minimizer.minimize(method="leastsq")
    for name in free:
        assert kappa[name] == pytest.approx(best.chisqr / best.nfree, rel=0.5)  # white: the variance of the residual
        best.params[name].stderr = result.parameters[name].stderr
        ends = lmfit.conf_interval(
            minimizer,
            best,
            p_names=[name],
            sigmas=[1.96],
            prob_func=lambda least, held, name=name: chi2.cdf((held.chisqr - least.chisqr) / kappa[name], 1),
        )[name]
        half = 1.96 * result.parameters[name].stderr
        assert result.intervals[name] == pytest.approx((ends[0][1], ends[-1][1]), abs=0.01 * half)


def test_interval_ends_at_a_bound() -> None:
    run = noisy(25, 0.06, 3.0)
    p = identified([run], ("beta", "alpha"), "linear").parameters["c"]
    most = p.value + p.stderr
    result = identified([run], ("beta", "alpha"), c=most)
    assert result.parameters["c"].value < most
    assert result.intervals["c"][1] == most


def test_parameter_on_a_bound_or_fixed_has_no_interval() -> None:
    run = rig.backlash_run("r", 26, noise=0.002, seconds=4.0)
    result = identified([run], ("beta",), c=0.85)
    assert {"c", "beta"}.isdisjoint(result.intervals)


def test_interruption_keeps_the_linear_intervals_and_says_so(weak: FitRun, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(fit_module, "profile_intervals", interrupted)
    with pytest.raises(FitInterrupted) as stopped:
        identified([weak])
    result, linear = stopped.value.fit, identified([weak], intervals="linear")
    assert result.intervals == linear.intervals
    assert not result.complete
    assert "the intervals that were not reached are linear ones" in result.findings[0]


def test_unknown_intervals_are_one_line(weak: FitRun) -> None:
    with pytest.raises(InputError, match=r"intervals 'bayes' -- expected one of linear, profile"):
        identified([weak], intervals="bayes")


def test_command_line_prints_intervals(tmp_path: Path, weak: FitRun, capsys: pytest.CaptureFixture[str]) -> None:
    log, page = tmp_path / "weak.csv", tmp_path / "page.html"
    columns = {"x_in": weak.inputs[:, 0], "x_out": weak.targets[:, 0]}
    write_record(log, weak.time, columns, {"x_in": "rad", "x_out": "rad"})
    arguments = ["identify", "PairedTsmBacklash", "--measured", str(log), "--out", str(tmp_path / "card.toml")]
    assert run_command([*arguments, "--intervals", "profile", "--single-start", "--report", str(page), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["interval_method"] == "profile"
    low, high = found["parameters"]["alpha"]["interval"]
    assert 0.0 < low < rig.TRUE["alpha"] < high
    assert "others fitted anew" in page.read_text(encoding="utf-8")


def test_single_start_refines_the_given_values_only() -> None:
    run = rig.backlash_run("r", 27, noise=0.002, seconds=4.0)
    many = fit(BACKLASH, [run], ("x_out",), search_space(BACKLASH, per_run=per_run_fields(BACKLASH)))
    one = fit(BACKLASH, [run], ("x_out",), search_space(BACKLASH, per_run=per_run_fields(BACKLASH)), single_start=True)
    assert one.evaluations < 0.5 * many.evaluations
    for name in ("c", "beta", "alpha", "x_0", "x_h_0"):
        assert one.parameters[name].value == pytest.approx(many.parameters[name].value, rel=1e-4)
    assert math.isfinite(one.uncertainty.condition_number)
