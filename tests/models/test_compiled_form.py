"""Every tendon-sheath kernel of one degree of freedom: compiled equals plain, presets equal the printed numbers."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.units import same_quantity, unit_to_si

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


@pytest.mark.parametrize("name", NAMES)
def test_state_survives_json(name):
    model = kernel(name)
    module, p = model.module, model.params()
    rng = np.random.default_rng(5)
    s, _ = module.start(p, module.Inputs(*rng.normal(size=len(model.inputs)).tolist()))
    for row in rng.normal(size=(50, len(model.inputs))).tolist():
        s, _ = module.step(p, s, module.Inputs(*row), 0.013)
    assert all(type(value) is float for value in s)
    again = module.State(*json.loads(json.dumps(s)))
    u = module.Inputs(*rng.normal(size=len(model.inputs)).tolist())
    assert module.step(p, again, u, 0.013) == module.step(p, s, u, 0.013)


@pytest.mark.parametrize(("name", "preset"), [(n, q) for n, q, values in CASES if not values])
def test_preset_is_the_printed_number_in_si(name, preset):
    model = kernel(name)
    p = model.params(preset)
    declared = {v.name: v for v in model.parameters}
    for parameter, (number, unit) in model.presets[preset].printed.items():
        variable = declared[parameter]
        value = getattr(p, variable.field)
        if preset == "mmt2015":  # per radian: the paper's numbers under the names of metres, as its text says
            assert value == number
        else:
            assert same_quantity(unit, variable.quantity.unit)
            assert value == pytest.approx(number * unit_to_si(unit).factor, rel=1e-14)
