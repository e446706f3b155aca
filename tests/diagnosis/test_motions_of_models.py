"""Inputs that a diagnosis plays to models of other kinds: driven by speed, with acceleration, with driven columns."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.next_motion import _put, _slide_and_hold, menu, playable
from tsm_fmu.diagnosis.choice import visibility
from tsm_fmu.diagnosis.choice.visibility import _inputs, _strokes, _sweep
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, as_given
from tsm_fmu.diagnosis.fits.response import places_of
from tsm_fmu.kernels.drives import ANGLE, Drive
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

DT, ROWS = 0.0113, 900
T = DT * np.arange(ROWS)
GRID = 0.01 * np.arange(1600)
SHAPE = np.sin(1.9 * GRID) * np.minimum(GRID, 1.0)


def fitted(model: str, channel: str, drives: tuple[Drive, ...] = (), factor: float = 1.0) -> Fitted:
    """A model on two runs in which every input but a motion is about 2, and swings by its own amount."""
    names = [v.name for v in kernel(model).inputs] + [d.column for d in drives]
    runs = []
    for k, stroke in enumerate((0.4, 0.7)):
        x = 0.3 + stroke * np.sin(1.7 * T + k)
        v = np.gradient(x, T)
        motion = {"x": x, "x_in": x, "v": v, "a": np.gradient(v, T)}
        other = {n: factor * (2.0 + 0.2 * (j + 1) * np.sin(0.9 * T + j + k)) for j, n in enumerate(names)}
        runs.append(FitRun(f"r{k}", T, np.column_stack([(other | motion)[n] for n in names]), np.tanh(v)[:, None]))
    return as_given(Task(model, runs, (channel,), {}, drives=drives), ())


def inputs_of(one: Fitted, travel: float = 0.0) -> dict[str, np.ndarray]:
    names = [v.name for v in one.problem.kernel.inputs]
    return dict(zip(names, _inputs(one, GRID, SHAPE, travel).T, strict=True))


def means(one: Fitted) -> dict[str, float]:
    every = np.concatenate([r.inputs for r in one.problem.runs])
    return dict(zip([v.name for v in one.problem.kernel.inputs], every.mean(axis=0).tolist(), strict=True))


def column(one: Fitted, name: str) -> np.ndarray:
    j = [v.name for v in one.problem.kernel.inputs].index(name)
    return np.concatenate([r.inputs[:, j] for r in one.problem.runs])


@pytest.mark.parametrize("travel", [0.0, 2.3])
def test_a_model_driven_by_its_speed_goes_as_far_as_the_runs(travel: float) -> None:
    one = fitted("SingleTsmDahl", "F")
    found, level = inputs_of(one, travel), means(one)
    reach = max(0.5 * max(np.ptp(np.cumsum(r.inputs[:, 0]) * DT) for r in one.problem.runs), travel)
    assert 0.65 < reach < 0.75 or travel > 0.0
    v = np.gradient(reach * SHAPE, GRID)
    assert found["v"] == pytest.approx(v)
    assert found["a"] == pytest.approx(np.gradient(v, GRID))
    assert found["T_in"] == pytest.approx(level["T_in"])
    load = column(one, "T_load")
    size = max(0.5 * np.ptp(load), 0.5 * np.abs(load).max())
    assert size == pytest.approx(0.5 * np.abs(load).max())
    assert found["T_load"] == pytest.approx(level["T_load"] + size * np.sin(2 * np.pi * 0.17 * GRID))


@pytest.mark.parametrize("travel", [0.0, 2.3])
def test_speed_and_acceleration_of_a_position_are_its_derivatives(travel: float) -> None:
    one = fitted("PairedTsmFriction", "F")
    found, level = inputs_of(one, travel), means(one)
    reach = max(0.7, travel)
    x = level["x"] + reach * SHAPE
    assert found["x"] == pytest.approx(x, abs=2e-4)
    v = np.gradient(found["x"], GRID)
    assert found["v"] == pytest.approx(v)
    assert found["a"] == pytest.approx(np.gradient(v, GRID))
    assert found["tau_in"] == pytest.approx(level["tau_in"])
    assert np.ptp(found["tau_load"]) > 0.9 * np.abs(column(one, "tau_load")).max()


def test_columns_that_drive_effects_bend_follow_and_swing_each_at_its_pace() -> None:
    drives = (Drive("load", "T1", "N"), ANGLE, Drive("load", "T2", "N"))
    one = fitted("TendonDrive", "tau_in", drives, factor=-0.3)
    found, level = inputs_of(one), means(one)
    assert list(found) == ["x_in", "tau_out", "T1", "Theta", "T2"]
    assert found["Theta"] == pytest.approx(level["Theta"] * (1.0 + 0.5 * np.sin(2 * np.pi * 0.071 * GRID)))
    for number, name in enumerate(("tau_out", "T1", "T2")):
        values = column(one, name)
        size = max(0.5 * np.ptp(values), 0.5 * np.abs(values).max())
        turn = 2 * np.pi * (0.17 + 0.023 * number) * GRID
        assert found[name] == pytest.approx(level[name] + size * np.sin(turn)), name


def test_a_load_that_swings_about_zero_swings_as_far() -> None:
    """Half of its range is then more than half of its magnitude."""
    one = fitted("TendonDrive", "tau_in")
    runs = [FitRun(r.name, r.time, r.inputs - [0.0, 1.9], r.targets) for r in one.problem.runs]
    one = as_given(Task("TendonDrive", runs, ("tau_in",), {}), ())
    load = column(one, "tau_out")
    assert np.ptp(load) > 1.2 * np.abs(load).max()
    swing = inputs_of(one)["tau_out"] - load.mean()
    assert swing == pytest.approx(0.5 * np.ptp(load) * np.sin(2 * np.pi * 0.17 * GRID))


def test_a_measured_position_beside_a_speed_is_its_way_about_its_middle() -> None:
    one = fitted("LuGreFriction", "F", (Drive("position", "way", "m"),))
    found, level = inputs_of(one), means(one)
    assert found["way"] == pytest.approx(level["way"] + np.cumsum(found["v"]) * 0.01)


def test_without_a_motion_nothing_moves() -> None:
    one: Any = SimpleNamespace(
        problem=SimpleNamespace(
            kernel=kernel("DcMotor"), runs=[SimpleNamespace(inputs=np.array([[1.0, 2.0], [4.0, 3.0]]))]
        ),
        task=SimpleNamespace(drives=()),
    )
    assert _inputs(one, GRID, SHAPE, 1.0) == pytest.approx(np.tile([2.5, 2.5], (GRID.size, 1)))


def test_ordinary_use_is_faster_where_a_rig_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 2 Hz a move takes half the time, and the sweep ends at 2 Hz."""
    monkeypatch.setattr(visibility, "ORDINARY_HZ", 2.0)
    x = _strokes(GRID)
    for at, expected in ((0.3, 0.0), (0.425, 0.45), (0.55, 0.9), (0.65, 0.9), (0.875, 0.1), (1.1, -0.7), (2.1, -0.7)):
        assert np.interp(at, GRID, x) == pytest.approx(expected, abs=2e-3), at
    t = GRID
    swell = np.minimum(t / 0.5, 1.0) * (0.7 + 0.3 * np.sin(2 * np.pi * 0.09 * t))
    phase = 2 * np.pi * (0.24 * t + 0.88 * t**2 / t[-1])
    assert _sweep(t) == pytest.approx(swell * np.sin(phase), abs=1e-9)


