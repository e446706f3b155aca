"""The nuisance effects of a refit: what a lag, an offset, another presliding curve take; and runs left out in turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnosis.conftest import LEVEL, VISCOUS, exponential
from tsm_fmu.diagnosis.choice.hypotheses import can_leave_out, hypothesis, left_out_in_turn
from tsm_fmu.diagnosis.criteria import CLEAN_EFFECT_SPREAD_SHARE, NOTABLE_RATIO, NUISANCE_SPREAD_SHARE
from tsm_fmu.diagnosis.fits.nuisance import (
    best_refit,
    nuisance_specs,
    refit_with,
    refit_without,
    shrunk_nuisances,
    with_free_offsets,
    with_nuisances,
)
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.fits.screening import screen
from tsm_fmu.diagnosis.fits.significance import RemovedOnReference, significant_nuisances, telling_nuisances
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

DT, NOISE, TAU = 0.01, 0.004, 0.0231
FREE = ("presliding_shape", "sensor_lag@F", "offset_drift@F")

Rig = Callable[..., FitRun]
Shape = Callable[[np.ndarray], np.ndarray]


def lagged(y: np.ndarray, tau: float = TAU) -> np.ndarray:
    """A first-order lag, exact while its input goes in straight lines."""
    e = np.exp(-DT / tau)
    b1 = 1.0 - tau / DT * (1.0 - e)
    return np.asarray(lfilter([b1, 1.0 - e - b1], [1.0, -e], y))


def shifted(run: FitRun, by: float) -> FitRun:
    return replace(run, targets=run.targets + by)


def fitted(runs: list[FitRun], values: dict[str, float]) -> Fitted:
    return refit(Task("LuGreFriction", runs, ("F",), values, limits={"motion.x_pre": (1e-3, 0.1)}), (), {})


def test_freedoms_of_a_model_are_those_that_it_has_not() -> None:
    assert nuisance_specs("LuGreFriction", ["F"], ()) == FREE
    assert nuisance_specs("LuGreFriction", ["F"], ["sensor_lag@F"]) == ("presliding_shape", "offset_drift@F")
    drive = nuisance_specs("TendonDrive", ["x_out", "tau_in"], ())
    assert drive == ("presliding_shape", "sensor_lag@x_out", "sensor_lag@tau_in", "offset_drift@tau_in")  # x_0 is there
    assert nuisance_specs("PairedTsmBacklash", ["x_out"], ()) == ("sensor_lag@x_out",)


def test_a_late_channel_is_taken_by_the_lag_alone(rig: Rig, known: dict[str, float]) -> None:
    base = fitted([rig(seed, instrument=lagged) for seed in (21, 22)], known)
    assert base.rmse[0] > 3.0 * NOISE
    nuisances = with_nuisances(base, FREE)
    assert nuisances.effects == FREE
    assert nuisances.rmse[0] ** 2 - NOISE**2 < 0.05 * (base.rmse[0] ** 2 - NOISE**2)
    assert nuisances.values["F.sensor_lag.tau"] == pytest.approx(TAU, rel=0.1)
    needed = significant_nuisances(nuisances, FREE, FREE)
    assert set(needed) == {"sensor_lag@F"}
    removed, less = needed["sensor_lag@F"]
    assert removed == pytest.approx(np.sqrt(less.rmse[0] ** 2 - nuisances.rmse[0] ** 2) / nuisances.spread[0])
    assert "sensor_lag@F" not in less.effects
    assert significant_nuisances(nuisances, ["offset_drift@F"], FREE) == {}
    assert telling_nuisances(nuisances, FREE) == ("sensor_lag@F",)


@pytest.mark.parametrize(("tau", "told"), [(0.0081, True), (0.0021, False)])
def test_what_removes_as_much_as_an_effect_tells_of_it_too(
    rig: Rig, known: dict[str, float], tau: float, told: bool
) -> None:
    """A zero that drifts, far more than the lag removes."""
    runs = [rig(seed, noise=0.002, instrument=partial(lagged, tau=tau)) for seed in (21, 22)]
    drift = [0.09 * (run.time - run.time.mean()) / np.ptp(run.time) for run in runs]
    runs = [replace(run, targets=run.targets + d[:, None]) for run, d in zip(runs, drift, strict=True)]
    nuisances = with_nuisances(fitted(runs, known), FREE)
    released = replace(nuisances, released=("offset_drift@F",))
    drifting = refit_without(released, "", FREE)
    assert telling_nuisances(drifting, FREE) == ("offset_drift@F", *(["sensor_lag@F"] if told else []))


def test_what_removes_most_may_be_little_beside_the_noise(rig: Rig, known: dict[str, float]) -> None:
    base = fitted([rig(seed, noise=0.008, instrument=partial(lagged, tau=0.0021)) for seed in (21, 22)], known)
    nuisances = with_nuisances(base, FREE)
    removed = (refit_without(nuisances, "sensor_lag@F", FREE).rmse[0] / nuisances.rmse[0]) ** 2 - 1.0
    assert 0.05 < removed < NOTABLE_RATIO
    assert significant_nuisances(nuisances, FREE, FREE) == {}  # too little for a name
    assert telling_nuisances(nuisances, FREE) == ("sensor_lag@F",)


@pytest.mark.parametrize(("tau", "noise"), [(0.0041, 0.008), (0.0057, 0.008), (0.0057, 0.03)])
def test_a_late_channel_that_reference_runs_do_not_show_need_not_be_later_than_is_usual(
    rig: Rig, known: dict[str, float], tau: float, noise: float
) -> None:
    """Unless what it removes is little beside the noise, or they show it too."""
    as_late = partial(rig, noise=noise, instrument=partial(lagged, tau=tau))
    late = with_nuisances(fitted([as_late(seed) for seed in (21, 22)], known), FREE)
    removed = np.sqrt(refit_without(late, "sensor_lag@F", FREE).rmse[0] ** 2 - late.rmse[0] ** 2)
    assert CLEAN_EFFECT_SPREAD_SHARE < removed / late.spread[0] < NUISANCE_SPREAD_SHARE
    assert significant_nuisances(late, FREE, FREE) == {}
    for there in (partial(rig, noise=noise), as_late):
        reference = with_nuisances(fitted([there(seed) for seed in (31, 32)], known), FREE)
        removal = RemovedOnReference(reference, FREE)
        task = replace(late.task, discrepancy=reference.rmse, reference_removal=removal)
        found = hypothesis((), replace(late, task=task), FREE, []).effects
        assert found == (("sensor_lag@F",) if there is not as_late and noise < 0.01 else ())


def test_a_late_channel_that_is_nearly_all_that_is_left_need_not_be_later_than_is_usual(
    rig: Rig, known: dict[str, float]
) -> None:
    late = fitted([rig(s, noise=0.001, instrument=partial(lagged, tau=0.0061)) for s in (21, 22)], known)
    (removed, less) = significant_nuisances(with_nuisances(late, FREE), FREE, FREE)["sensor_lag@F"]
    assert CLEAN_EFFECT_SPREAD_SHARE < removed < NUISANCE_SPREAD_SHARE
    assert less.rmse[0] > 3.0 * 0.001


def at_one_pace(seed: int, pace: float, tau: float, shape: Shape) -> FitRun:
    """Strokes of other lengths to and fro, all at one speed: a late channel is late by one distance."""
    rng, rows = np.random.default_rng(seed), 2600
    counts = (rng.uniform(0.5, 0.9, rows) / pace / DT).astype(int) + 1
    v = np.resize(np.repeat(pace * (-1.0) ** np.arange(rows), counts), rows)
    force = LEVEL * shape(np.cumsum(v) * DT) + VISCOUS * v
    force = (lagged(force, tau) if tau else force) + 0.002 * rng.normal(size=rows)
    return FitRun(f"run{seed}", np.arange(rows) * DT, v[:, None], force[:, None])


@pytest.mark.parametrize("pace", [0.21, 3.1])
@pytest.mark.parametrize(("tau", "hyperbolic"), [(0.0231, False), (0.0103, False), (0.0, False), (0.0, True)])
def test_runs_at_another_pace_tell_a_late_channel_from_another_curve_of_friction(
    known: dict[str, float], hyperbola: Shape, tau: float, hyperbolic: bool, pace: float
) -> None:
    """At one speed the curve stands for the lag, and so it does on held-out runs of that speed."""
    shape = hyperbola if hyperbolic else exponential
    nuisances = with_nuisances(fitted([at_one_pace(seed, 1.07, tau, shape) for seed in (70, 71)], known), FREE)
    for holdout in ([], [at_one_pace(80, 1.07, tau, shape)]):
        assert "sensor_lag@F" not in hypothesis((), nuisances, FREE, holdout).tested
    there = hypothesis((), nuisances, FREE, [at_one_pace(80, pace, tau, shape)]).tested
    assert ("sensor_lag@F" in there) is (tau > 0.0)


def test_where_nothing_is_late_no_nuisance_effect_removes_anything_beyond_noise(
    rig: Rig, known: dict[str, float]
) -> None:
    base = fitted([rig(seed) for seed in (21, 22)], known)
    assert telling_nuisances(with_nuisances(base, FREE), FREE) == ()


def test_each_run_has_its_own_offset_and_none_drifts(rig: Rig, known: dict[str, float]) -> None:
    base = fitted([shifted(rig(23), 0.061), shifted(rig(24), -0.047)], known)
    nuisances = with_nuisances(base, FREE)
    assert nuisances.per_run["F.offset_drift.b"] == pytest.approx([0.061, -0.047], abs=0.003)
    assert nuisances.values["F.offset_drift.c"] == 0.0
    assert nuisances.rmse[0] < 1.1 * NOISE < 0.1 * base.rmse[0]


def test_a_drift_that_is_asked_for_is_released(rig: Rig, known: dict[str, float]) -> None:
    runs = [rig(25), rig(26)]
    runs = [replace(r, targets=r.targets + 0.0093 * r.time[:, None]) for r in runs]
    nuisances = with_nuisances(fitted(runs, known), FREE)
    spec = "offset_drift@F"
    found = refit_with(nuisances, screen(nuisances, [attach(kernel("LuGreFriction"), spec)])[0], FREE)
    assert found.effects == nuisances.effects
    assert found.released == (spec,)
    assert found.values["F.offset_drift.c"] == pytest.approx(0.0093, rel=0.03)
    assert found.rmse[0] < 1.1 * NOISE < 0.3 * nuisances.rmse[0]


def test_a_drift_that_another_fit_had_is_not_taken_over(rig: Rig, known: dict[str, float]) -> None:
    """A refit from the values of a rival in which the drift was free would leave as little, whatever its effect is."""
    run = rig(27)
    drifting = [replace(run, targets=run.targets + 0.013 * (run.time - run.time[0])[:, None])]
    nuisances = with_nuisances(fitted(drifting, known), FREE)
    start = {**nuisances.values, "F.offset_drift.c": 0.013}
    found = best_refit(nuisances, nuisances.effects, [(start, nuisances.per_run)], FREE)
    assert found.values["F.offset_drift.c"] == 0.0
    assert found.rmse[0] == pytest.approx(nuisances.rmse[0], rel=0.02)
    freed = best_refit(nuisances, nuisances.effects, [(start, nuisances.per_run)], FREE, released=["offset_drift@F"])
    assert freed.rmse[0] < 0.5 * nuisances.rmse[0]


def test_another_curve_after_reversals_is_no_gap(rig: Rig, known: dict[str, float], hyperbola: Callable) -> None:
    base = fitted([rig(seed, presliding=hyperbola) for seed in (27, 28)], known)
    nuisances = with_nuisances(base, FREE)
    assert base.rmse[0] > 2.0 * NOISE
    assert nuisances.rmse[0] < 0.5 * base.rmse[0]
    assert nuisances.rmse[0] ** 2 - NOISE**2 < 0.05 * (base.rmse[0] ** 2 - NOISE**2)


def test_where_nothing_is_wrong_no_freedom_is_material(rig: Rig, known: dict[str, float]) -> None:
    base = fitted([rig(29), rig(30)], known)
    nuisances = with_nuisances(base, FREE)
    assert nuisances.cost <= base.cost * (1.0 + 1e-9)
    assert significant_nuisances(nuisances, FREE, FREE) == {}
    assert refit_without(nuisances, "sensor_lag@F", FREE).rmse[0] < 1.02 * nuisances.rmse[0]


def test_relaxed_goes_most_of_the_way_back(rig: Rig, known: dict[str, float]) -> None:
    nuisances = with_nuisances(fitted([rig(31, instrument=lagged, rows=1200)], known), FREE)
    back = shrunk_nuisances(nuisances, FREE)
    assert back["F.sensor_lag.tau"] == pytest.approx(0.1 * nuisances.values["F.sensor_lag.tau"])
    assert set(back) >= {"F.sensor_lag.tau", "F.offset_drift.b"}
    assert all(name in nuisances.values for name in back)


def test_runs_left_out_in_turn_judge_what_does_not_carry_over(rig: Rig, known: dict[str, float]) -> None:
    alike = left_out_in_turn(hypothesis((), fitted([rig(32), rig(33), rig(34)], known), (), []))
    assert alike.held_out is not None
    assert np.sqrt(alike.held_out[0]) < 1.2 * NOISE
    odd = rig(35)
    odd = replace(odd, targets=odd.targets + 0.31 * odd.inputs)  # another friction on one of the days
    mixed = left_out_in_turn(hypothesis((), fitted([rig(32), rig(33), odd], known), (), []))
    assert mixed.held_out is not None
    assert mixed.held_out[0] > 1.3 * mixed.measured[0]
    assert alike.effective_held_out[0] > 1.0


def test_one_run_or_a_short_one_cannot_be_left_out(rig: Rig) -> None:
    assert not can_leave_out([rig(36)])
    assert not can_leave_out([rig(36), rig(37, rows=300)])
    assert can_leave_out([rig(36), rig(37)])


def test_zeros_of_runs_are_tied_until_they_are_set_free(rig: Rig, known: dict[str, float]) -> None:
    zeros = np.array([0.064, -0.051])
    base = fitted([shifted(rig(seed), by) for seed, by in zip((61, 62), zeros, strict=True)], known)
    bound = with_nuisances(base, FREE)
    loose = with_free_offsets(bound, FREE)
    apart = [np.ptp(f.per_run["F.offset_drift.b"]) for f in (bound, loose)]
    assert apart[0] < apart[1] == pytest.approx(np.ptp(zeros), rel=0.02)
    assert loose.per_run["F.offset_drift.b"] == pytest.approx(zeros, abs=0.003)
    assert loose.rmse[0] <= bound.rmse[0] < 1.05 * NOISE


def test_small_zeros_are_hardly_drawn_together(rig: Rig, known: dict[str, float]) -> None:
    zeros = np.array([0.0041, -0.0033])
    base = fitted([shifted(rig(seed), by) for seed, by in zip((63, 64), zeros, strict=True)], known)
    assert np.ptp(with_nuisances(base, FREE).per_run["F.offset_drift.b"]) > 0.5 * np.ptp(zeros)


def test_zeros_of_the_runs_are_no_effect_and_one_that_moves_within_a_run_is(rig: Rig, known: dict[str, float]) -> None:
    """Every sensor has a zero: a constant in each run, however large, is a value of the rig and nothing missing."""
    base = fitted([shifted(rig(65), 0.05), shifted(rig(66), -0.04)], known)
    assert significant_nuisances(with_nuisances(base, FREE), FREE, FREE) == {}
    drifting = [replace(r, targets=r.targets + 0.004 * r.time[:, None]) for r in (rig(65), rig(66))]
    nuisances = with_nuisances(fitted(drifting, known), FREE)
    released = best_refit(
        nuisances, nuisances.effects, [(nuisances.values, nuisances.per_run)], FREE, released=["offset_drift@F"]
    )
    assert released.values["F.offset_drift.c"] == pytest.approx(0.004, rel=0.1)
    assert "offset_drift@F" in significant_nuisances(released, FREE, FREE)
