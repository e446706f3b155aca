"""PID controller: exact linear part, anti-windup, bounds."""

import math

import control
import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

from tsm_fmu import InputError
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import pid_controller

PID = Kernel(pid_controller)
UNBOUNDED = {"u_min": -1e9, "u_max": 1e9}


def smooth(t: np.ndarray, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    f, phase = rng.uniform(0.2, 6.0, 4)[:, None], rng.uniform(0, 6.0, 4)[:, None]
    return 0.3 * np.sin(2 * np.pi * f * t + phase).sum(axis=0)


@pytest.mark.parametrize("dt", [1e-4, 1.7e-3, 0.031])
def test_linear_part_is_the_first_order_hold_equivalent(dt: float) -> None:
    p = PID.params(values=UNBOUNDED)
    t = np.arange(400) * dt
    error = smooth(t, 3) - smooth(0.0 * t, 3)  # from 0, so that the discrete system starts in steady state
    pid = control.tf([p.kp], [1]) + control.tf([p.ki], [1, 0]) + control.tf([p.kd, 0], [p.T_f, 1])
    continuous = control.tf2ss(pid)
    *discrete, _ = cont2discrete((continuous.A, continuous.B, continuous.C, continuous.D), dt, method="foh")
    _, expected, _ = dlsim((*discrete, dt), error, t)
    found = PID.simulate(p, t, np.column_stack([error, 0 * t]))[:, 0]
    np.testing.assert_allclose(found, expected[:, 0], rtol=0, atol=1e-9 * np.abs(expected).max())


def test_tends_to_the_continuous_response() -> None:
    p = PID.params(values=UNBOUNDED | {"T_f": 0.01})
    pid = control.tf([p.kp], [1]) + control.tf([p.ki], [1, 0]) + control.tf([p.kd, 0], [p.T_f, 1])
    fine = np.arange(0.0, 1.0, 1e-5)
    error = np.sin(2 * np.pi * 2.3 * fine) * 0.4
    exact = control.forced_response(pid, fine, error).outputs

    def deviation(every: int) -> float:
        inputs = np.column_stack([error[::every], 0 * error[::every]])
        return float(np.abs(PID.simulate(p, fine[::every], inputs)[:, 0] - exact[::every]).max())

    coarse, half = deviation(400), deviation(200)
    assert math.log2(coarse / half) == pytest.approx(2.0, abs=0.2)  # second order in dt
    assert deviation(10) < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize(
    ("weight", "expected"), [(1.0, 3.1 * (2.2 + 0.9)), (0.0, 3.1 * 0.9), (0.4, 3.1 * (0.88 + 0.9))]
)
def test_derivative_acts_on_weighted_reference_minus_measurement(weight: float, expected: float) -> None:
    gains = {"kp": 0.0, "ki": 0.0, "kd": 3.1, "T_f": 0.02, "weight_d": weight}
    t = np.arange(0.0, 2.0, 0.013)
    inputs = np.column_stack([0.7 + 2.2 * t, -0.9 * t])
    u = PID.simulate(PID.params(values=UNBOUNDED | gains), t, inputs)[:, 0]
    assert u[-1] == pytest.approx(expected, rel=1e-12)


def test_starts_without_derivative_or_integral_kick() -> None:
    p = PID.params(values=UNBOUNDED | {"ki": 0.0})
    u = PID.simulate(p, [0.0, 1e-3, 2e-3], [[0.8, 0.33]] * 3)[:, 0]
    np.testing.assert_allclose(u, p.kp * (0.8 - 0.33), rtol=1e-14)


@pytest.mark.parametrize("T_aw", [0.0, 0.03])
def test_saturates_exactly_at_the_bounds(T_aw: float) -> None:
    p = PID.params(values={"u_min": -3.7, "u_max": 11.9, "T_aw": T_aw})
    t = np.arange(0.0, 3.0, 1e-3)
    u = PID.simulate(p, t, np.column_stack([smooth(t, 5), -smooth(t, 6)]))[:, 0]
    assert u.max() == 11.9
    assert u.min() == -3.7
    assert np.unique(u).size > 100


def leaves_bound(p, t: np.ndarray, error: np.ndarray) -> float:
    """Time between the error's change of sign at 1 s and the output's leaving the upper bound."""
    u = PID.simulate(p, t, np.column_stack([error, 0 * t]))[:, 0]
    assert u[t < 0.99].min() == p.u_max
    return float(t[np.argmax((t > 1.0) & (u < p.u_max))] - 1.0)


def test_anti_windup_leaves_the_bound_at_once_and_windup_is_paid_back() -> None:
    gains = {"kp": 60.0, "ki": 600.0, "kd": 0.0, "u_max": 24.0}
    t = np.arange(0.0, 4.0, 1e-3)
    error = np.where(t <= 1.0, 0.5, -0.01)
    quick = leaves_bound(PID.params(values=gains | {"T_aw": 0.01}), t, error)
    assert quick <= 2e-3
    # without it u_i = 300 V has to run down to 24.6 V at 6 V/s: not in the 3 s of this test
    wound_up = PID.simulate(PID.params(values=gains | {"T_aw": 0.0}), t, np.column_stack([error, 0 * t]))[:, 0]
    assert wound_up[-1] == 24.0


def test_back_calculation_settles_where_integration_and_tracking_balance() -> None:
    p = PID.params(values={"kp": 2.0, "ki": 30.0, "kd": 0.0, "T_aw": 0.05, "u_max": 5.0})
    error, dt = 0.4, 1e-4
    t = np.arange(0.0, 1.0, dt)
    s, _ = pid_controller.start(p, pid_controller.Inputs(error, 0.0))
    for _ in t:
        s, _ = pid_controller.step(p, s, pid_controller.Inputs(error, 0.0), dt)
    # 0 = ki e + (u_max - u_raw)/T_aw, Eq (2); the split of Eq (5) is first order in dt
    u_raw = 5.0 + 30.0 * error * 0.05
    assert s.u_i == pytest.approx(u_raw - 2.0 * error, abs=2 * 30.0 * error * dt)


@pytest.mark.parametrize(("u_min", "u_max"), [(5.0, 5.0), (3.0, -3.0)])
def test_bounds_in_the_wrong_order_are_refused(u_min: float, u_max: float) -> None:
    with pytest.raises(InputError, match=rf"u_min = {u_min} V with u_max = {u_max} V -- expected u_min < u_max"):
        PID.params(values={"u_min": u_min, "u_max": u_max})


def test_default_gains_suit_the_default_motor() -> None:
    from tsm_fmu.models import dc_motor

    m, p = Kernel(dc_motor).params(), PID.params()
    n, inertia = m.gear_ratio, m.J_load + m.efficiency * m.gear_ratio**2 * m.J_rotor
    a = [
        [0.0, 1.0, 0.0],
        [0.0, -m.efficiency * n**2 * m.b / inertia, m.efficiency * n * m.k_t / inertia],
        [0.0, -m.k_e * n / m.L_a, -m.R_a / m.L_a],
    ]
    motor = control.ss(a, [[0.0], [0.0], [1 / m.L_a]], [[1.0, 0.0, 0.0]], [[0.0]])
    pid = control.tf([p.kp], [1]) + control.tf([p.ki], [1, 0]) + control.tf([p.kd, 0], [p.T_f, 1])
    gain_margin, phase_margin, _, crossover = control.margin(control.ss2tf(motor) * pid)
    assert gain_margin > 2.0
    assert phase_margin > 45.0
    assert 100.0 < crossover < 250.0