def test_the_menu_moves_a_speed_with_its_acceleration_and_a_measured_way() -> None:
    one = fitted("SingleTsmDahl", "F")
    places = places_of(one)
    x = np.concatenate([p.x for p in places])
    fastest = float(np.quantile(np.abs(np.concatenate([p.v for p in places])), 0.99))
    middle, half = 0.5 * (x.max() + x.min()), 0.5 * np.ptp(x)
    t = 0.005 * np.arange(4000)
    full = playable(middle + half * np.sin(fastest / half * t), t, fastest)
    names = [v.name for v in one.problem.kernel.inputs]
    (inputs,) = (u for name, _, u in menu(one) if name == "one full stroke, sine at the highest speed, load constant")
    v = np.gradient(full, t)
    level = means(one)
    assert inputs[:, names.index("v")] == pytest.approx(v, abs=1e-9)
    assert inputs[:, names.index("a")] == pytest.approx(np.gradient(v, t), abs=1e-6)
    assert inputs[:, names.index("T_in")] == pytest.approx(level["T_in"])
    assert inputs[:, names.index("T_load")] == pytest.approx(level["T_load"])
    way = fitted("LuGreFriction", "F", (Drive("position", "way", "m"),))
    _, time, inputs = menu(way)[0]
    found = dict(zip([v.name for v in way.problem.kernel.inputs], inputs.T, strict=True))
    assert found["v"] == pytest.approx(np.gradient(found["way"], time))


