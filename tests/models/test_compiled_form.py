"""Kernels of one degree of freedom over intervals of four decades and inputs that jump: compiled equals plain."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel

NAMES = (
    "PairedTsmFriction",
    "PairedTsmBacklash",
    "FeedforwardCompensator",
    "LuGreFriction",
    "TendonDrive",
    "DistalEstimator",
)
CASES = [(name, preset, {}) for name in NAMES for preset in kernel(name).presets]
CASES.append(("FeedforwardCompensator", "published", {"law": 2}))
CASES.append(("TendonDrive", "published", {"tau_v": 0.0}))


@pytest.mark.parametrize(("name", "preset", "values"), CASES)
def test_compiled_equals_plain_bit_for_bit(name, preset, values):
    model = kernel(name)
    rng = np.random.default_rng(2015)
    t = np.cumsum(10 ** rng.uniform(-5, -1, 2500))
    u = np.cumsum(rng.normal(size=(t.size, len(model.inputs))) * 10 ** rng.uniform(-9, -1, (t.size, 1)), axis=0)
    u[rng.random(u.shape) < 0.05] = 0.0
    p = model.params(preset, values)
    plain = model.simulate(p, t, u, compiled=False)
    assert np.isfinite(plain).all()
    assert (model.simulate(p, t, u) == plain).all()
