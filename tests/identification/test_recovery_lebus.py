"""LebusTransmission finds what a chain of springs with Coulomb friction was made of.

The truth is the finite-element oracle of tests/models, which has displacements and no tension profiles; on it lie
coloured noise and the steps of an encoder and of a converter. Tendon a carries a load, then the load turns over and
tendon b, which was loose, takes it. Known and fixed are what a ruler measures and a log cannot tell: lengths and
bending radii (L/EA and mu L/R are all that acts), the switches, and the layers, which are off. The oracle has no s_w.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import rig
from lebus_finite_elements import Chain

from tsm_fmu.identification.fit import Fit, fit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.specification import search_space

K = kernel("LebusTransmission")
LENGTH, BEND = 1.43, 0.217
PLANTED = {"mu": 0.1371, "EA": 7311.0, "T_0": 1.37, "slack": 0.0213, "D": 0.02543}
PULL, BACK = 5.31, 3.77
"""Loads on tendon a, then on tendon b [N]."""
ENCODER = 2.0 * np.pi / 20_000.0
CONVERTER = 30.0 / 4096.0
CHANNELS = ("theta_out", "T_a", "T_b")


def legs(*turns: float, speed: float = 2.5e-5) -> np.ndarray:
    """Driver travel [m] from turn to turn, a row each ``speed`` metres."""
    parts = [np.linspace(a, b, max(2, round(abs(b - a) / speed)))[1:] for a, b in pairwise(turns)]
    return np.concatenate([[turns[0]], *parts])


def measured() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, inputs and clean outputs."""
    p = PLANTED
    r = p["D"] / 2.0

    def lam(share: np.ndarray) -> np.ndarray:
        return p["mu"] * LENGTH / BEND * share

    first = legs(0.0, 0.0061, 0.0031, 0.0047, 0.0038)
    second = legs(first[-1], 0.0, 0.0027, 0.0009, 0.0041)
    a = Chain(125, LENGTH, p["EA"], p["T_0"], lam, False)
    a.move(0.0, PULL)
    rows = [(a.move(s, PULL), a.T[0], 0.0) for s in first]
    b = Chain(125, LENGTH, p["EA"], 0.05, lam, False)
    loose = first[-1] + p["slack"] + (0.05 - p["T_0"]) * LENGTH / p["EA"]
    b.move(0.0, BACK)
    rows += [(loose - b.move(first[-1] - s, BACK), 0.0, b.T[0]) for s in second]
    outputs = np.array(rows) / [r, 1.0, 1.0]
    load = np.concatenate([np.full(first.size, PULL), np.full(second.size, -BACK)]) * r
    travel = np.concatenate([first, second])
    return 0.01 * np.arange(travel.size), np.column_stack([travel / r, load]), outputs


@pytest.fixture(scope="module")
def result() -> Fit:
    time, inputs, clean = measured()
    noise = np.column_stack([rig.coloured(time.size, size, 81 + k) for k, size in enumerate((1e-3, 0.05, 0.05))])
    step = np.array([ENCODER, CONVERTER, CONVERTER])
    run = FitRun("chain", time, inputs, step * np.round((clean + noise) / step))
    known = {"L_1": LENGTH, "R_1": BEND, "winding_strain": 0}
    fixed = [v.name for v in K.parameters if v.name not in PLANTED]
    return fit(K, [run], CHANNELS, search_space(K, "published", known, fixed))


def test_planted_parameters_are_recovered_within_their_intervals(result: Fit) -> None:
    missed = {}
    for name, true in PLANTED.items():
        p = result.parameters[name]
        assert p.stderr is not None, name
        if abs(p.value - true) > 4.0 * p.stderr or p.stderr > 0.05 * true:
            missed[name] = (true, p.value, p.stderr)
    assert missed == {}
    assert not result.at_bound
    assert not result.undetermined


def test_what_is_left_is_the_noise(result: Fit) -> None:
    assert result.measured["theta_out"].rmse == pytest.approx(1e-3, rel=0.15)
    assert result.measured["T_a"].rmse == pytest.approx(0.05, rel=0.25)
