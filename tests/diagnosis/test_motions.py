"""Motions that a diagnosis plays by itself: the menu of next experiments, and what counts as ordinary use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.next_motion import menu, next_motion, playable
from tsm_fmu.diagnosis.choice.visibility import _strokes, _sweep, ordinary
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.fits.response import places_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

LEVEL, LOAD = 0.4, 0.3


def fitted(load: float = 0.11) -> Fitted:
    """TendonDrive on two runs of two sines about a level, under a load that swings or rests."""
    t = np.arange(1500) * 0.0113
    runs = []
    for k in range(2):
        x = LEVEL + 0.7 * np.sin(1.7 * t + k) + 0.2 * np.sin(0.61 * t)
        tau = LOAD + load * np.sin(0.9 * t + k)
        y = 1.02 * tau + 0.1 * np.tanh(np.gradient(x, t) / 0.01)
        runs.append(FitRun(f"r{k}", t, np.column_stack([x, tau]), np.column_stack([x, y])))
    return refit(Task("TendonDrive", runs, ("x_out", "tau_in"), {}), (), {}, steps=1)


@pytest.fixture(scope="module")
def one() -> Fitted:
    return fitted()


def sizes(one: Fitted) -> tuple[float, float, float]:
    """Middle and half of the stroke, and the frequency at which a full sine is as fast as the runs were (99 %)."""
    x = np.concatenate([r.inputs[:, 0] for r in one.problem.runs])
    v = np.concatenate([p.v for p in places_of(one)])
    half = 0.5 * np.ptp(x)
    return 0.5 * (x.max() + x.min()), half, float(np.quantile(np.abs(v), 0.99)) / (2 * np.pi * half)


def triangle(phase: np.ndarray) -> np.ndarray:
    """From -1 up and down again, once for each whole number."""
    part = phase % 1.0
    return np.where(part < 0.5, 4.0 * part - 1.0, 3.0 - 4.0 * part)


def test_each_motion_is_what_its_words_say_at_the_size_of_the_runs(one: Fitted) -> None:
    middle, half, top = sizes(one)
    t = 0.005 * np.arange(4000)
    full = np.sin(2 * np.pi * top * t)
    clock = np.cumsum(~np.any([(t >= b) & (t < b + h) for b, h in ((2, 0.5), (5, 1), (9, 2), (14, 4))], axis=0)) * 0.005
    shapes = {
        "one full stroke, sine at the highest speed": full,
        "one full stroke, sine at a tenth of the highest speed": np.sin(0.2 * np.pi * top * t),
        "sweep from a tenth of the highest speed to it": np.sin(2 * np.pi * top * (0.1 * t + 0.45 * t**2 / t[-1])),
        "half strokes about both ends": 0.5 * full + np.where(t == 0.0, 0.0, np.where(t % 10.0 < 5.0, 0.5, -0.5)),
        "strokes of growing size, nested reversals": t / t[-1] * full,
        "slide, hold for growing times, slide": triangle(0.5 * top * clock),
        "ramps there and back, constant speed": triangle(0.5 * top * t),
        "two sines": 0.7 * np.sin(0.8 * np.pi * top * t) + 0.3 * np.sin(2.66 * np.pi * top * t),
    }
    found = menu(one)
    assert [name for name, _, _ in found] == [f"{name}, load {how}" for name in shapes for how in ("constant", "swept")]
    for name, time, inputs in found:
        assert time == pytest.approx(t)
        assert inputs.flags.c_contiguous
        words, _, how = name.rpartition(", load ")
        expected = playable(middle + half * shapes[words], t, 2 * np.pi * half * top)
        assert np.abs(inputs[:, 0] - expected).max() < 0.012 * half, words  # a jump may be a sample off
        if how == "constant":
            assert inputs[:, 1] == pytest.approx(np.mean([r.inputs[:, 1].mean() for r in one.problem.runs]))
        else:
            loads = np.concatenate([r.inputs[:, 1] for r in one.problem.runs])
            swing = 0.5 * (loads.max() + loads.min()) + 0.5 * np.ptp(loads) * np.sin(2 * np.pi * 0.13 * t)
            assert inputs[:, 1] == pytest.approx(swing)


def test_a_hold_is_a_rest_of_its_length(one: Fitted) -> None:
    t, inputs = next((t, u) for name, t, u in menu(one) if name.startswith("slide"))
    still = np.abs(np.diff(inputs[:, 0])) < 1e-9
    edges = np.flatnonzero(np.diff(np.r_[0, still.astype(int), 0])).reshape(-1, 2)
    rests = [(t[a], 0.005 * (b - a)) for a, b in edges if b - a > 40]
    assert [begin for begin, _ in rests] == pytest.approx([2.0, 5.0, 9.0, 14.0], abs=0.12)  # corners are rounded
    assert [length for _, length in rests] == pytest.approx([0.4, 0.9, 1.9, 3.9], abs=0.06)


def test_a_load_that_rested_is_swept_by_half_its_size() -> None:
    one = fitted(load=0.0)
    for name, t, inputs in menu(one):
        swing = 0.5 * LOAD * np.sin(2 * np.pi * 0.13 * t) if name.endswith("swept") else 0.0
        assert inputs[:, 1] == pytest.approx(LOAD + swing)


def rival(one: Fitted, **values: float) -> Fitted:
    table = one.table.copy()
    for field, value in values.items():
        table[:, one.problem.fields.index(field)] = value
    return replace(one, table=table)


def test_the_next_motion_parts_the_closest_pair_of_rivals_most(one: Fitted) -> None:
    """Three rivals, two channels of unlike size: apart by the RMS without the mean, over each channel's floor."""
    rivals = [rival(one), rival(one, c=1.3), rival(one, tau_c=0.19, sigma2=0.1)]
    floor = np.array([0.02, 0.5])
    model = kernel("TendonDrive")
    columns = [[v.name for v in model.outputs].index(c) for c in ("x_out", "tau_in")]
    apart = {}
    for name, t, inputs in menu(one):
        outputs = [model.simulate(r.problem.params(r.table[0]), t, inputs)[:, columns] for r in rivals]
        pairs = [(0, 1), (0, 2), (1, 2)]
        apart[name] = min(((outputs[a] - outputs[b]).std(axis=0) / floor).max() for a, b in pairs)
    found = next_motion(rivals, floor)
    assert found is not None
    assert found.name == max(apart, key=lambda n: apart[n])
    assert found.separation == pytest.approx(apart[found.name], rel=1e-9)
    assert list(found.columns) == ["x_in", "tau_out"]
    assert found.units == {"x_in": "rad", "tau_out": "N.m"}
    _, time, inputs = next(m for m in menu(one) if m[0] == found.name)
    assert found.time == pytest.approx(time)
    assert np.column_stack(list(found.columns.values())) == pytest.approx(inputs)
    assert next_motion(rivals[:1], floor) is None
    alike = next_motion([rivals[0], rivals[0]], floor)
    assert alike is not None
    assert alike.separation == 0.0


