"""The natural loop from its FMUs: motor, controller, tendon drive and load, each of the other's torque and motion."""

import numpy as np
import pytest

from tsm_fmu.cosim.cases import run_cases, statistics
from tsm_fmu.cosim.order import schedule
from tsm_fmu.cosim.system import check_system
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios import tendon_drive_loop as scenario


@pytest.fixture(scope="module")
def cases(fmus):
    return scenario.cases({name: fmus(name) for name in scenario.FMUS})


@pytest.fixture(scope="module")
def runs(cases):
    return run_cases(cases, record=scenario.RECORD)


def test_no_loop_is_algebraic_and_torques_and_voltage_are_a_step_late(cases):
    for system, _ in cases.values():
        plan = schedule(check_system(system))
        assert plan.loops == ()
        late = {".".join(link.target) for link in plan.delayed}
        assert late == {"motor.u", "motor.tau_load", "drive.tau_out"}


def test_drive_and_load_in_the_loop_are_the_kernels_on_the_motion_of_the_motor(cases, runs):
    drive, load = kernel("TendonDrive"), kernel("RotationalLoad")
    for name, run in runs.items():
        values = {c.name: dict(c.parameters) for c in cases[name][0].components}
        before = np.append(run.columns["load.tau"][:1], run.columns["load.tau"][:-1])  # its torque comes a step late
        inputs = np.column_stack([run.columns["motor.phi"], before])
        x_out, v_in, tau_in = drive.simulate(drive.params(values=values["drive"]), run.time, inputs).T
        tau = load.simulate(load.params(values=values["load"]), run.time, run.columns["drive.x_out"][:, None])[:, 0]
        assert np.abs(x_out - run.columns["drive.x_out"]).max() < 1e-12
        assert np.abs(v_in - run.columns["drive.v_in"]).max() < 1e-9
        assert np.abs(tau - run.columns["load.tau"]).max() < 1e-12
        assert np.abs(tau_in - run.columns["drive.tau_in"]).max() < 1e-12
        assert np.ptp(tau_in - before) > 0.1  # friction, or the test would not see it


def test_feedforward_helps_and_distal_feedback_leaves_what_the_loop_leaves(cases, runs):
    metrics = statistics(cases, runs, scenario.quantities)
    for load in scenario.LOADS:
        motor, compensated, distal = (metrics[f"{f}.{load}"].tracked().std for f in ("motor", "compensated", "distal"))
        assert compensated < 0.7 * motor
        assert distal < 0.7 * motor


def test_the_drive_loses_work_to_friction_and_makes_none(cases, runs):
    for name, run in runs.items():
        found = {name: metric.value for name, metric in scenario.quantities(name, run).items()}
        assert found["work_lost"] > 0.0
        assert found["voltage_peak"] <= 24.0
        assert abs(found["work_in"]) > abs(found["work_out"])
