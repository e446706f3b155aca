"""LeBus compensator: inverse of the transmission, reversal detection, load from a measured tension, LuGre option."""

import itertools
import json
import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models import lebus_compensator, lebus_transmission
from tsm_fmu.models.contract import InputError, flat, packed

DRIVE, K = kernel("LebusTransmission"), kernel("LebusCompensator")
R, G = 0.0125, 9.81
CASES = {"m05_180": 0.5, "m05_540": 0.5, "m10_180": 1.0, "m10_540": 1.0}


def simulate(k, p, *columns, dt=0.01):
    columns = np.broadcast_arrays(*columns)
    return k.simulate(p, np.arange(columns[0].size) * dt, np.column_stack(columns), compiled=False)


def reference(*turns, steps=60):
    legs = [np.linspace(a, b, steps)[1:] for a, b in itertools.pairwise(turns)]
    return np.concatenate([[turns[0]], *legs])


WANTED = reference(0.0, 31.7, 22.2, 24.1, 22.9, 23.3, 4.9, 55.1, 0.3)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"winding_strain": 0},
        {"slack": 0.0, "T_0": 23.0},
        {"slack": 0.003, "layers": 1},
        {"mu": 0.0},
        {"n_seg": 3, "L_1": 0.4, "R_1": 0.0, "L_2": 0.7, "R_2": 0.23, "L_3": 0.4, "R_3": 0.9},
    ],
)
@pytest.mark.parametrize("preset", ["m05_540", "m10_180"])
def test_forward_after_inverse_is_the_identity(preset, values):
    """The follower is where it was wanted from the first move on, through reversals and inner loops."""
    W = CASES[preset] * G
    theta_ff = simulate(K, K.params(preset, values), WANTED, W)[:, 0]
    theta_out = simulate(DRIVE, DRIVE.params(preset, values), theta_ff, W * R)[:, 0]
    np.testing.assert_allclose(theta_out[1:], WANTED[1:], rtol=0, atol=2e-12)
    assert np.abs(theta_ff - WANTED).max() > 0.01  # there was something to compensate


def test_forward_after_inverse_with_a_load_that_turns_with_the_motion():
    """Slack of 154 mm in each reversal: theta_b = 716 deg and more."""
    theta_r = reference(0.0, 20.0, 3.0, 15.0)
    way = np.sign(np.diff(theta_r, prepend=-1.0))
    T = 0.5 * G * way
    p, q = K.params("m05_180"), DRIVE.params("m05_180")
    theta_ff = simulate(K, p, theta_r, T)[:, 0]
    theta_out = simulate(DRIVE, q, theta_ff, T * R)[:, 0]
    running = np.abs(theta_out - theta_r) < 1e-11
    first_back = 60
    assert theta_ff[first_back - 1] - theta_ff[first_back] > math.radians(706)
    # turned over by its own load the follower falls through the slack; it is back in place where the reference meets it
    assert running[1:first_back].all()
    assert running[-1]


def test_inverse_after_forward_is_the_identity_while_the_follower_runs():
    p, q = (k.params("m10_540", {"winding_strain": 0}) for k in (K, DRIVE))
    theta_in = reference(0.0, 30.0, 11.0, 11.4, 3.0, 50.0)
    y = simulate(DRIVE, q, theta_in, G * R)
    theta_ff = simulate(K, p, y[:, 0], G)[:, 0]
    runs = y[:, 6] == 2
    assert runs.sum() > 150
    # the record begins with the follower already sagged, which the compensator takes for its unloaded place
    offset = theta_in[59] - theta_ff[59]
    np.testing.assert_allclose((theta_ff + offset)[runs][59:], theta_in[runs][59:], rtol=0, atol=1e-11)


def test_elongation_angle_of_the_forward_stroke_and_hysteresis_angle_of_the_turn():
    """(39a): theta_aw = [T_a0 I - T_0 L]/(EA r); (39b) for a hanging load: (2 W L/EA)(cosh lam - 1)/(lam r)."""
    W, lam, EA, L = 0.5 * G, 0.16 * math.pi, 6482.0, 1.5
    p = K.params("m05_180", {"EA": EA, "winding_strain": 0})
    y = simulate(K, p, np.array([0.0, 7.0, 6.5]), W)[:, 0]
    ahead = (W * math.exp(lam) * L * (1 - math.exp(-lam)) / lam - 1.1 * L) / EA / R
    back = 2 * W * L / EA * (math.cosh(lam) - 1) / lam / R
    assert y[1] - 7.0 == pytest.approx(ahead, rel=1e-11)
    assert ahead * R * 1e3 == pytest.approx(1.220, abs=6e-4)
    assert y[2] - 6.5 == pytest.approx(ahead - back, rel=1e-10)


def test_reversal_band_keeps_the_driver_at_rest():
    p = K.params("m05_540", {"reversal_band": 0.02})
    y = simulate(K, p, np.array([0.0, 5.0, 4.99, 4.985, 5.0, 5.01, 4.995, 4.9]), 0.5 * G)[:, 0]
    assert y[1] == y[2] == y[3] == y[4] < y[5] == y[6]
    same = simulate(K, K.params("m05_540"), np.array([0.0, 5.0, 5.01, 4.9]), 0.5 * G)[:, 0]
    assert y[-1] == pytest.approx(same[-1], abs=1e-12)


