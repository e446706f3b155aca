"""Compiled forms that serve smaller chains: the same bits as the chain's own."""

import numpy as np
import pytest

from tsm_fmu.kernels import serving as module
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.drives import ANGLE
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.kernels.serving import serving

LARGE = {
    "LuGreFriction": ("presliding_shape", "delay@F", "offset_drift@F", "thermal", "inertia"),
    "TendonDrive": ("load_dependence", "delay@x_out", "backlash@x_out", "offset_drift@tau_in"),
}


@pytest.fixture(autouse=True)
def nothing_served_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_COMPILED", {})
    monkeypatch.setattr(module, "_FOUND", {})


def played(k: Kernel, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Outputs by the form that serves, and by the chain's own text in plain Python, at random values."""
    rng = np.random.default_rng(seed)
    t = np.arange(260) * 1.7e-3
    u = np.column_stack([np.interp(t, np.linspace(0.0, t[-1], 9), rng.normal(size=9)) for _ in k.inputs])
    values = {v.name: v.start * (1.0 + 0.03 * rng.random()) for v in k.parameters if v.kind is float and v.start > 0.0}
    p, form = k.params(None, values), serving(k)
    row = np.array([[v for item in p for v in (item if isinstance(item, tuple) else (item,))]], dtype=float)
    y = np.empty((t.size, len(k.outputs)))
    form.run(form.widened(row), np.array([[0, t.size, 0]]), t, u, y, np.zeros(1, dtype=np.int64))
    return y, k.simulate(p, t, u, compiled=False)


@pytest.mark.parametrize("model", LARGE)
def test_a_larger_chain_serves_a_smaller_one_bit_for_bit(model: str) -> None:
    whole = LARGE[model]
    run = serving(chain(model, whole)).run
    for seed, kept in enumerate((whole[1:], whole[:-1], whole[::2], whole[1:2])):
        small = chain(model, kept)
        served, own = played(small, seed)
        assert serving(small).run is run
        assert np.array_equal(served, own)


def test_another_order_or_another_input_is_not_served() -> None:
    whole = LARGE["LuGreFriction"]
    run = serving(chain("LuGreFriction", whole)).run
    assert serving(chain("LuGreFriction", (whole[2], whole[1]))).run is not run
    assert serving(chain("LuGreFriction", whole[1:2], (ANGLE,))).run is not run
