"""What the model's own parameters may do in a diagnosis: levels that a rig can have, one rig behind all of its runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice import baselines as module
from tsm_fmu.diagnosis.choice.baselines import baselines, refitted_model
from tsm_fmu.diagnosis.fits.nuisance import best_refit, refit_with
from tsm_fmu.diagnosis.fits.ranges import forgetting_ranges, level_ranges
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, descent, refit
from tsm_fmu.diagnosis.fits.screening import Screened
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.laws.coleman_hodgdon import room_of_start
from tsm_fmu.regression.problem import FitRun

Rig = Callable[..., FitRun]


def task_of(runs: list[FitRun], known: dict[str, float]) -> Task:
    return Task("LuGreFriction", runs, ("F",), known, limits={"motion.x_pre": (1e-3, 0.1)})


def test_levels_are_within_the_range_of_their_channel(rig: Rig) -> None:
    runs = [rig(71), rig(72)]
    found = level_ranges(kernel("LuGreFriction"), ["F"], runs, ["F_c"])
    assert set(found) == {"F_s"}
    assert found["F_s"][1] == pytest.approx(max(np.ptp(r.targets) for r in runs))
    assert level_ranges(kernel("PairedTsmBacklash"), ["x_out"], runs, []) == {}
    both = np.column_stack([9.0 * runs[0].targets, runs[0].targets])
    drive = level_ranges(kernel("TendonDrive"), ["x_out", "tau_in"], [replace(runs[0], targets=both)], [])
    assert set(drive) == {"tau_c", "tau_s"}
    assert drive["tau_c"][1] == pytest.approx(np.ptp(runs[0].targets))


def test_a_motion_that_goes_one_way_shows_the_level_of_friction_that_it_has(known: dict[str, float]) -> None:
    """Believed at a third of it, and the force hardly changes: less than a tenth of the level."""
    rng = np.random.default_rng(6)
    time = np.arange(3000) * 0.004
    v = 0.4 * np.sin(1.3 * time) ** 2
    force = 1.73 - 0.12 * np.exp(-v / 0.09) + 4e-3 * rng.standard_normal(time.size)
    runs = [FitRun("one way", time, v[:, None], force[:, None])]
    ranges = level_ranges(kernel("LuGreFriction"), ["F"], runs, [])
    assert ranges["F_c"][1] == pytest.approx(force.max())
    task = replace(task_of(runs, known), limits=ranges)
    found = refit(task, (), {"F_c": 0.5, "F_s": 0.6, "v_s": 0.1}, steps=40)
    assert found.rmse[0] < 0.03 * force.mean()


def test_levels_of_an_estimator_are_within_the_range_of_the_drive_that_they_are_taken_out_of(rig: Rig) -> None:
    """The load that it estimates may stand still while friction turns: its range says nothing of friction."""
    run = rig(71)
    torque = run.targets
    inputs = np.column_stack([run.inputs[:, 0], torque])
    still = replace(run, inputs=inputs, targets=np.column_stack([run.inputs[:, 0], 0.01 * torque]))
    found = level_ranges(kernel("DistalEstimator"), ["x_out", "tau_out"], [still], [])
    assert found["tau_c"][1] == pytest.approx(np.ptp(torque))


def test_a_reversal_is_forgotten_within_the_stroke() -> None:
    """Of a hysteresis that is slower the start is left at the end of the stroke, as a drift."""
    for name, parameter in (("PairedTsmBacklash", "alpha"), ("TendonDrive", "alpha"), ("PairedTsmFriction", "rho")):
        found = forgetting_ranges(kernel(name), 1.7, {parameter: 9.1})
        assert set(found) == {parameter}
        assert math.exp(-found[parameter][0] * 1.7) == pytest.approx(0.05, abs=1e-3)
    assert forgetting_ranges(kernel("PairedTsmBacklash"), 1.7, {"alpha": 0.31})["alpha"][0] == 0.31, "as it is given"
    assert forgetting_ranges(kernel("LuGreFriction"), 1.7) == {}


def test_a_hysteresis_that_starts_near_its_loop_takes_up_no_drift() -> None:
    """Of a sensor that comes to its end like exp(-travel/9) the fit without conditions makes a start far outside."""
    rng = np.random.default_rng(5)
    time = np.arange(3000) * 0.01
    runs = []
    for k in range(2):
        x = 0.8 * np.sin((1.1 + 0.3 * k) * time) + 0.2 * np.sin(2.7 * time + k)
        travel = np.cumsum(np.abs(np.gradient(x)))
        y = 0.91 * x + 0.2 * np.exp(-travel / 9.0) + 1e-3 * rng.standard_normal(time.size)
        runs.append(FitRun(f"run {k}", time, x[:, None], y[:, None]))
    task = Task("PairedTsmBacklash", runs, ("x_out",), {})

    def room(found: Fitted) -> float:
        return min(room_of_start(found.problem.params(row)) for row in found.table)

    start = {"c": 0.9, "beta": -0.2, "alpha": 9.0}
    found = refit(task, (), start, steps=40)
    assert room(found) >= -1e-9
    free = replace(found.problem, kept=())
    assert room(replace(found, problem=free, table=descent(40).refined(free, free.start()))) < 0.0
    outside = {**start, "x_h_0": 0.31}
    assert room(refit(replace(task, fixed=("x_h_0",)), (), outside, steps=0)) < 0.0, "what is given is kept"


def test_levels_before_a_factor_of_the_model_are_within_the_range_before_it(rig: Rig) -> None:
    """Of a friction of 5.2 N = 0.04 * 130 N, 130 N is no level beyond the range of its channel."""
    runs = [replace(r, targets=5.2 * r.targets / np.ptp(r.targets)) for r in (rig(74), rig(75))]
    paired = kernel("PairedTsmFriction")
    for values, preset, factor in (({}, None, 0.04), ({"force_scale": 0.013}, None, 0.013), ({}, "raw", 1.0)):
        found = level_ranges(paired, ["F"], runs, [], values, preset)
        assert set(found) == {"k_zeta", "F_0"}
        assert found["k_zeta"] == pytest.approx((-5.2 / factor, 5.2 / factor))


def test_a_break_away_that_no_rig_has_takes_up_nothing(rig: Rig, known: dict[str, float]) -> None:
    """A start far off, with a peak of a thousand Coulomb levels, comes back into the range."""
    runs, far = [rig(73)], {"F_s": 900.0, "v_s": 0.01}
    ranges = level_ranges(kernel("LuGreFriction"), ["F"], runs, [])
    task = replace(task_of(runs, known), limits=ranges)
    assert refit(task, (), far).values["F_s"] <= np.ptp(runs[0].targets)


def test_a_poor_valley_of_the_reference_runs_is_no_form(
    rig: Rig, known: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first refit of the reference runs is made to fail: the values of the measured runs mend it."""
    runs, references = [rig(74, inertia=0.03)], [rig(75)]
    real = refitted_model

    def poor(task: Task, effects: list[str], *start: object, **more: object) -> Fitted:
        found = real(task, effects, *start, **more)  # pyright: ignore[reportArgumentType]
        if start or more:
            return found
        return refit(replace(task, fixed=("F_c", "F_s")), effects, {"F_c": 0.2, "F_s": 0.2}, fixed=["F_c", "F_s"])

    def reference_gap() -> float:
        made = baselines(task_of(runs, known), (), runs, references, [], lambda _: None)
        assert made.reference is not None
        assert made.refitted.fitted.task.reference_removal
        return float(made.reference.rmse[0])

    sound = reference_gap()
    monkeypatch.setattr(module, "refitted_model", poor)
    assert reference_gap() == pytest.approx(sound, rel=0.05)
    without = baselines(task_of(runs, known), (), runs, [], [], lambda _: None)
    assert not without.refitted.fitted.task.reference_removal


def test_a_refit_that_ends_worse_begins_again_where_the_effect_does_little(rig: Rig, known: dict[str, float]) -> None:
    base = refit(task_of([rig(76, inertia=0.05)], known), (), {})
    far = Screened(attach(kernel("LuGreFriction"), "inertia"), 1.0, [({"inertia.m": 4.0}, {})], {})
    at_once = best_refit(base, ["inertia"], [({**base.values, "inertia.m": 4.0}, base.per_run)], (), steps=8)
    assert at_once.cost > base.cost > refit_with(base, far, (), steps=8).cost
