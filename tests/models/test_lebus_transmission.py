"""Numbers computed apart from our code, limits and invariants of the LeBus transmission, refusals."""

import json
import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.units import same_quantity, unit_to_si
from tsm_fmu.models import lebus_transmission
from tsm_fmu.models.contract import InputError, flat, packed

K = kernel("LebusTransmission")
R, G, L = 0.0125, 9.81, 1.5
CASES = {"m05_180": (0.5, 1), "m05_540": (0.5, 3), "m10_180": (1.0, 1), "m10_540": (1.0, 3)}  # kg, half turns


def run(p, theta_in, tau_load):
    tau = np.broadcast_to(np.asarray(tau_load, dtype=float), np.shape(theta_in))
    return K.simulate(p, np.arange(len(theta_in)) * 0.1, np.column_stack([theta_in, tau]), compiled=False)


def forward_error(p, tau, s_out=0.785):
    """Driver ahead of the follower [mm] when the follower has gone ``s_out`` [m]."""
    s = np.linspace(0, s_out + 0.02, 1612)
    y = run(p, s / R, tau)
    return np.interp(s_out, y[:, 0] * R, s - y[:, 0] * R) * 1e3


@pytest.mark.parametrize(
    ("preset", "EA", "path_only", "with_winding", "T_a0"),
    [
        ("m05_180", 6482, 1.220, 2.069, 8.108),
        ("m05_180", 9973, 0.793, 1.345, 8.108),
        ("m05_540", 6482, 2.393, 4.943, 22.158),
        ("m05_540", 9973, 1.555, 3.213, 22.158),
        ("m10_180", 6482, 2.695, 4.526, 16.217),
        ("m10_180", 9973, 1.752, 2.942, 16.217),
        ("m10_540", 6482, 5.041, 10.274, 44.317),
        ("m10_540", 9973, 3.276, 6.678, 44.317),
    ],
)
def test_forward_errors(preset, EA, path_only, with_winding, T_a0):
    """Printed to three decimals; while the load is hung on the wheels already exchange 1 mm of strained tendon."""
    tau = CASES[preset][0] * G * R
    p = K.params(preset, {"EA": EA, "winding_strain": 0})
    assert run(p, [0.0, 1.0], tau)[-1, 1] == pytest.approx(T_a0, abs=6e-4)
    assert forward_error(p, tau) == pytest.approx(path_only, abs=6e-4)
    p = p._replace(winding_strain=1)
    second_order = 2e-3 * (with_winding - path_only)
    assert forward_error(p, tau) == pytest.approx(with_winding, abs=6e-4 + second_order)


@pytest.mark.parametrize(("preset", "EA", "mm"), [
    ("m05_180", 6482, 0.58), ("m05_180", 9973, 0.38), ("m05_540", 6482, 2.06), ("m05_540", 9973, 1.34),
    ("m10_180", 6482, 1.17), ("m10_180", 9973, 0.76), ("m10_540", 6482, 4.12), ("m10_540", 9973, 2.68),
])  # fmt: skip
def test_lost_motion_of_a_hanging_load(preset, EA, mm):
    """(2 W L/EA)(cosh lam - 1)/lam: the driver turns back by it before the follower does."""
    mass, turns = CASES[preset]
    lam = 0.16 * math.pi * turns
    lost = 2 * mass * G * L / EA * (math.cosh(lam) - 1) / lam
    assert lost * 1e3 == pytest.approx(mm, abs=6e-3)
    p = K.params(preset, {"EA": EA})
    s = np.array([0.0, 0.1, 0.1 - lost * (1 - 1e-9), 0.1 - lost * 1.01])
    y = run(p, s / R, mass * G * R)
    assert y[2, 0] == y[1, 0]
    assert y[3, 0] == pytest.approx(y[1, 0] - 0.01 * lost / R, rel=1e-4)


@pytest.mark.parametrize(
    ("preset", "mm"), [("m05_180", 2.44), ("m05_540", 4.79), ("m10_180", 5.39), ("m10_540", 10.08)]
)
@pytest.mark.parametrize("slack", [0.0, 0.0237])
def test_lost_motion_with_loads_in_both_directions(preset, mm, slack):
    """(delta_a - delta_0) + (delta_b - delta_0) + slack, from running one way to running the other."""
    tau = CASES[preset][0] * G * R
    p = K.params(preset, {"EA": 6482, "winding_strain": 0, "slack": slack})
    y = run(p, np.array([0.0, 0.2, 0.1]) / R, [tau, tau, -tau])
    ahead = np.array([0.0, 0.2, 0.1]) - y[:, 0] * R
    assert (ahead[1] - ahead[2] - slack) * 1e3 == pytest.approx(mm, abs=6e-3)
    assert (y[2, 1], y[2, 2]) == (0.0, pytest.approx(y[1, 1], rel=1e-12))  # tendon b now carries what a did


