"""The slave class by itself, without library and archive: what it answers and what it logs."""

import json
import math
import re
import sys
from types import ModuleType

import pytest
from pythonfmu.enums import Fmi2Status

from tsm_fmu.fmu.slave import KernelSlave
from tsm_fmu.models import paired_tsm_backlash, single_tsm_dahl
from tsm_fmu.models.contract import Condition

PARAMETERS = {"c": 0, "beta": 1, "alpha": 2, "x_0": 3, "x_h_0": 4}
X_IN, X_OUT, X_H = 5, 6, 7
HALF = b'{"guid": "5f0c7b3a-0000-4000-8000-000000000000", "real": [1.0, 2.0], "integer": []}'


class PairedTsmBacklash(KernelSlave):
    kernel = paired_tsm_backlash
    guid_built = "5f0c7b3a-0000-4000-8000-000000000000"


def fresh(kernel: ModuleType = paired_tsm_backlash) -> KernelSlave:
    return type("Slave", (PairedTsmBacklash,), {"kernel": kernel})(instance_name="one", resources=None)


def started(**parameters: float) -> KernelSlave:
    slave = fresh()
    slave.setup_experiment(0.0, None, None)
    slave.enter_initialization_mode()
    for name, value in parameters.items():
        slave.set_real([PARAMETERS[name]], [value])
    slave.exit_initialization_mode()
    return slave


def initialise(slave: KernelSlave) -> None:
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()


def said(slave: KernelSlave) -> str:
    return "\n".join(message.msg for message in slave.log_queue)


def move(slave: KernelSlave, steps: int, first: int = 0) -> list[float]:
    """Outputs over a wandering input with turns inside; step ``first`` is at its own time."""
    found = []
    for n in range(first, first + steps):
        slave.set_real([X_IN], [0.31 * math.sin(0.37 * n) + 0.043 * math.sin(1.9 * n)])
        assert slave.do_step(slave._time, 0.013)
        found += slave.get_real([X_OUT, X_H])
    return found


def test_outputs_follow_inputs_and_parameters_in_initialisation_mode():
    slave = fresh()
    slave.enter_initialization_mode()
    slave.set_real([X_IN], [0.2])
    assert slave.get_real([X_OUT]) == [1.00056 * 0.2]
    slave.set_real([PARAMETERS["c"], PARAMETERS["x_0"]], [0.95, 0.01])
    assert slave.get_real([X_OUT]) == [0.95 * 0.2 + 0.01]


def test_inputs_act_at_the_next_step_and_not_before():
    slave = started()
    before = slave.get_real([X_OUT])
    slave.set_real([X_IN], [0.4])
    assert slave.get_real([X_OUT]) == before
    assert slave.do_step(0.0, 0.01)
    assert slave.get_real([X_OUT]) != before


def test_first_input_is_where_the_motion_starts():
    slave = fresh()
    slave.set_real([X_IN], [0.7])
    initialise(slave)
    assert slave.do_step(0.0, 0.01)
    assert slave.get_real([X_H]) == [0.0]


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"alpha": -3.25}, "parameter alpha = -3.25 1/rad .* a value in \\(0, inf\\)"),
        ({"c": math.nan}, "parameter c = nan"),
        ({"beta": -1.3}, "beta = -1.3 with c = 1.00056 gives B = c \\+ beta = -0\\.29944.* -- expected B > 0"),
    ],
)
def test_parameters_out_of_bounds_stop_the_instance_with_their_value(parameters, expected):
    slave = started(**parameters)
    assert re.search(expected, said(slave)), said(slave)
    assert slave.log_queue[-1].status == Fmi2Status.error
    assert all(math.isnan(y) for y in slave.get_real([X_OUT, X_H]))
    assert slave.do_step(0.0, 0.01) is False
    assert re.search(expected, slave.log_queue[-1].msg)


def test_a_wrong_parameter_can_be_corrected_before_initialisation_ends():
    slave = fresh()
    slave.set_real([PARAMETERS["alpha"]], [-1.0])
    assert math.isnan(slave.get_real([X_OUT])[0])
    slave.set_real([PARAMETERS["alpha"]], [4.0])
    initialise(slave)
    assert slave.do_step(0.0, 0.01)


def test_a_parameter_is_fixed_after_initialisation():
    slave = started()
    slave.set_real([PARAMETERS["alpha"]], [3.5])
    assert "variable alpha set to 3.5 -- it is fixed after initialisation" in said(slave)
    assert slave.get_real([PARAMETERS["alpha"]]) == [10.1062]
    assert slave.do_step(0.0, 0.01) is False