def test_every_load_and_angle_is_swept_by_itself_about_its_middle() -> None:
    drives = (Drive("load", "T1", "N"), ANGLE)
    one = fitted("TendonDrive", "tau_in", drives)
    found = {name.partition(", ")[2]: u for name, _, u in menu(one) if name.startswith("two sines")}
    words = {"load": "tau_out", "T1": "T1", "sheath angle": "Theta"}
    names = [v.name for v in one.problem.kernel.inputs]
    level, t = means(one), 0.005 * np.arange(4000)
    assert len(found) == 4
    for swept in ("", *words):
        label = ", ".join(f"{w} {'swept' if w == swept else 'constant'}" for w in words)
        for word, name in words.items():
            values, now = column(one, name), found[label][:, names.index(name)]
            if word == swept:
                middle, half = 0.5 * (values.max() + values.min()), 0.5 * np.ptp(values)
                assert now == pytest.approx(middle + half * np.sin(2 * np.pi * 0.13 * t)), label
            else:
                assert now == pytest.approx(np.full(t.size, level[name]), rel=2e-2), label


def test_motions_are_put_in_whatever_the_model_takes() -> None:
    t = 0.01 * np.arange(200)
    position = 0.5 * t**2
    for motion, names, expected in (
        ("v", ["v", "a", "T"], [t, np.ones(200), np.zeros(200)]),
        ("x", ["T", "x", "v"], [np.zeros(200), position, t]),
        ("x_in", ["x_in", "T"], [position, np.zeros(200)]),
        ("x", ["x", "a"], [position, np.ones(200)]),
    ):
        inputs = np.zeros((200, len(names)))
        _put(inputs, names, motion, position, t)
        inner = slice(3, -3)  # but for the ends of differences
        assert inputs[inner] == pytest.approx(np.column_stack(expected)[inner], abs=1e-9), names


def test_a_hold_stops_the_clock_and_not_the_motion() -> None:
    t = 0.005 * np.arange(4000)
    held = _slide_and_hold(t, 3.0 * t)
    for now, clock in ((1.9, 1.9), (2.4, 2.0), (2.6, 2.1), (5.5, 4.5), (8.0, 6.5), (10.0, 7.5), (12.0, 8.5),
                       (17.0, 10.5), (19.0, 11.5)):  # fmt: skip
        assert np.interp(now, t, held) == pytest.approx(3.0 * clock, abs=0.07), now


@pytest.mark.parametrize("count", [1, 19, 20, 21])
def test_corners_are_rounded_over_a_tenth_of_a_second(count: int) -> None:
    """The mean of what a speed allows over so many samples, as many to either side; the ends stay."""
    t = 0.1 / count * np.arange(400)
    position = np.where(t < 0.5 * t[-1], 0.2, 1.2)
    followed, dt = [0.2], float(t[1])
    for goal in position[1:]:
        step = min(abs(goal - followed[-1]), 3.7 * dt)
        followed.append(followed[-1] + step * np.sign(goal - followed[-1]))
    played = playable(position, t, 3.7)
    before, after = count // 2, count - 1 - count // 2
    padded = [followed[0]] * before + followed + [followed[-1]] * after
    expected = [np.mean(padded[k : k + count]) for k in range(t.size)]
    assert played == pytest.approx(expected)
