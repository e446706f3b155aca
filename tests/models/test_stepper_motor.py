"""StepperMotor against statics, an independent integrator, and the loss of steps."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tsm_fmu.kernels.kernel import kernel

K = kernel("StepperMotor")


def played(time, theta_cmd, tau_load, **values):
    """Rotor angle and speed for a command and a load."""
    load = np.broadcast_to(np.asarray(tau_load, dtype=float), time.shape)
    return K.simulate(K.params(values=values), time, np.column_stack([theta_cmd, load]), compiled=False)


@pytest.mark.parametrize("tau", [-1.3, 0.0, 0.37, 1.7])
def test_a_load_turns_the_rotor_back_by_its_torque_angle(tau):
    time = np.arange(0.0, 0.6, 7e-3)
    theta = played(time, np.zeros(time.size), tau)[-1, 0]
    assert theta == pytest.approx(-math.asin(tau / 1.9) / 50, abs=1e-9)


def test_the_rotor_rests_at_whole_micro_steps():
    q = 2 * math.pi / (200 * 8)
    time = np.arange(0.0, 0.8, 5e-3)
    theta = played(time, np.minimum(time, 0.3) * 0.731, 0.0, microsteps=8)[-1, 0]
    assert theta == pytest.approx(q * round(0.3 * 0.731 / q), abs=1e-9)


def test_motion_converges_to_that_of_another_integrator():
    """A smooth command: micro-steps so small that they do not show."""
    values = {"microsteps": 4096, "b": 0.02}
    tau_hold, J, b = 1.9, 1e-4, 0.02

    def rate(t, y):
        return [y[1], (tau_hold * math.sin(50 * (0.4 * math.sin(9 * t) - y[0])) - b * y[1] - 0.21) / J]

    errors = []
    for h in (2e-5, 1e-5):  # below the model's own part of a step
        time = np.arange(0.0, 0.08 + h / 2, h)
        exact = solve_ivp(rate, (0.0, 0.08), [0.0, 0.0], t_eval=time, rtol=1e-10, atol=1e-12).y[0]
        errors.append(np.abs(played(time, 0.4 * np.sin(9 * time), 0.21, **values)[:, 0] - exact).max())
    assert errors[0] < 2e-3
    assert errors[1] < 0.62 * errors[0]


def test_too_much_load_loses_whole_tooth_pitches():
    time = np.arange(0.0, 1.2, 2e-3)
    load = np.where((time > 0.2) & (time < 0.24), 2.4, 0.0)
    theta = played(time, np.zeros(time.size), load)[-1, 0]
    pitches = theta / (2 * math.pi / 50)
    assert pitches < -0.5
    assert pitches == pytest.approx(round(pitches), abs=1e-6)


def test_the_split_of_a_step_does_not_matter_at_rest():
    coarse = played(np.array([0.0, 0.5]), np.zeros(2), 0.9)[-1, 0]
    time = np.linspace(0.0, 0.5, 61)
    assert coarse == pytest.approx(played(time, np.zeros(61), 0.9)[-1, 0], abs=1e-9)


def test_a_jump_of_the_command_is_taken_up_at_the_speed_of_the_pulses():
    """Beyond the highest speed the command is made up for later; without a limit the jump is lost but for a pitch."""
    time = np.arange(0.0, 1.0, 7e-3)
    command = np.where(time > 0.1, 7.3, 0.0)
    limited = played(time, command, 0.21, omega_max=11.0)
    late = (time > 0.25) & (time < 0.7)
    assert np.mean(np.diff(limited[late, 0])) / 7e-3 == pytest.approx(11.0, rel=2e-3)  # micro-steps ripple it
    assert limited[-1, 0] == pytest.approx(7.3, abs=math.pi / 50)
    assert abs(played(time, command, 0.21)[-1, 0] - 7.3) > math.tau / 50


def test_a_command_slower_than_the_limit_is_followed_as_without_one():
    time = np.arange(0.0, 0.5, 3e-3)
    command = 0.9 * np.sin(4.0 * time)
    np.testing.assert_array_equal(played(time, command, 0.3, omega_max=3.7), played(time, command, 0.3))
