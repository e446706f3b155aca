"""What a log can show: effects listed as unexcited, and not listed, by the motion and the load of the runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.choice.hypotheses import hypothesis
from tsm_fmu.diagnosis.choice.visibility import Unseen, ordinary, unexcited
from tsm_fmu.diagnosis.fits.disguise import disguised
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.drives import ANGLE
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.problem import FitRun

DT, ROWS = 0.01, 2000
DRIVE = {
    "c": 0.97, "beta": -0.9, "alpha": 9.3, "ratio": 1.03, "sigma0": 5.3, "sigma1": 0.0, "sigma2": 0.0031,
    "tau_c": 0.104, "tau_s": 0.104, "v_s": 0.3, "tau_v": 0.0,
}  # fmt: skip

Rig = Callable[..., FitRun]


def drive_run(seed: int, stroke: float = 1.3, swing: float = 0.21) -> FitRun:
    """Torque 1.03 load + 0.104 z with Dahl's z over 0.0193 rad, and a play of 0.047 rad, with noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * DT
    x = stroke * (0.7 * np.sin(2 * np.pi * 0.31 * t) + 0.3 * np.sin(2 * np.pi * 0.83 * t + rng.random()))
    x -= x[0]
    load = 0.17 + swing * np.sin(2 * np.pi * 0.19 * t + rng.random())
    follow, z = np.zeros(ROWS), np.zeros(ROWS)
    for k in range(1, ROWS):
        s = np.sign(x[k] - x[k - 1])
        z[k] = s + (z[k - 1] - s) * np.exp(-abs(x[k] - x[k - 1]) / 0.0193)
        follow[k] = min(max(follow[k - 1], x[k] - 0.047), x[k] + 0.047)
    out = np.column_stack([0.97 * follow + 2e-4 * rng.normal(size=ROWS), 1.03 * load + 0.104 * z])
    out[:, 1] += 1e-3 * rng.normal(size=ROWS)
    return FitRun(f"run{seed}", t, np.column_stack([x, load]), out)


def unseen(base: Fitted, effects: Sequence[str]) -> Unseen:
    candidates = [attach(kernel(base.model), text) for text in effects]
    return unexcited(base, candidates, hypothesis((), base, (), []))


def listed(base: Fitted, effects: Sequence[str]) -> tuple[str, ...]:
    return unseen(base, effects).hidden


def friction(runs: Sequence[FitRun], values: dict[str, float]) -> Fitted:
    return refit(Task("LuGreFriction", runs, ("F",), values), (), {})


def drive(runs: Sequence[FitRun]) -> Fitted:
    return refit(Task("TendonDrive", runs, ("x_out", "tau_in"), DRIVE), (), {})


@pytest.fixture(scope="module")
def loaded() -> Fitted:
    return drive([drive_run(41), drive_run(42)])


def test_inertia_is_unexcited_in_slow_motion_only(rig: Rig, known: dict[str, float]) -> None:
    slow, fast = (friction([rig(51, pace=pace), rig(52, pace=pace)], known) for pace in (0.06, 1.3))
    asked = ["inertia", "direction_asymmetry"]
    assert listed(slow, asked) == unseen(slow, asked).unmoved == ("inertia",)
    assert listed(fast, asked) == ()


@pytest.mark.parametrize("unit", [1.0, 1e-3, 4.1e3], ids=["N", "kN", "mN or so"])
@pytest.mark.parametrize(("noise", "shown"), [(0.004, True), (0.6, False)])
def test_what_shows_must_show_in_the_noise_whatever_the_unit(
    rig: Rig, known: dict[str, float], noise: float, shown: bool, unit: float
) -> None:
    """Inertia makes 1.6 % of the spread here, more than the form of a model: noise as large as the force hides it."""
    runs = [rig(seed, pace=1.3, noise=noise) for seed in (61, 62)]
    scaled = [replace(run, targets=unit * run.targets) for run in runs]
    forces = ("sigma0", "sigma1", "sigma2", "F_c", "F_s")
    values = {name: value * unit if name in forces else value for name, value in known.items()}
    found = unseen(friction(scaled, values), ["inertia"])
    assert found.hidden == (() if shown else ("inertia",))
    assert found.unmoved == (), "what is left hides it, not the motion"


def test_a_lag_of_the_sensor_needs_speed_as_well(rig: Rig, known: dict[str, float]) -> None:
    slow = friction([rig(53, pace=0.06, noise=0.02)], known)
    assert listed(slow, ["sensor_lag@F", "delay@F"]) == ("sensor_lag", "delay")


def test_what_depends_on_the_load_needs_one_that_changes(loaded: Fitted) -> None:
    constant = drive([drive_run(43, swing=0.0), drive_run(44, swing=0.0)])
    asked = ["load_dependence", "direction_asymmetry", "tendon_elasticity@x_out"]
    assert "load_dependence" in listed(constant, asked)
    assert listed(loaded, asked) == ()