@pytest.mark.parametrize(
    ("time", "step", "expected"),
    [
        (0.0, 0.0, "step size 0.0 s at t = 0.013 s"),
        (0.013, -0.013, "step size -0.013 s"),
        (0.013, math.nan, "step size nan s"),
        (0.013, math.inf, "step size inf s"),
        (math.nan, 0.013, "step from t = nan s -- expected t = 0.013 s"),
        (0.0, 0.013, "step from t = 0.0 s -- expected t = 0.013 s -- go on where the last step ended"),
        (0.039, 0.013, "step from t = 0.039 s -- expected t = 0.013 s"),
    ],
)
def test_wrong_times_are_refused_and_change_nothing(time, step, expected):
    slave = started()
    move(slave, 1)
    if step == 0.0:
        time = 0.013
    before = slave._get_fmu_state()
    assert slave.do_step(time, step) is False
    assert expected in said(slave)
    assert slave._get_fmu_state() == before
    move(slave, 3, first=1)


def test_rounding_of_the_clock_is_accepted_and_does_not_add_up():
    slave = started()
    for n in range(100_000):
        assert slave.do_step(n * 0.1, 0.1), said(slave)  # 0.1 added up differs from n * 0.1


@pytest.mark.parametrize("start", [0.0, -3.0, 7.5])
@pytest.mark.parametrize(
    ("part", "accepted"), [(1e-4, True), (-9e-4, True), (1.1e-3, False), (-0.1, False), (0.4, False)]
)
def test_a_step_may_begin_a_thousandth_of_itself_off(start, part, accepted):
    slave = fresh()
    slave.setup_experiment(start, None, None)
    initialise(slave)
    assert slave.do_step(start, 0.013)
    assert slave.do_step(start + 0.013 + part * 0.013, 0.013) is accepted
    assert (f"expected t = {start + 0.013!r} s" in said(slave)) is not accepted


def test_the_start_time_moves_the_clock_and_nothing_else():
    early, late = started(), fresh()
    late.setup_experiment(7.5, None, None)
    initialise(late)
    assert late.do_step(0.0, 0.013) is False
    assert "step from t = 0.0 s -- expected t = 7.5 s" in said(late)
    assert move(late, 20) == move(early, 20)
    assert (early._time, late._time) == pytest.approx((0.26, 7.76), rel=1e-14)


def test_a_state_of_another_build_is_refused_and_changes_nothing():
    slave, other = started(), started()
    move(slave, 3)
    state = json.loads(slave._fmu_state_to_bytes(slave._get_fmu_state()))
    other._set_fmu_state(other._fmu_state_from_bytes(json.dumps(state).encode()))
    assert move(other, 2, first=3) == move(slave, 2, first=3)  # as it is it goes on there
    before = other.get_real([X_OUT, X_H])
    other._set_fmu_state(other._fmu_state_from_bytes(json.dumps(state | {"guid": "another"}).encode()))
    assert "FMU state is foreign or damaged (it is of guid another)" in said(other)
    assert other.get_real([X_OUT, X_H]) == before
    assert other.do_step(other._time, 0.013) is False


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_an_input_that_is_not_finite_is_named_and_refused(value):
    slave = started()
    move(slave, 2)
    before = slave.get_real([X_OUT, X_H])
    slave.set_real([X_IN], [value])
    assert slave.do_step(0.026, 0.013) is False
    assert f"input x_in = {value!r} at t = 0.026 s -- expected a finite number" in said(slave)
    assert slave.get_real([X_OUT, X_H]) == before
    move(slave, 2, first=2)


def test_an_input_that_is_not_finite_at_the_start_is_named():
    slave = fresh()
    slave.set_real([X_IN], [math.nan])
    initialise(slave)
    assert "input x_in = nan at the start" in said(slave)


def failing_kernel(**functions) -> ModuleType:
    module = ModuleType("failing")
    module.__dict__.update({k: v for k, v in vars(paired_tsm_backlash).items() if not k.startswith("__")})
    module.__dict__.update(functions)
    return module


def test_an_exception_in_the_kernel_is_logged_with_time_and_inputs_and_survived():
    def step(p, s, u, dt):
        if u.x_in > 0.5:
            raise ValueError("S = 0 reached")
        return paired_tsm_backlash.step(p, s, u, dt)

    slave = fresh(failing_kernel(step=step))
    initialise(slave)
    assert slave.do_step(0.0, 0.01)
    slave.set_real([X_IN], [0.625])
    assert slave.do_step(0.01, 0.01) is False
    assert "step at t = 0.01 s with Inputs(x_in=0.625) failed: S = 0 reached" in said(slave)
    slave.set_real([X_IN], [0.25])
    assert slave.do_step(0.01, 0.01)