def test_load_noise_never_turns_the_driver_against_the_reference():
    rng = np.random.default_rng(12)
    theta_r = np.repeat([0.0, 9.0], 100)
    y = simulate(K, K.params("m05_180"), theta_r, 0.5 * G + rng.normal(0, 0.05, 200))[:, 0]
    assert (np.diff(y) >= 0).all()


@pytest.mark.parametrize(("preset", "guess_is_right"), [("m05_180", True), ("m05_540", False)])
def test_tension_measured_at_the_driver_gives_the_load(preset, guess_is_right):
    """Closed through the drive's own T_a, one step late; the load changes on the way.

    At 540 deg the load at rest does not show at the driver (W exp(-lam) < T_0): the first samples run without it.
    """
    p = K.params(preset, {"tension_at": 1})
    q = DRIVE.params(preset)
    theta_r = reference(0.0, 20.0, 8.0, 30.0, steps=150)
    kg = np.where(np.arange(theta_r.size) < 400, 0.5, 0.8)
    drive, out = lebus_transmission.start(q, lebus_transmission.Inputs(0.0, kg[0] * G * R))
    comp, _ = lebus_compensator.start(p, lebus_compensator.Inputs(0.0, out.T_a))
    error = []
    for wanted, mass in zip(theta_r[1:], kg[1:], strict=True):
        comp, ff = lebus_compensator.step(p, comp, lebus_compensator.Inputs(wanted, out.T_a), 0.01)
        drive, out = lebus_transmission.step(q, drive, lebus_transmission.Inputs(ff.theta_ff, mass * G * R), 0.01)
        error.append(out.theta_out - wanted)
    error = np.abs(error)
    assert (error[0] < 1e-9) == guess_is_right
    assert error[2:390].max() < (1e-9 if guess_is_right else 1e-3)  # reversals included
    assert error[399:402].max() > 1e-2  # the new load is seen a step late
    assert error[-20:].max() < 1e-3
    assert comp.tau_load == pytest.approx(0.8 * G * R, rel=1e-9)


def test_lugre_adds_the_stretch_of_its_friction():
    """Steady: f = mu W + sigma2 v; f L/(EA r). 0.18 mm at EA = 6482 N and 0.5 kg without the viscous part."""
    W, EA, L, v = 0.5 * G, 6482.0, 1.5, 0.05
    theta_r = np.arange(200) * 0.01 * v / R
    on, off = (simulate(K, K.params("m05_180", {"EA": EA, "lugre": i}), theta_r, W)[:, 0] for i in (1, 0))
    extra = (0.16 * W + 4.3 * v) * L / EA / R
    np.testing.assert_allclose((on - off)[5:], extra, rtol=1e-9)
    assert 0.16 * W * L / EA * 1e3 == pytest.approx(0.18, abs=2e-3)
    viscous_free = K.params("m05_180", {"EA": EA, "lugre": 1, "sigma2": 0.0})
    back = np.concatenate([theta_r, theta_r[::-1]])
    still, plain = (simulate(K, q, back, W)[:, 0] for q in (viscous_free, viscous_free._replace(lugre=0)))
    assert (still - plain)[-1] == pytest.approx(-0.16 * W * L / EA / R, rel=1e-9)


def test_lugre_without_load_does_nothing():
    theta_r = np.arange(20) * 0.1
    on, off = (simulate(K, K.params("m05_180", {"lugre": i}), theta_r, 0.0)[:, 0] for i in (1, 0))
    assert (on == off).all()


def test_state_survives_json():
    p = K.params("m05_540", {"lugre": 1})
    s, _ = lebus_compensator.start(p, lebus_compensator.Inputs(0.0, 4.9))
    for x in (3.0, 2.97, 2.985):
        s, _ = lebus_compensator.step(p, s, lebus_compensator.Inputs(x, 4.9), 0.01)
    assert all(isinstance(x, float) for x in flat(s))
    again = packed(lebus_compensator.State, json.loads(json.dumps(flat(s))))
    following = lebus_compensator.Inputs(2.5, 4.7)
    assert lebus_compensator.step(p, again, following, 0.01) == lebus_compensator.step(p, s, following, 0.01)


def test_compiled_equals_plain():
    p = K.params("m05_540", {"T_0": 6.0, "slack": 0.002, "lugre": 1})
    t = np.arange(200) * 0.01
    u = np.column_stack([WANTED[:200], 5.0 + np.sin(t * 11)])
    np.testing.assert_array_equal(K.simulate(p, t, u), K.simulate(p, t, u, compiled=False))


@pytest.mark.parametrize(
    ("values", "columns", "message"),
    [
        ({"tension_at": 1}, ([0.0, 1.0], [4.0, -1.0]), "T_measured is negative -- expected 0 or more at the driver"),
        ({"layers": 1}, ([0.0, 90.0], [4.0, 4.0]), "LebusCompensator stopped: driver leaves the grooves"),
    ],
)
def test_conditions_lost_while_running_fail_the_step(values, columns, message):
    with pytest.raises(InputError, match=message):
        simulate(K, K.params("m05_180", values), *columns)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"tension_at": 2}, "parameter tension_at = 2"),
        ({"v_s": 0.0}, "parameter v_s = 0.0"),
        ({"L_1": 0.0}, "L_1 = 0.0 m"),
    ],
)
def test_parameters_out_of_bounds_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        K.params("published", values)
