"""Play before the friction of a model whose input is a speed: it acts on the way that belongs to it."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.effects import effect_of
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.kernels.serving import filling
from tsm_fmu.models.contract import InputError, flat

MODELS = ("LuGreFriction", "SingleTsmDahl", "SingleTsmBoucWen")
GAP = 0.00173


def wandering(model: str, rows: int = 3000) -> tuple[np.ndarray, np.ndarray]:
    """A speed that turns often, with rests and an uneven clock; other inputs constant."""
    rng = np.random.default_rng(41)
    time = np.cumsum(np.r_[0.0, rng.uniform(0.7e-3, 1.3e-3, rows - 1)])
    speed = 0.11 * np.sin(7.3 * time) + 0.05 * np.sin(19.1 * time + 0.4)
    speed[(time > 0.9) & (time < 1.2)] = 0.0
    fixed = {"T_in": 31.7, "T_load": 13.3}
    columns = [speed if v.name == "v" else np.full(rows, fixed.get(v.name, 0.0)) for v in kernel(model).inputs]
    return time, np.column_stack(columns)


def after_play(time: np.ndarray, speed: np.ndarray, half_gap: float) -> np.ndarray:
    """Speed behind a play, from the way: written for this test."""
    way = np.concatenate([[0.0], np.cumsum(speed[1:] * np.diff(time))])
    behind = np.zeros_like(way)
    for k in range(1, way.size):
        behind[k] = way[k] - half_gap if way[k] - half_gap > behind[k - 1] else min(behind[k - 1], way[k] + half_gap)
    return np.concatenate([speed[:1], np.diff(behind) / np.diff(time)])


@pytest.mark.parametrize("model", MODELS)
def test_friction_behind_a_play_is_that_of_the_motion_that_is_left(model: str) -> None:
    time, inputs = wandering(model)
    column = [v.name for v in kernel(model).inputs].index("v")
    behind = inputs.copy()
    behind[:, column] = after_play(time, inputs[:, column], GAP)
    plain, expected = (kernel(model).simulate(kernel(model).params(None, {}), time, u) for u in (inputs, behind))
    chained = chain(model, ("backlash@v",))
    found = chained.simulate(chained.params(None, {"v.backlash.w": GAP}), time, inputs)
    force = [v.name for v in chained.outputs].index("F")
    spread = expected[:, force].std()
    assert np.abs(found[:, force] - expected[:, force]).max() < 1e-9 * spread
    assert np.abs(found[:, force] - plain[:, force]).max() > 0.1 * spread


@pytest.mark.parametrize("model", MODELS)
def test_no_play_changes_nothing_bit_for_bit(model: str) -> None:
    time, inputs = wandering(model)
    chained = chain(model, ("backlash@v", "smooth_backlash@v"))
    found = chained.simulate(chained.params(None, {}), time, inputs)
    assert np.array_equal(found, kernel(model).simulate(kernel(model).params(None, {}), time, inputs))


def test_a_chain_in_stages_gives_the_same_bits() -> None:
    time, inputs = wandering("LuGreFriction")
    chained = chain("LuGreFriction", ("coulomb", "backlash@v", "smooth_backlash@v", "inertia", "delay@F"))
    values = {
        "v.backlash.w": GAP, "v.smooth_backlash.beta": -0.37, "v.smooth_backlash.alpha": 913.0, "inertia.m": 0.21,
        "F.delay.T_d": 0.0043, "coulomb.F_c": 0.13,
    }  # fmt: skip
    p = chained.params(None, values)
    table, spans, staged = np.array([flat(p)], float), np.array([[0, time.size, 0]]), np.empty((time.size, 2))
    filling(chained, table)(table, spans, time, inputs, staged)
    assert np.array_equal(staged, Kernel(chained.module).simulate(p, time, inputs))


def test_play_behind_a_lag_of_the_speed_is_that_of_the_lagged_way() -> None:
    """The order of the effects counts: while the gap is crossed nothing moves, however the speed came about."""
    time, inputs = wandering("LuGreFriction")
    effect = Kernel(effect_of("sensor_lag"))
    lagged = effect.simulate(effect.params(None, {"tau": 0.031}), time, inputs)[:, 0]
    base = kernel("LuGreFriction")
    expected = base.simulate(base.params(None, {}), time, after_play(time, lagged, GAP)[:, None])
    chained = chain("LuGreFriction", ("sensor_lag@v", "backlash@v"))
    found = chained.simulate(chained.params(None, {"v.sensor_lag.tau": 0.031, "v.backlash.w": GAP}), time, inputs)
    assert np.abs(found[:, 0] - expected[:, 0]).max() < 1e-9 * expected[:, 0].std()


def test_the_gap_is_a_way_whatever_the_speed() -> None:
    """Units of the way, not of the speed; a stroke within the gap moves nothing."""
    chained = chain("LuGreFriction", ("backlash@v",))
    assert {v.name: v.quantity.unit for v in chained.parameters}["v.backlash.w"] == "m"
    time = np.arange(2000) * 1e-3
    inputs = (0.9 * GAP * 9.7 * np.cos(9.7 * time))[:, None]
    force = chained.simulate(chained.params(None, {"v.backlash.w": GAP}), time, inputs)[:, 0]
    assert np.abs(force[50:] - force[50]).max() < 1e-9


def test_an_effect_where_it_has_no_place_is_refused_in_one_line() -> None:
    with pytest.raises(InputError, match="it can act on"):
        chain("LuGreFriction", ("backlash@T_in",))
