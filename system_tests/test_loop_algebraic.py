"""Loops without a state, iterated in each step: closed forms, and an inertia outside the motor against one inside."""

import math
from itertools import pairwise

import numpy as np
import pytest

from tsm_fmu.cosim.master import simulate_system
from tsm_fmu.cosim.system import Component, Connection, System
from tsm_fmu.cosim.trajectory import SimulationStopped


def sums(fmus, k):
    """A = k b + r, b = a round two sums."""
    components = (
        Component("r", fmus("ReferenceSignal"), {"amplitude_1": 0.7, "frequency_1": 1.3, "offset": 0.2}),
        Component("a", fmus("Sum"), {"k1": k, "u3": 0.0}),
        Component("b", fmus("Sum"), {"u2": 0.0, "u3": 0.0}),
        Component("after", fmus("Sum"), {"k1": 2.0, "u2": 0.0, "u3": 0.0}),
    )
    links = (("b.y", "a.u1"), ("r.y", "a.u2"), ("a.y", "b.u1"), ("b.y", "after.u1"))
    return System(components, tuple(Connection(*link) for link in links))


@pytest.mark.parametrize("k", [0.3, -0.8, -5.5, 3.7])
def test_an_iterated_loop_has_the_closed_form_also_where_plain_repetition_diverges(fmus, k):
    run = simulate_system(sums(fmus, k), 0.4, 0.01, loops="iterate", tolerance=1e-12)
    expected = run.columns["r.y"] / (1.0 - k)
    assert np.abs(run.columns["a.y"] - expected).max() < 1e-10
    assert np.abs(run.columns["after.y"] - 2.0 * expected).max() < 1e-10
    assert run.messages == ("algebraic loop " + run.messages[0].split("loop ")[1],)
    assert run.messages[0].endswith(": iterated in each step")


def test_a_loop_without_a_solution_is_named_with_its_time_and_the_rows_stay(fmus):
    with pytest.raises(SimulationStopped, match=r"^algebraic loop .* at t = 0 s: after 60 passes its values still"):
        simulate_system(sums(fmus, 1.0), 0.4, 0.01, loops="iterate")


def test_an_inertia_outside_the_motor_converges_to_one_inside(fmus):
    """The torque of the inertia is held over a step: first order in the step."""
    voltage, outside = 6.0, 2.1e-4
    inside = simulate_system(
        System((Component("m", fmus("DcMotor"), {"u": voltage, "tau_load": 0.0, "J_load": 3e-4 + outside}),), ()),
        0.1,
        1e-4,
    )
    errors = []
    for step in (4e-4, 2e-4, 1e-4):
        split = System(
            (
                Component("m", fmus("DcMotor"), {"u": voltage, "J_load": 3e-4}),
                Component("j", fmus("Sum"), {"k1": outside, "u2": 0.0, "u3": 0.0}),
            ),
            (Connection("m.domega", "j.u1"), Connection("j.y", "m.tau_load")),
        )
        run = simulate_system(split, 0.1, step, loops="iterate")
        assert np.abs(run.columns["j.y"] - outside * run.columns["m.domega"]).max() < 1e-6
        errors.append(abs(run.columns["m.omega"][-1] - inside.columns["m.omega"][-1]))
    assert errors[-1] < 0.02 * inside.columns["m.omega"][-1]
    assert [math.log2(a / b) for a, b in pairwise(errors)] == pytest.approx([1.0, 1.0], abs=0.3)