def test_bend_location_decides_the_elongation():
    """All the bend at the driver: I = L exp(-lam) (907, 332 mm); all at the follower: I = L."""
    for turns, at_driver in ((1, 907.3), (3, 332.0)):
        lam, bend = 0.16 * math.pi * turns, 1e-7
        sharp = {"n_seg": 2, "winding_strain": 0, "T_0": 0.0}
        radius = bend / (math.pi * turns)
        driver = K.params("published", {**sharp, "L_1": bend, "R_1": radius, "L_2": L, "R_2": 0.0})
        follower = K.params("published", {**sharp, "L_1": L, "R_1": 0.0, "L_2": bend, "R_2": radius})
        T_a0 = math.exp(lam)
        stretch = [run(p, [0.0, 3.0], R)[-1, 3] * p.EA / T_a0 * 1e3 for p in (driver, follower)]
        assert stretch[0] == pytest.approx(at_driver, abs=0.1)
        assert stretch[1] == pytest.approx(1500.0, abs=0.1)


@pytest.mark.parametrize(("turns", "I"), [(1, 1178.97), (3, 774.53)])
def test_uniform_bend_integral(turns, I):
    p = K.params("published", {"R_1": L / math.pi / turns, "T_0": 0.0, "winding_strain": 0})
    y = run(p, [0.0, 3.0], R)
    assert y[-1, 3] * p.EA / y[-1, 1] * 1e3 == pytest.approx(I, abs=5e-3)


@pytest.mark.parametrize(
    ("n_t", "end", "largest", "where", "slack_end", "slack_max"),
    [
        (5.0, 0.0, 8.03, 0.5, 16.4, 16.43),
        (20 / 3, 5.47, 10.71, 2 / 3, 11.2, 21.9),
        (10.0, 16.06, 16.06, 1.0, 32.85, 32.85),
    ],
)
def test_layers_alone_give_the_shape_of_the_forward_error(n_t, end, largest, where, slack_end, slack_max):
    """Ten turns, no friction, stiff tendon, error of the wheel angles times D/2."""
    values = {"n_t": n_t, "layers": 1, "mu": 0.0, "EA": 1e9, "T_0": 0.0, "slack": 0.0, "winding_strain": 0}
    theta = np.linspace(0, 20 * math.pi, 901)
    y = run(K.params("published", values), theta, 1e-6)
    error = R * (theta - y[:, 0]) * 1e3
    assert error[-1] == pytest.approx(end, abs=0.01)
    assert error.max() == pytest.approx(largest, abs=0.01)
    first = np.argmax(error > error.max() - 1e-3)
    assert theta[first] / theta[-1] == pytest.approx(where, abs=2e-3)
    assert y[:, 4].max() * 1e3 == pytest.approx(slack_max, abs=0.05)
    if n_t != 5.0:
        assert y[-1, 4] * 1e3 == pytest.approx(slack_end, abs=0.05)


def test_the_wheel_waits_where_the_radius_jumps():
    """At a layer's end the tension must follow the new radius (2 %) before the follower goes on."""
    values = {"n_t": 2.0, "layers": 1, "winding_strain": 0, "slack": 0.05}
    p = K.params("m10_180", values)
    theta = np.concatenate([[0.0], np.linspace(12.5, 13.2, 2001)])
    y = run(p, theta, 0.12)
    edge = 4 * math.pi
    waits = np.flatnonzero(y[:, 0] == edge)
    assert waits.size > 3
    lam = 0.16 * math.pi
    r_1, r_2 = 12.6525e-3, 12.6525e-3 + 0.305e-3 * math.sqrt(3) / 2
    assert y[waits[0] - 1, 1] == pytest.approx(0.12 / r_2 * math.exp(lam), rel=1e-10)
    assert y[waits[-1] + 1, 1] == pytest.approx(0.12 / r_1 * math.exp(lam), rel=1e-10)
    assert (np.diff(y[waits, 1]) > 0).all()


def test_without_friction_the_load_sees_a_spring_and_no_hysteresis():
    p = K.params("m10_540", {"mu": 0.0, "winding_strain": 0})
    rng = np.random.default_rng(4)
    theta = np.concatenate([[0.0], rng.uniform(0, 20, 60)])
    y = run(p, theta, 9.81 * R)
    np.testing.assert_allclose(theta - y[:, 0], (9.81 - 1.1) * L / p.EA / R, atol=1e-12)  # I = L
    np.testing.assert_allclose(y[:, 1], 9.81, rtol=1e-12)