def test_a_drum_needs_more_than_a_part_of_a_turn(loaded: Fitted) -> None:
    asked = ["drum_periodic@x_out", "winding_crossover@x_out"]
    assert listed(loaded, asked[:1]) == ("drum_periodic",)
    turns = drive([drive_run(45, stroke=9.7), drive_run(46, stroke=9.7)])
    assert listed(turns, asked[:1]) == ()


def test_what_the_model_has_already_is_not_listed(rig: Rig, known: dict[str, float]) -> None:
    base = friction([rig(54), rig(55)], known)
    assert listed(base, ["coulomb", "viscous"]) == ()
    slow = friction([rig(56, pace=0.06)], known)
    assert "coulomb" not in listed(slow, ["coulomb", "inertia"])


@pytest.mark.parametrize(("middle", "shown"), [(0.0, False), (2.1, True)])
def test_a_straight_sheath_does_not_show_what_its_bending_does(middle: float, shown: bool) -> None:
    runs = []
    for seed in (58, 59):
        run = drive_run(seed)
        bend = middle * (1.0 + 0.6 * np.sin(0.47 * run.time))
        runs.append(replace(run, inputs=np.column_stack([run.inputs, bend])))
    base = refit(Task("TendonDrive", runs, ("x_out", "tau_in"), DRIVE, drives=(ANGLE,)), (), {})
    assert listed(base, ["bend_angle"]) == (() if shown else ("bend_angle",))


def test_ordinary_use_reaches_the_range_of_the_log_and_swings_the_load() -> None:
    still = drive([drive_run(47, swing=0.0)])
    use = ordinary(still, 0.0)
    assert len(use.problem.runs) == 2
    for run in use.problem.runs:
        x, load = run.inputs.T
        assert (
            0.8 * np.ptp(still.problem.runs[0].inputs[:, 0])
            < np.ptp(x)
            < 1.05 * np.ptp(still.problem.runs[0].inputs[:, 0])
        )
        assert np.ptp(load) > 0.9 * 0.17
    far = ordinary(still, 20.0)
    assert max(np.ptp(r.inputs[:, 0]) for r in far.problem.runs) > 30.0


def test_where_the_values_of_a_fit_do_not_carry_it_through_ordinary_use_the_runs_are_that(
    loaded: Fitted, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stops(fitted: Fitted, travel: float) -> Fitted:
        raise InputError("TendonDrive stopped: no level")

    monkeypatch.setattr("tsm_fmu.diagnosis.choice.visibility.ordinary", stops)
    assert listed(loaded, ["inertia", "load_dependence", "drum_periodic"]) == ("drum_periodic",)


def test_an_angle_that_stands_does_not_show_what_bending_does_though_the_load_swings() -> None:
    """It is then a law of the load: what the log shows of it, `load_dependence` explains as well."""
    runs = [replace(r, inputs=np.column_stack([r.inputs, np.full(ROWS, 5.9)])) for r in (drive_run(61), drive_run(62))]
    rng = np.random.default_rng(63)
    runs = [replace(r, inputs=r.inputs + np.array([0.0, 0.0, 0.012]) * rng.normal(size=(ROWS, 1))) for r in runs]
    base = refit(Task("TendonDrive", runs, ("x_out", "tau_in"), DRIVE, drives=(ANGLE,)), (), {})
    assert listed(base, ["bend_angle", "load_dependence"]) == ("bend_angle",)
    assert disguised(base, "bend_angle")
    assert not disguised(base, "load_dependence")


@pytest.mark.parametrize(("swing", "stands"), [(0.014, True), (0.3, False)])
def test_a_load_that_stands_does_not_show_what_depends_on_it(swing: float, stands: bool) -> None:
    """Which side drives is then the direction, and friction that grows with the load is friction."""
    rng = np.random.default_rng(64)
    load = 0.39 * (1.0 + swing * rng.normal(size=(2, ROWS)))
    inputs = [np.column_stack([r.inputs[:, 0], y]) for r, y in zip((drive_run(61), drive_run(62)), load, strict=True)]
    runs = [replace(drive_run(seed), inputs=u) for seed, u in zip((61, 62), inputs, strict=True)]
    base = refit(Task("TendonDrive", runs, ("x_out", "tau_in"), DRIVE), (), {})
    names = ("drive_direction", "load_dependence", "tendon_elasticity@x_out", "slack@x_out")
    assert [disguised(base, spec) for spec in names] == 4 * [stands]
    assert not disguised(base, "direction_asymmetry")
    if stands:
        assert listed(base, ["drive_direction"]) == ("drive_direction",)
