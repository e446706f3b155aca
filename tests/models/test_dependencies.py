"""What outputs follow at once: the declared dependencies of every model against its step on random histories."""

import pytest

from tests.histories import moved
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models import MODELS


@pytest.mark.parametrize("name", [m.NAME for m in MODELS if m.Inputs._fields])
def test_declared_dependencies_are_those_that_random_histories_show(name):
    model = kernel(name)
    inputs = [v.name for v in model.inputs]
    declared = {(o.name, i) for o in model.outputs for i in model.roles.depends.get(o.name, inputs)}
    within, at_once = moved(model, seed=47)
    assert at_once - declared == set()  # an output that moves at once depends on what moved it
    assert declared - within == set()  # one that never moves within a step does not


def test_the_histories_tell_a_state_from_what_follows_at_once():
    """Closed forms: the motor's current and angle are states, its acceleration answers to the load torque."""
    within, at_once = moved(kernel("DcMotor"), seed=11)
    assert {("phi", "u"), ("phi", "tau_load"), ("i", "u"), ("domega", "u")} <= within
    assert at_once == {("domega", "tau_load")}
    assert moved(kernel("RotationalLoad"), seed=11)[1] == {("tau", "phi")}