def test_an_output_that_is_not_finite_is_refused():
    def step(p, s, u, dt):
        state, outputs = paired_tsm_backlash.step(p, s, u, dt)
        return state, outputs._replace(x_h=math.inf)

    slave = fresh(failing_kernel(step=step))
    initialise(slave)
    assert slave.do_step(0.0, 0.01) is False
    assert "output x_h = inf at t = 0.0 s" in said(slave)


def test_a_condition_with_a_consequence_is_logged_as_a_warning():
    steep = Condition("alpha < 10", lambda p: 10.0 - p.alpha, "alpha = {alpha}", "lower it", consequence="it is steep")
    slave = fresh(failing_kernel(CONDITIONS=(steep,)))
    initialise(slave)
    assert [(m.status, m.msg) for m in slave.log_queue] == [
        (Fmi2Status.warning, "Slave: alpha = 10.1062 -- it is steep -- lower it")
    ]
    assert slave.do_step(0.0, 0.01)


def test_step_before_initialisation_is_refused():
    slave = fresh()
    assert slave.do_step(0.0, 0.1) is False
    assert "call exitInitializationMode" in said(slave)


INIT, END = ("enter_initialization_mode", "exit_initialization_mode"), ("terminate",)


@pytest.mark.parametrize(
    ("calls", "expected"),
    [
        ((INIT[1],), "exitInitializationMode in an instance that is instantiated -- expected once, after enter"),
        ((INIT[0], INIT[0]), "enterInitializationMode in an instance that is in initialisation mode -- expected once"),
        ((*INIT, INIT[0]), "enterInitializationMode in an instance that is running -- expected once"),
        ((*INIT, INIT[1]), "exitInitializationMode in an instance that is running -- expected once"),
        ((*INIT, *END, INIT[0]), "enterInitializationMode in an instance that is terminated -- expected once"),
        ((*INIT, *END, INIT[1]), "exitInitializationMode in an instance that is terminated"),
    ],
)
def test_calls_out_of_order_are_told_and_stop_the_instance(calls, expected):
    slave = fresh()
    for call in calls:
        assert slave.log_queue == []
        getattr(slave, call)()
    assert expected in said(slave)
    assert slave.log_queue[-1].status == Fmi2Status.error
    if calls[-1] == INIT[0]:
        slave.exit_initialization_mode()
    assert slave.do_step(0.0, 0.01) is False
    assert expected in slave.log_queue[-1].msg


def test_the_start_time_is_fixed_once_initialisation_begins():
    slave = started()
    slave.setup_experiment(7.5, None, None)
    assert "setupExperiment in an instance that is running -- expected before initialisation mode" in said(slave)
    assert slave.do_step(7.5, 0.01) is False


def test_after_the_end_values_can_be_read_and_nothing_else():
    slave = started()
    move(slave, 4)
    last = slave.get_real([X_OUT, X_H])
    slave.terminate()
    assert slave.do_step(slave._time, 0.013) is False
    assert "step -- expected before the end of the simulation -- reset the instance" in said(slave)
    slave.set_real([X_IN], [0.9])
    assert "variable x_in set to 0.9 -- expected before the end -- reset the instance" in said(slave)
    assert slave.get_real([X_OUT, X_H]) == last


def test_a_state_brings_its_place_in_the_order_of_calls():
    slave = started()
    move(slave, 3)
    saved = slave._fmu_state_from_bytes(slave._fmu_state_to_bytes(slave._get_fmu_state()))
    onward = move(slave, 5, first=3)
    slave.terminate()
    slave._set_fmu_state(saved)
    assert move(slave, 5, first=3) == onward
    slave.terminate()
    slave.enter_initialization_mode()
    assert "that is terminated" in said(slave)


def test_what_an_fmu_needs_is_its_first_line():
    told = type("Slave", (PairedTsmBacklash,), {"needs": "Needs Python 3.10 or later."})(instance_name="one")
    (line,) = told.log_queue
    running = ".".join(map(str, sys.version_info[:3]))
    assert (line.status, line.msg) == (Fmi2Status.ok, f"Slave: runs on Python {running}. Needs Python 3.10 or later.")


def test_no_message_is_a_format_with_something_missing():
    steep = Condition("alpha < 10", lambda p: 10.0 - p.alpha, "95 %s of %d", "lower it", consequence="it is steep")
    slave = fresh(failing_kernel(CONDITIONS=(steep,)))
    initialise(slave)
    assert "95 percents of percentd" in said(slave)