@pytest.mark.parametrize("small", [1e-4, 1e-6, 1e-9])
def test_the_frictionless_limit_is_smooth(small):
    theta = np.array([0.0, 7.1, 6.9, 7.05, 0.3])
    with_little = run(K.params("m10_540", {"mu": small}), theta, 0.1)
    without = run(K.params("m10_540", {"mu": 0.0}), theta, 0.1)
    np.testing.assert_allclose(with_little[:, :4], without[:, :4], rtol=0, atol=200 * small + 1e-11)


def test_elongation_goes_with_one_over_EA():
    theta = np.array([0.0, 3.0, 2.99, 2.995, 1.7])
    a, b = (run(K.params("m05_540", {"EA": EA, "winding_strain": 0}), np.array([0.0, 3.0]), 0.07) for EA in (5e3, 2e4))
    assert a[-1, 3] == pytest.approx(4 * b[-1, 3], rel=1e-12)
    assert a[-1, 1] == pytest.approx(b[-1, 1], rel=1e-12)
    # the whole path scales: motions divided by EA give the same tensions
    scaled = run(K.params("m05_540", {"EA": 2e4, "winding_strain": 0}), theta / 4, 0.07)
    same = run(K.params("m05_540", {"EA": 5e3, "winding_strain": 0}), theta, 0.07)
    np.testing.assert_allclose(scaled[:, 1], same[:, 1], rtol=1e-9)


def test_rate_independence():
    p = K.params("m05_540")
    theta = np.cumsum(np.random.default_rng(8).normal(0, 0.2, 90))
    u = np.column_stack([theta, np.full(90, 0.06)])
    slow = K.simulate(p, np.cumsum(np.random.default_rng(9).uniform(0.1, 9, 90)), u, compiled=False)
    fast = K.simulate(p, np.arange(90) * 1e-4, u, compiled=False)
    assert (slow == fast).all()


def test_a_closed_cycle_takes_energy_and_power_balances_while_running():
    p = K.params("m05_540", {"slack": 0.0, "T_0": 9.0, "winding_strain": 0})
    theta = 1.3 * np.sin(np.linspace(0, 4 * math.pi, 2401)) + 2.0
    y = run(p, theta, 0.05)
    cycle = slice(1200, 2401)
    given = np.trapezoid(y[cycle, 5], theta[cycle])
    taken = 0.05 * (y[2400, 0] - y[1200, 0])
    assert given > taken + 0.1
    assert y[2400, 0] == pytest.approx(y[1200, 0], abs=1e-9)


def test_mirrored_load_and_motion_mirror_the_drive():
    """With no slack tendon b is tendon a the other way round."""
    p = K.params("m05_540", {"slack": 0.0, "T_0": 4.0})
    theta = np.cumsum(np.random.default_rng(5).normal(0, 0.15, 120))
    theta -= theta[0]
    tau = 0.06 * np.sin(np.arange(120) / 7)
    up, down = run(p, theta, tau), run(p, -theta, -tau)
    np.testing.assert_allclose(down[:, 0], -up[:, 0], atol=1e-11)
    np.testing.assert_allclose(down[:, [2, 1]], up[:, [1, 2]], rtol=1e-8, atol=1e-9)


def test_stages_of_a_reversal_with_slack():
    """Hanging on b after the turn: tendon a relaxes (1), slack is taken up (0 or 2 as loaded), then it runs (2)."""
    p = K.params("m05_180", {"slack": 0.05, "winding_strain": 0})
    theta = np.array([0.0, 0.0, 5.0, 4.999, 4.8, 3.0, 1.0, 0.8, -2.0])
    y = run(p, theta, 0.0)
    assert y[:, 6].tolist()[:2] == [0, 0]
    assert y[2, 6] == 2
    assert y[3, 6] == 1
    assert y[5, 6] == 0  # both loose: only slack
    assert y[5, 0] == y[4, 0]
    assert y[-1, 6] == 2
    assert (y[5, 1], y[5, 2]) == (0.0, 0.0)


def test_slack_of_tendon_b_is_reported_and_kept():
    y = run(K.params("m05_180", {"winding_strain": 0}), [0.0, 40.0], 0.5 * G * R)
    delta_0 = 1.1 * L / 6786
    assert y[-1, 4] == pytest.approx(0.154 + y[-1, 3] - delta_0, abs=1e-12)  # slack + delta_a - 2 delta_0


