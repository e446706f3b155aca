"""Baselines and signal preparation against cases with a known answer."""

import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.reproduction.baseline import MANY_MASSES, ONE_MASS, Rubbed, left
from tsm_fmu.reproduction.preparation import filtered, prepared

T = np.arange(0.0, 6.0, 0.01)
X = 4.3e-3 * np.sin(1.9 * T)
V = 4.3e-3 * 1.9 * np.cos(1.9 * T)
T_OUT = 17.0 + 700.0 * X


def rubbed(force):
    return Rubbed(T, X, V, T_OUT, force, T > 1.0)


def test_one_mass_leaves_nothing_of_coulomb_friction_and_half_of_a_ramp():
    coulomb = np.where(V > 0.0, 3.1, -4.7)
    assert np.abs(left(rubbed(coulomb))[ONE_MASS]).max() < 1e-12
    assert np.std(left(rubbed(coulomb + X * 1e3))[ONE_MASS]) > 0.5


def test_many_masses_find_an_elastic_capstan_again():
    k = kernel("LebusTransmission")
    values = {"L_1": 1.5, "R_1": 1.5 / math.pi, "slack": 1.0, "winding_strain": 0.0, "T_0": float(T_OUT[0])}
    p = k.params(values={**values, "mu": 0.23 / math.pi, "EA": 9.1e3 * 1.5})
    y = k.simulate(p, T, np.column_stack([(X - X[0]) / (p.D / 2), T_OUT * p.D / 2]))
    force = y[:, [v.name for v in k.outputs].index("T_a")] - T_OUT
    off = left(rubbed(force))
    assert np.abs(off[MANY_MASSES]).max() < 0.02 * np.ptp(force)
    assert np.std(off[ONE_MASS]) > 5 * np.std(off[MANY_MASSES])


def test_a_slow_sine_passes_the_preparation_and_counts_are_smoothed():
    time = np.arange(0.0, 8.0, 2e-3)
    x = 0.83 * np.sin(1.3 * time)
    count = 2 * math.pi / 14400
    smooth, v, a = prepared(time, count * np.round(x / count), 8.0)
    inside = (time > 1.0) & (time < 7.0)
    assert np.abs(smooth - x)[inside].max() < count
    assert np.abs(v - 0.83 * 1.3 * np.cos(1.3 * time))[inside].max() < 0.02 * 0.83 * 1.3
    rough = np.gradient(np.gradient(count * np.round(x / count), 2e-3), 2e-3)
    exact = -0.83 * 1.3**2 * np.sin(1.3 * time)
    assert np.std((a - exact)[inside]) < 0.05 * np.std((rough - exact)[inside])


@pytest.mark.parametrize("cutoff", [3.0, 11.0])
def test_the_filter_has_no_phase_and_a_quarter_of_the_power_at_its_cutoff(cutoff):
    time = np.arange(0.0, 12.0, 1e-3)
    wave = np.sin(math.tau * cutoff * time)
    out = filtered(wave, 1e-3, cutoff)
    inside = (time > 4.0) & (time < 8.0)
    gain = 2.0 * np.mean((out * wave)[inside])
    assert gain == pytest.approx(0.5, rel=5e-3)
    assert abs(2.0 * np.mean((out * np.cos(math.tau * cutoff * time))[inside])) < 5e-3
