"""LeBus wheel: position in the grooves, layers, wheel friction, refusals."""

import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models import lebus_winding
from tsm_fmu.models.contract import InputError
from tsm_fmu.models.lebus import geometry as lebus_geometry

K = kernel("LebusWinding")


def at(degrees, T=8.108, **values):
    p = K.params("published", values)
    _, o = lebus_winding.start(p, lebus_winding.Inputs(math.radians(degrees), T))
    return o


@pytest.mark.parametrize(
    ("degrees", "mm"), [(0, 1.6), (165, 1.52), (180, 1.44), (345, 1.36), (360, 1.28), (720, 0.96), (1800, 0.0)]
)
def test_position_oracles(degrees, mm):
    assert at(degrees).z_p == pytest.approx(mm * 1e-3, abs=1e-15)


def test_position_is_continuous_monotone_in_a_layer_and_goes_back_in_the_next():
    theta = np.linspace(0, 2 * 5 * 2 * math.pi, 7001)
    z = K.simulate(K.params(), np.arange(theta.size) * 0.1, np.column_stack([theta, np.ones_like(theta)]))[:, 1]
    steepest = 0.32e-3 / 2 / math.radians(30)
    assert np.abs(np.diff(z)).max() <= steepest * np.diff(theta).max() * (1 + 1e-9)
    half = 3500
    assert (np.diff(z[: half + 1]) <= 1e-18).all()
    assert (np.diff(z[half:]) >= -1e-18).all()
    np.testing.assert_allclose(z[half:], z[half::-1], atol=1e-15)


def test_straight_grooves_take_alpha_s_and_broken_ones_the_rest():
    assert at(149.99).z_p == 1.6e-3
    assert at(150.01).z_p < 1.6e-3
    assert at(180.01).z_p == at(329.9).z_p


def test_wheel_friction_per_length_of_both_layers():
    """F_f1 = .1038 N/mm, F_f2 = .1198 N/mm at 0.5 kg, 180 deg: N/m until s_w [m] makes it a force."""
    first, second = at(100, s_w=1.0), at(5 * 360 + 100, s_w=1.0)
    assert first.F_w == pytest.approx(103.8, abs=0.06)
    assert second.F_w == pytest.approx(119.8, abs=0.06)
    assert second.F_w / first.F_w * math.cos(first.gamma) / math.cos(second.gamma) == pytest.approx(2 / math.sqrt(3))
    assert at(100).F_w == 0.0  # published default: no slip length


def test_the_torque_opposes_the_way_that_the_wheel_turned_last():
    theta = [0.3, 0.5, 0.5, 0.9, 0.7, 0.7]
    T = [8.1, 8.1, 9.0, 9.0, 9.0, 2.5]
    names = [v.name for v in K.outputs]
    y = K.simulate(K.params("published", {"s_w": 7e-3}), 0.1 * np.arange(6), np.column_stack([theta, T]))
    force, radius, torque = (y[:, names.index(n)] for n in ("F_w", "r_w", "tau_w"))
    np.testing.assert_allclose(torque, np.array([0, 1, 1, 1, -1, -1]) * force * radius, rtol=1e-14)
    assert (force > 0.0).all()


def test_layers_radii_and_fleet_angle():
    assert (at(1799.9).layer, at(1800).layer) == (1, 2)
    assert at(10).r_w == pytest.approx(12.6525e-3, abs=1e-12)
    assert at(1801).r_w == pytest.approx(12.91664e-3, abs=5e-9)
    assert math.degrees(at(0).gamma) == pytest.approx(0.458, abs=5e-4)
    assert at(0).gamma == at(1800).gamma  # mirror images about the wheel's middle


def test_groove_lengths_give_the_straight_angle():
    r = 0.0125
    assert lebus_geometry.straight_angle(2 * r * math.radians(150), 2 * r * math.radians(30), r) == pytest.approx(
        math.radians(150), rel=1e-14
    )
    with pytest.raises(InputError, match=r"expected both positive and l_s \+ l_b = 2 pi r"):
        lebus_geometry.straight_angle(0.05, 0.05, r)
    with pytest.raises(InputError, match=r"l_b = -0\.01 m"):
        lebus_geometry.straight_angle(2 * math.pi * r + 0.01, -0.01, r)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"alpha_s": math.pi}, r"parameter alpha_s = 3.14159.*rad.*expected a value in"),
        ({"alpha_s": 0.0}, "parameter alpha_s = 0.0 rad"),
        ({"D": 0.0}, "parameter D = 0.0 m"),
        ({"mu": -0.1}, "parameter mu = -0.1"),
        ({"n_layers": 0}, "parameter n_layers = 0"),
        (
            {"n_t": 6.67},
            r"take 0.00213.* m -- expected at most the wheel's width L_d0 = 0.0016 m -- lower n_t or widen",
        ),
    ],
)
def test_parameters_out_of_bounds_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        K.params("published", values)


@pytest.mark.parametrize(
    ("theta", "T", "message"),
    [
        ([0.1, -0.01], [1.0, 1.0], "LebusWinding stopped: theta is negative -- the grooves begin at 0"),
        ([60.0, 62.9], [1.0, 1.0], "theta is beyond n_layers \\* n_t turns -- all layers are full"),
        ([0.1, 0.2], [1.0, -1.0], "tension T is negative -- expected 0 or more"),
    ],
)
def test_a_step_outside_the_grooves_fails_with_one_line(theta, T, message):
    with pytest.raises(InputError, match=message):
        K.simulate(K.params(), [0.0, 0.1], np.column_stack([theta, T]), compiled=False)
