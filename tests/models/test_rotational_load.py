"""Rotational load: spring, pendulum, contact and damping by a causal velocity filter."""

import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import rotational_load

LOAD = Kernel(rotational_load)
BARE = {"k": 0.0, "d": 0.0, "m": 0.0, "k_contact": 0.0}


def torque(values: dict[str, float], phi: list[float], dt: float = 1e-3) -> np.ndarray:
    return LOAD.simulate(LOAD.params(values=BARE | values), np.arange(len(phi)) * dt, np.c_[phi])[:, 0]


def test_spring_is_relaxed_at_phi_0() -> None:
    np.testing.assert_allclose(torque({"k": 0.37, "phi_0": 0.2}, [0.2, 1.1, -0.7]), [0.0, 0.37 * 0.9, -0.37 * 0.9])


def test_pendulum_pulls_back_to_hanging() -> None:
    found = torque({"m": 0.413, "r": 0.077}, [math.pi / 2, -math.pi / 6, math.pi])
    weight = 0.413 * 9.80665 * 0.077
    np.testing.assert_allclose(found, [weight, -weight / 2, 0.0], atol=1e-15)


def test_contact_pushes_beyond_its_angle_and_never_pulls() -> None:
    phi = np.linspace(-1.3, 1.3, 261)
    found = torque({"k_contact": 2.9, "phi_contact": 0.311}, list(phi))
    np.testing.assert_allclose(found, 2.9 * np.maximum(phi - 0.311, 0.0), atol=1e-15)
    assert found.min() == 0.0
    assert np.abs(np.diff(found)).max() <= 2.9 * 0.0100001  # no jump at the touch


@pytest.mark.parametrize("dt", [1e-4, 3e-3, 0.07])
def test_damping_sees_a_ramp_through_a_first_order_lag(dt: float) -> None:
    t = np.arange(40) * dt
    found = torque({"d": 0.83, "tau_v": 0.02}, list(0.5 + 1.7 * t), dt)
    np.testing.assert_allclose(found, 0.83 * 1.7 * -np.expm1(-t / 0.02), rtol=1e-12, atol=1e-12)


def test_damping_takes_energy_over_a_cycle() -> None:
    t = np.arange(0.0, 10.0, 1e-3)
    phi = 0.8 * np.sin(2 * np.pi * 0.5 * t)
    tau = torque({"k": 0.3, "d": 0.05, "m": 0.2, "k_contact": 1.1, "phi_contact": 0.4}, list(phi))
    last = t >= 8.0 - 5e-4  # one closed cycle after the filter has settled
    work = float(np.sum(0.5 * (tau[last][1:] + tau[last][:-1]) * np.diff(phi[last])))
    omega = 2 * np.pi * 0.5
    expected = 0.05 * math.pi * omega * 0.8**2 / (1 + (omega * 0.005) ** 2)
    assert work == pytest.approx(expected, rel=2e-3)


def test_plain_difference_without_a_filter() -> None:
    found = torque({"d": 2.0, "tau_v": 0.0}, [0.1, 0.13, 0.11], 0.01)
    np.testing.assert_allclose(found, [0.0, 6.0, -4.0], rtol=1e-12)


def test_a_load_that_starts_away_from_zero_has_no_speed_jump() -> None:
    found = torque({"d": 5.0}, [1.3, 1.3, 1.3])
    assert not found.any()
