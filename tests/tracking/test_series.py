"""What a value does over runs: a saw of many teeth is a slope with jumps, and quiet lives are steady."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.tracking.series import drifts


def saw(teeth: int, length: int, slope: float, scatter: float, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).standard_normal(teeth * length)
    return np.tile(slope * np.arange(float(length)), teeth) + scatter * noise


@pytest.mark.parametrize(("teeth", "length", "seed"), [(5, 10, 31), (5, 6, 83), (4, 9, 7), (8, 7, 19)])
def test_a_saw_of_many_teeth_is_a_slope_with_its_jumps(teeth: int, length: int, seed: int) -> None:
    """One or two jumps beside a line explain little of it, and a line nothing."""
    (found,) = drifts([saw(teeth, length, 0.91, 0.23, seed)], [np.full(teeth * length, 0.02)])
    assert found.form == "trend and jump"
    low, high = found.slope_interval
    assert low < 0.91 < high
    assert high - low < 0.1
    places = [jump.between[1] for jump in found.jumps]
    assert places == [length * k for k in range(1, teeth)]
    inside = sum(jump.interval[0] < -0.91 * length < jump.interval[1] for jump in found.jumps)
    assert inside >= len(places) - 1  # 95 % of them
    assert found.scatter == pytest.approx(0.23, rel=0.35)


def test_teeth_of_different_heights_and_a_falling_slope() -> None:
    rng = np.random.default_rng(43)
    steps, at = np.array([3.1, 5.7, 2.3, 4.9]), np.array([7, 15, 22, 34])
    y = -0.37 * np.arange(41.0) + (np.arange(41)[:, None] >= at) @ steps + 0.17 * rng.standard_normal(41)
    (found,) = drifts([y], [np.zeros(41)])
    assert [jump.between[1] for jump in found.jumps] == at.tolist()
    assert found.slope == pytest.approx(-0.37, abs=0.05)
    for jump, step in zip(found.jumps, steps, strict=True):
        assert jump.size == pytest.approx(step, abs=0.6)


@pytest.mark.parametrize(("runs", "heavy"), [(50, False), (30, True)])
def test_lives_in_which_nothing_moves_are_steady(runs: int, heavy: bool) -> None:
    """Also where single runs are far off: an outlier is two large changes, one after the other."""
    moving = 0
    for seed in range(40):
        rng = np.random.default_rng(1009 * runs + seed)
        y = rng.standard_t(3.0, runs) if heavy else rng.standard_normal(runs)
        moving += drifts([y], [np.zeros(runs)])[0].form != "steady"
    assert moving <= 3  # of 40 at one in a hundred: more than three are less likely than one in a thousand
