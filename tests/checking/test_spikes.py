"""Spikes are single samples that no motion makes: all that were put in are found, and nothing else."""

import numpy as np
import pytest

from tsm_fmu.checking import spikes, without_spikes

N = 1931
TIME = np.linspace(0.0, 12.7, N)


def force(rng: np.random.Generator, noise: float) -> np.ndarray:
    """Friction that reverses within a sample, on a spring."""
    v = np.cos(2.3 * TIME + 0.4)
    return 3.7 * np.sign(v) + 1.3 * np.sin(2.3 * TIME) + noise * rng.standard_normal(N)


@pytest.mark.parametrize("noise", [0.0, 0.013, 0.17])
@pytest.mark.parametrize("seed", [3, 11, 29])
def test_spikes_are_found_and_nothing_else(noise: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    y = force(rng, noise)
    assert spikes(y).size == 0
    at = np.sort(rng.choice(np.arange(50, N - 50, 7), 5, replace=False))
    y[at] += rng.choice([-1.0, 1.0], 5) * rng.uniform(9.0, 20.0, 5)
    assert spikes(y).tolist() == at.tolist()


def test_what_recurs_is_no_spike() -> None:
    rng = np.random.default_rng(5)
    y = force(rng, 0.02)
    y[20::41] += 6.3  # once in every part of the run: the rig, or the converter
    assert spikes(y).size == 0
    assert spikes(np.round(force(rng, 0.02) / 2.9) * 2.9).size == 0


def test_the_line_between_the_neighbours_takes_its_place() -> None:
    y = force(np.random.default_rng(8), 0.0)
    hurt = y.copy()
    hurt[[760, 901]] -= 31.0
    repaired = without_spikes(hurt, TIME)
    np.testing.assert_allclose(repaired, y, atol=2e-3)
    assert without_spikes(y, TIME) is y


def test_short_runs_are_left_alone() -> None:
    y = np.sin(np.linspace(0.0, 3.0, 41))
    y[20] += 9.0
    assert spikes(y).size == 0
