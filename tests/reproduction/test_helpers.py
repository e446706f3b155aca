"""Baselines and signal preparation against cases with a known answer."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.reproduction import loops
from tsm_fmu.reproduction.baseline import MANY_MASSES, ONE_MASS, Rubbed, left
from tsm_fmu.reproduction.preparation import filtered, predicted, prepared
from tsm_fmu.reproduction.preparation import left as left_by_preparation

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


STEP = 2e-3
COUNT = 4.7e-6


def smoothed(signal, cutoff, differences=0):
    """Butterworth of order 2 forth and back as its closed form on the circle, then central differences.

    The bilinear transform maps w to tan(w h/2): |H|^2 = 1/(1 + (tan(w h/2)/tan(w_c h/2))^4). The signal is periodic.
    """
    w = math.tau * np.fft.rfftfreq(signal.size, STEP)
    with np.errstate(divide="ignore"):
        gain = 1.0 / (1.0 + (np.tan(w * STEP / 2) / math.tan(math.pi * cutoff * STEP)) ** 4)
    return np.fft.irfft(np.fft.rfft(signal) * gain * (1j * np.sin(w * STEP) / STEP) ** differences, signal.size)


def noisy_counts(seed):
    """Whole periods of a motion, an encoder's counts of it with jitter, what is far from both ends.

    The model remembers for seconds what the filter makes of the first samples.
    """
    time = np.arange(6000) * STEP
    x = 6.1e-3 * np.sin(math.tau * time) + 1.7e-3 * np.cos(2 * math.tau * time)
    noise = np.random.default_rng(seed).normal(0.0, 0.7 * COUNT, time.size)
    return time, x, COUNT * np.round((x + noise) / COUNT), (time > 8.0) & (time < 10.0)


@pytest.mark.parametrize("cutoff", [2.7, 9.0, 31.0])
def test_noisy_counts_are_prepared_as_the_closed_form_of_the_filter_says(cutoff):
    time, _, counts, inside = noisy_counts(7)
    for order, signal in enumerate(prepared(time, counts, cutoff)):
        expected = smoothed(counts, cutoff, order)
        assert np.abs(signal - expected)[inside].max() < 1e-6 * np.abs(expected).max(), order


@pytest.mark.parametrize("cutoff", [5.0, 20.0, 50.0])
def test_noise_of_the_acceleration_is_that_of_the_filtered_spectrum(cutoff):
    """White noise of density s^2: its variance after |H|^4 (sin(w h)/h)^4 is the mean of that over the circle."""
    noise = np.random.default_rng(11).normal(0.0, 1.3, 400_000)
    time = np.arange(noise.size) * STEP
    circle = np.linspace(0.0, math.pi, 200_001)[:-1]
    gain = 1.0 / (1.0 + (np.tan(circle / 2) / math.tan(math.pi * cutoff * STEP)) ** 4)
    for order, signal in enumerate(prepared(time, noise, cutoff)):
        power = 1.3**2 * np.mean(gain**2 * (np.sin(circle) / STEP) ** (2 * order))
        assert np.std(signal) == pytest.approx(math.sqrt(power), rel=0.03), order


@pytest.mark.parametrize("cutoff", [2.7, 31.0])
def test_what_the_preparation_leaves_is_what_the_model_gives_for_the_closed_form(cutoff):
    """MMT 2015 identifies from such signals; the model switches branches with the sign of the acceleration."""
    time, x, counts, inside = noisy_counts(23)
    k = kernel("SingleTsmLuGre")
    names = [v.name for v in k.inputs]

    def force(*motion):
        rows = np.column_stack([dict(zip("xva", motion, strict=True)).get(n, np.zeros(time.size)) for n in names])
        return k.simulate(k.params("published"), time, rows)[:, [v.name for v in k.outputs].index("F")]

    w = math.tau
    speed = 6.1e-3 * w * np.cos(w * time) - 1.7e-3 * 2 * w * np.sin(2 * w * time)
    acceleration = -6.1e-3 * w**2 * np.sin(w * time) - 1.7e-3 * (2 * w) ** 2 * np.cos(2 * w * time)
    true = force(x, speed, acceleration)
    ours = force(*(smoothed(counts, cutoff, order) for order in range(3)))
    (found,) = left_by_preparation(
        "SingleTsmLuGre", "published", time, counts, true, scored=inside, cutoffs=[cutoff]
    ).values()
    assert found == pytest.approx(np.mean((ours - true)[inside] ** 2), rel=1e-3)
    assert np.abs(predicted("SingleTsmLuGre", "published", time, counts, cutoff) - ours)[inside].max() < 1e-2


def test_the_fmus_outlive_the_processes_that_run_them():
    """From Python 3.13 on a forked process lets go of what ends with the first one."""
    folder = loops._folder()
    assert loops.side_by_side(abs, [(-3,), (2,)]) == [3, 2]
    assert folder.is_dir()


KILLED_AT_WORK = r"""
import os, time
from tsm_fmu.reproduction import loops

def work(_):
    os.write(1, b"%d\n" % os.getpid())  # in one piece: where nothing is buffered, two prints get mixed
    time.sleep(100.0)

loops.side_by_side(work, [(1,), (2,)])
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes cannot be forked here")
def test_the_processes_of_a_killed_one_end_with_it():
    with subprocess.Popen([sys.executable, "-c", KILLED_AT_WORK], stdout=subprocess.PIPE, text=True) as killed:
        workers = {int(killed.stdout.readline()) for _ in range(2)}
        assert killed.pid not in workers
        killed.kill()
        rest, _ = killed.communicate(timeout=30.0)  # ends when nobody holds the pipe
    assert rest == ""