def test_wheel_friction_adds_to_tension_and_torque_not_to_the_forward_error():
    theta = [0.0, 3.0, 2.0]
    plain = run(K.params("m05_180"), theta, 0.06)
    rough = run(K.params("m05_180", {"s_w": 0.011}), theta, 0.06)
    np.testing.assert_array_equal(plain[:, [0, 3, 4]], rough[:, [0, 3, 4]])
    share = 2 * 0.16 * 0.011 / 0.025
    np.testing.assert_allclose(rough[1:, 1], plain[1:, 1] * [1 + share, 1 - share], rtol=1e-12)
    np.testing.assert_allclose(rough[1:, 5], plain[1:, 5] * [1 + share, 1 - share], rtol=1e-12)


def test_winding_strain_closes_over_a_cycle():
    """What forward motion wound is paid out again: after the first cycle the second repeats it."""
    p = K.params("m10_180")
    theta = np.tile([0.5, 30.0], 4)
    y, plain = (run(p._replace(winding_strain=on), theta, G * R) for on in (1, 0))
    np.testing.assert_allclose(y[4:6, 0], y[6:8, 0], atol=2e-6)
    # the first cycle put tendon wound at the load's tension where preload tendon had been
    left = 29.5 * (G - 1.1) / p.EA
    assert plain[2, 0] - y[2, 0] == pytest.approx(left, rel=0.02)


def test_state_survives_json():
    p = K.params("m05_540")
    u = [lebus_transmission.Inputs(x, 0.06) for x in (0.0, 4.0, 3.97, 3.983, 3.976)]
    s, _ = lebus_transmission.start(p, u[0])
    for now in u[1:]:
        s, _ = lebus_transmission.step(p, s, now, 0.1)
    assert all(isinstance(x, float) for x in flat(s))
    again = packed(lebus_transmission.State, json.loads(json.dumps(flat(s))))
    following = lebus_transmission.Inputs(3.9, 0.055)
    assert lebus_transmission.step(p, again, following, 0.1) == lebus_transmission.step(p, s, following, 0.1)


@pytest.mark.parametrize("name", ["LebusWinding", "LebusTransmission", "LebusCompensator"])
def test_presets_are_the_printed_numbers_in_si(name):
    model = kernel(name)
    for preset, about in model.presets.items():
        p = model.params(preset)
        declared = {v.name: v for v in model.parameters}
        for parameter, (number, unit) in about.printed.items():
            assert same_quantity(unit, declared[parameter].quantity.unit)
            expected = number * unit_to_si(unit).factor
            assert model.named(p)[parameter] == pytest.approx(expected, rel=1e-14)


def test_compiled_equals_plain():
    p = K.params("m05_540", {"T_0": 6.0, "slack": 0.002})
    rng = np.random.default_rng(6)
    theta = np.cumsum(rng.normal(0, 0.1, 200))
    u = np.column_stack([theta, 0.06 + 0.03 * np.sin(np.arange(200) / 9)])
    t = np.arange(200) * 0.01
    np.testing.assert_array_equal(K.simulate(p, t, u), K.simulate(p, t, u, compiled=False))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"mu": -0.01}, "parameter mu = -0.01"),
        ({"EA": 0.0}, "parameter EA = 0.0 N"),
        ({"T_0": -1.0}, "parameter T_0 = -1.0 N"),
        ({"D": 0.0}, "parameter D = 0.0 m"),
        (
            {"L_1": 0.0},
            r"L_1 = 0.0 m with n_seg = 1 -- expected a length above 0 .*Eq \(16\).* -- set L_1 or lower n_seg",
        ),
        ({"n_seg": 3, "L_2": 0.4}, "L_3 = 0.0 m with n_seg = 3"),
        ({"L_1": -0.2}, "parameter L_1 = -0.2 m"),
        ({"n_seg": 9}, "parameter n_seg = 9"),
        ({"R_1": 0.001}, "mu times the total bending angle = 240.0 -- expected at most 30"),
        ({"s_w": 0.09}, "s_w = 0.09 m -- expected below 0.0390.* m, where wheel friction takes the whole tension"),
        ({"n_t": 0.0}, "parameter n_t = 0.0"),
    ],
)
def test_parameters_out_of_bounds_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        K.params("published", values)


@pytest.mark.parametrize("theta", [[0.0, -0.1], [0.0, 2 * 2 * math.pi * 6.67 + 0.01]])
def test_a_driver_outside_its_layers_fails_the_step(theta):
    with pytest.raises(
        InputError, match="LebusTransmission stopped: driver leaves the grooves -- expected 0 to n_layers"
    ):
        run(K.params("published", {"layers": 1}), theta, 0.06)