@pytest.mark.parametrize("reference", [8, -1, 4000])
def test_unknown_references_are_answered_and_logged(reference):
    slave = started()
    assert math.isnan(slave.get_real([X_IN, reference])[1])
    assert f"value reference {reference} read as Real" in said(slave)
    slave.set_real([reference], [1.5])
    assert f"value reference {reference} set to 1.5" in said(slave)
    assert slave.do_step(0.0, 0.1) is False


@pytest.mark.parametrize(("kind", "value"), [("integer", 3), ("boolean", True), ("string", "three")])
def test_access_with_the_wrong_type_is_answered_and_logged(kind, value):
    slave = started()
    assert len(getattr(slave, f"get_{kind}")([X_OUT, X_IN])) == 2
    assert f"variable x_out read as {kind.capitalize()} -- expected a variable of that type" in said(slave)
    getattr(slave, f"set_{kind}")([X_IN], [value])
    assert f"variable x_in set to {value!r} -- expected an input or parameter of this type" in said(slave)


def test_outputs_cannot_be_set():
    slave = fresh()
    slave.set_real([X_OUT], [1.0])
    assert "variable x_out set to 1.0" in said(slave)


def test_state_restored_inside_a_loop_repeats_to_the_last_bit():
    slave = started(alpha=7.31)
    move(slave, 23)
    saved = slave._fmu_state_to_bytes(slave._get_fmu_state())
    onward = move(slave, 40, first=23)
    slave._set_fmu_state(slave._fmu_state_from_bytes(saved))
    assert move(slave, 40, first=23) == onward
    other = started()  # another instance, other parameters: the state brings its own
    other._set_fmu_state(slave._fmu_state_from_bytes(saved))
    assert move(other, 40, first=23) == onward


def test_a_saved_state_does_not_follow_the_instance():
    slave = started()
    saved = slave._get_fmu_state()
    before = json.dumps(saved)
    move(slave, 5)
    assert json.dumps(saved) == before


def test_state_saved_in_initialisation_mode():
    slave = fresh()
    slave.set_real([X_IN], [0.3])
    saved = slave._get_fmu_state()
    initialise(slave)
    first = move(slave, 9)
    slave._set_fmu_state(saved)
    initialise(slave)
    assert move(slave, 9) == first


@pytest.mark.parametrize("damaged", [b"", b"{", b"[1, 2]", b"{}", b"\xff\xfe", b'{"guid": "another"}', HALF])
def test_a_damaged_or_foreign_state_is_refused(damaged):
    slave = started()
    slave._set_fmu_state(slave._fmu_state_from_bytes(damaged))
    assert "FMU state is foreign or damaged" in said(slave)
    assert slave.do_step(0.0, 0.1) is False


def test_a_fault_ends_when_an_earlier_state_is_set():
    slave = started()
    saved = slave._get_fmu_state()
    slave.set_real([PARAMETERS["c"]], [2.0])
    assert slave.do_step(0.0, 0.1) is False
    slave._set_fmu_state(saved)
    assert slave.do_step(0.0, 0.1)


def test_a_foreign_model_description_is_refused_at_instantiation(tmp_path):
    (tmp_path / "resources").mkdir()
    (tmp_path / "modelDescription.xml").write_text('<fmiModelDescription guid="other"/>')
    expected = f"guid other in modelDescription.xml -- expected {PairedTsmBacklash.guid_built}"
    with pytest.raises(RuntimeError, match=expected):
        PairedTsmBacklash(instance_name="one", resources=str(tmp_path / "resources"))


def test_a_tendon_that_would_push_is_told_once():
    slave = fresh(single_tsm_dahl)
    names = {v.name: reference for reference, v in enumerate(slave._variables)}
    slave.set_real([names["v"], names["T_in"]], [0.05, 0.125])
    initialise(slave)
    for n in range(50):
        assert slave.do_step(slave._time, 0.01), n
    assert slave.get_real([names["T_out"]])[0] < 0.0
    (told,) = slave.log_queue
    assert told.status == Fmi2Status.warning
    assert re.search(r"T_out = -\d.* N at t = .*: the tendon would push -- slack is not in this model", told.msg)


def test_the_plant_direction_alone_tells_nothing_of_slack():
    slave = fresh(single_tsm_dahl)
    names = {v.name: reference for reference, v in enumerate(slave._variables)}
    slave.set_real([names["v"], names["T_load"]], [0.05, 7.5])
    initialise(slave)
    assert slave.do_step(0.0, 0.01)
    assert slave.log_queue == []