def test_strokes_of_ordinary_use_are_smooth_moves_with_holds_between() -> None:
    """Goals 0.9, -0.7, 1, -0.6 in moves of 0.5, 0.9 and 1.4 s, with holds of 0.1, 1, 0.3 and 3 s, from 0.3 s on."""
    t = 0.005 * np.arange(4000)
    x = _strokes(t)
    at, now = 0.3, 0.0
    assert not x[t < at].any()
    for k in range(12):
        goal = (0.9, -0.7, 1.0, -0.6)[k % 4]
        length, hold = (0.5, 0.9, 1.4)[k % 3], (0.1, 1.0, 0.3, 3.0)[k % 4]
        if at + length + hold > t[-1]:
            break
        for part, share in ((0.0, 0.0), (0.25, 0.103515625), (0.5, 0.5), (0.75, 0.896484375), (1.0, 1.0)):
            assert np.interp(at + part * length, t, x) == pytest.approx(now + share * (goal - now), abs=2e-3)
        still = x[(t > at + length + 0.01) & (t < at + length + hold - 0.01)]
        assert still == pytest.approx(goal, abs=1e-9)
        at, now = at + length + hold, goal
    assert k > 8


def test_a_sweep_of_ordinary_use_grows_to_a_full_stroke_a_second() -> None:
    t = 0.005 * np.arange(4000)
    x = _sweep(t)
    swell = 0.7 + 0.3 * np.sin(2 * np.pi * 0.09 * t)
    phase = 2 * np.pi * (0.12 * t + 0.44 * t**2 / t[-1])
    assert x == pytest.approx(np.minimum(2.0 * t, 1.0) * swell * np.sin(phase), abs=1e-9)


@pytest.mark.parametrize("travel", [0.0, 5.0])
def test_ordinary_use_moves_as_far_as_the_runs_or_as_is_asked_under_a_load_that_swings(one: Fitted, travel) -> None:
    use = ordinary(one, travel)
    t = 0.01 * np.arange(1600)
    x = np.concatenate([r.inputs[:, 0] for r in one.problem.runs])
    load = np.concatenate([r.inputs[:, 1] for r in one.problem.runs])
    reach = max(max(0.5 * np.ptp(r.inputs[:, 0]) for r in one.problem.runs), travel)
    swing = max(0.5 * np.ptp(load), 0.5 * np.abs(load).max()) * np.sin(2 * np.pi * 0.17 * t)
    assert [r.name for r in use.problem.runs] == ["use 1", "use 2"]
    for run, shape in zip(use.problem.runs, (_sweep(t), _strokes(t)), strict=True):
        assert run.time == pytest.approx(t)
        assert run.inputs[:, 0] == pytest.approx(x.mean() + reach * shape)
        assert run.inputs[:, 1] == pytest.approx(load.mean() + swing)
    outputs = use.problem.outputs_of_all(use.table)
    for run, y in zip(use.problem.runs, outputs, strict=True):
        assert run.targets - y == pytest.approx(np.tile(0.01 * np.sqrt(np.mean(y**2, axis=0)), (t.size, 1)))
    assert use.table == pytest.approx(np.tile(one.table.mean(axis=0), (2, 1)))


def test_a_load_that_only_pulls_does_so_in_ordinary_use() -> None:
    """A tension that became negative could leave a friction without a level: the model would stop."""
    for load in (0.11, 0.29):
        swings = [run.inputs[:, 1] for run in ordinary(fitted(load), 0.0).problem.runs]
        assert all(swing.min() > 0.0 for swing in swings)
        assert max(np.ptp(swing) for swing in swings) > 0.6 * LOAD
