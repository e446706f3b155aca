"""MSSP 2015: the loops behind its claims against closed forms, kernels and python-control."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.cosim.system import Experiment
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.reproduction.loops import co_simulate
from tsm_fmu.reproduction.mssp2015 import completion as c

PERIOD = Experiment(stop=10.0, step=2e-3, evaluate_from=5.0, tracking_error="error.y", loops="delay")


def test_the_ideal_loop_has_the_closed_forms_of_the_published_set():
    found = c.ideal(c.published(crossover=math.inf))
    assert found["periodic.width"] == pytest.approx(10.406, abs=2e-2)  # sampled at 4 ms
    assert found["periodic.residual"] == pytest.approx(6.481, abs=2e-2)
    assert found["periodic.std"] == pytest.approx(1.017, abs=2e-3)


@pytest.mark.parametrize(("B", "alpha", "residual", "std"), [(0.65, 3.864, 3.09, 0.640), (0.70, 3.31, 2.70, 0.586)])
def test_the_ideal_loop_of_milder_plants_with_their_own_compensator(B, alpha, residual, std):
    found = c.ideal(c.Completion(1.00056, B, alpha, crossover=math.inf, own=True))
    assert found["periodic.residual"] == pytest.approx(residual, abs=2e-2)
    assert found["periodic.std"] == pytest.approx(std, abs=3e-3)


def test_the_lag_of_the_ideal_loop_is_that_of_a_first_order():
    """On a plant without backlash a lag tau leaves the sine of 1 - 1/(1 + i w tau)."""
    plain = c.Completion(1.0, 1.0 - 1e-12, 5.0, lag=0.021, crossover=math.inf)
    w = math.tau * 0.2
    expected = 120.0 * abs(1.0 - 1.0 / (1.0 + 1j * w * 0.021))
    assert c.ideal(plain)["periodic.width"] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("crossover", [30.0, 110.0])
def test_a_slow_drive_leaves_of_a_sine_what_its_loop_says(crossover):
    """On a plant without backlash: 1 - T(i w)/(1 + i w tau), T from motor, gear and PID by hand, delay as it is."""
    plain = c.Completion(1.0, 1.0 - 1e-12, 5.0, lag=0.013, crossover=crossover)
    m, g = kernel("DcMotor").params(values={"gear_ratio": 134.0}), c.position_loop(crossover)
    s = 1j * math.tau * 0.2
    torque = m.efficiency * m.gear_ratio * m.k_t
    inertia = m.J_load + m.efficiency * m.gear_ratio**2 * m.J_rotor
    current = (m.L_a * s + m.R_a) * (inertia * s + m.efficiency * m.gear_ratio**2 * m.b) / torque
    motor = 1.0 / (s * (current + m.gear_ratio * m.k_e))
    open_loop = (g.kp + g.ki / s + g.kd * s / (g.T_f * s + 1.0)) * motor * np.exp(-s * 2e-3 / 2.0)
    expected = 120.0 * abs(1.0 - open_loop / (1.0 + open_loop) / (1.0 + s * 0.013))
    assert c.ideal(plain)["periodic.width"] == pytest.approx(expected, rel=2e-3)


def test_the_loop_of_fmus_is_the_ideal_loop_but_for_friction_and_counts():
    """The numbers agree within what both can do; in a slow loop the drive makes more of the error than that."""
    stiff, slow = c.Completion(0.988, 0.69, 4.84, lag=0.0211), c.Completion(0.984, 0.673, 5.03, 0.02, crossover=60.0)
    for completion, found in zip((stiff, slow), c.co_simulated([stiff, slow], PERIOD), strict=True):
        ideal = c.ideal(completion, PERIOD)
        for name in c.NAMES:
            assert found[name] == pytest.approx(ideal[name], abs=0.15), name
    exact = c.ideal(replace(slow, crossover=math.inf), PERIOD)
    assert found["non_periodic.residual"] > exact["non_periodic.residual"] + 1.0


def test_a_lag_in_the_loop_of_fmus_is_seen_in_the_width():
    width = "periodic.uncompensated"  # of one of the four loops
    found, ideal = {}, {}
    for tau in (0.03, 0.0):
        completion = c.Completion(1.0, 0.7, 4.8, lag=tau)
        (run,) = co_simulate({width: c.cases(completion, PERIOD)[width]}, ["error.y"]).values()
        found[tau] = np.ptp(np.degrees(run.columns["error.y"][PERIOD.window(run.time)]))
        ideal[tau] = c.ideal(completion, PERIOD)["periodic.width"]
    assert found[0.03] - found[0.0] == pytest.approx(ideal[0.03] - ideal[0.0], abs=0.05)


def test_deviations_are_one_on_the_edge_of_a_print():
    numbers = {name: span.hi for name, span in ((n, c.TRACKED[n].span) for n in c.NAMES)}
    np.testing.assert_allclose(c.deviations(numbers), 1.0)
    assert c.worst({**numbers, "periodic.width": c.TRACKED["periodic.width"].span.middle}) == pytest.approx(1.0)


def test_a_search_finds_a_set_that_is_there():
    """Numbers of a known completion as targets: the refinement returns to it from nearby."""
    truth = c.Completion(0.99, 0.62, 5.5, lag=0.012)
    wanted = c.ideal(truth, PERIOD)
    shift = {n: c.TRACKED[n].span.middle - wanted[n] for n in c.NAMES}
    near = replace(truth, c=0.985, B=0.6, alpha=5.2, lag=0.015)
    found = c._at(near, c._refined(near, c._place(near), shift, PERIOD))
    assert c._cost(c._place(found), near, shift, PERIOD) < 0.2 * c._cost(c._place(near), near, shift, PERIOD)
