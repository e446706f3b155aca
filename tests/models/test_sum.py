"""Weighted sum."""

import numpy as np

from tsm_fmu.kernels.kernel import kernel


def test_sum_is_linear_with_its_gains() -> None:
    rng = np.random.default_rng(7)
    inputs, gains = rng.normal(size=(50, 3)), (1.7, -0.03, 2.9)
    p = kernel("Sum").params(values=dict(zip(("k1", "k2", "k3"), gains, strict=True)))
    y = kernel("Sum").simulate(p, np.arange(50.0), inputs)
    np.testing.assert_allclose(y[:, 0], inputs @ gains, rtol=1e-14, atol=1e-15)


def test_difference_preset_is_an_error_signal() -> None:
    y = kernel("Sum").simulate(kernel("Sum").params("difference"), [0.0, 0.1], [[3.25, 1.5, 77.0], [0.5, 2.0, 9.0]])
    assert y[:, 0].tolist() == [1.75, -1.5]
