"""HangingLoad: torque by the cord that carries, and the work that lifts the weight."""

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel

K = kernel("HangingLoad")
M, RADIUS, G = 0.731, 0.0173, 9.80665


def played(phi, s):
    """Torque and lift."""
    rows = np.column_stack([phi, np.broadcast_to(np.asarray(s, dtype=float), np.shape(phi))])
    return K.simulate(K.params(values={"m": M, "r": RADIUS, "phi_0": phi[0]}), np.arange(len(phi)) * 7e-3, rows).T


@pytest.mark.parametrize("s", [1.0, -1.0, 0.0, 0.37])
def test_the_torque_is_that_of_the_carrying_cord_wherever_the_wheel_stands(s):
    phi = np.random.default_rng(7).normal(0.3, 2.0, 40)
    np.testing.assert_allclose(played(phi, s)[0], s * M * G * RADIUS, rtol=1e-15)


def test_either_cord_lifts_the_weight_and_the_other_way_lowers_it():
    phi = np.linspace(-0.4, 2.3, 60)
    assert played(phi, 1.0)[1][-1] == pytest.approx(RADIUS * 2.7)
    assert played(phi[::-1], -1.0)[1][-1] == pytest.approx(RADIUS * 2.7)
    assert played(phi[::-1], 1.0)[1][-1] == pytest.approx(-RADIUS * 2.7)


def test_the_work_at_the_wheel_is_the_energy_of_the_weight():
    rng = np.random.default_rng(5)
    phi, s = np.cumsum(rng.normal(0.0, 0.2, 300)), rng.choice([-1.0, 0.0, 1.0], 300)
    tau, h = played(phi, s)
    assert np.sum(tau[1:] * np.diff(phi)) == pytest.approx(M * G * h[-1], rel=1e-12)


def test_a_weight_that_is_set_down_stays_at_its_height():
    phi = np.array([0.0, 1.0, 2.0, 1.5, 0.2])
    tau, h = played(phi, [1.0, 1.0, 1.0, 0.0, 0.0])
    assert h[2] == h[3] == h[4] == pytest.approx(2.0 * RADIUS)
    assert tau[3] == tau[4] == 0.0
