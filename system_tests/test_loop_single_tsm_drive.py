"""The closed loop of ICINCO 2013 from its FMUs: who hands what to whom, against kernels, balances and bounds."""

import math

import numpy as np
import pytest

from tsm_fmu.cosim.cases import run_cases, selected
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios import single_tsm_drive as scenario

R, NAMES = scenario.R, ("1_hz.5_mm", "1_hz.25_mm")


@pytest.fixture(scope="module")
def runs(fmus):
    cases = scenario.cases({name: fmus(name) for name in scenario.FMUS})
    return run_cases(selected(cases, NAMES), record=scenario.RECORD)


def test_the_motor_carries_the_tension_and_the_tension_is_load_and_friction(runs):
    run = runs["1_hz.5_mm"].columns
    spring = scenario.T_MEAN + scenario.STIFFNESS * R * run["motor.phi"]
    assert np.abs(run["load.tau"] / R - spring).max() < 1e-9
    balance = run["plant.T_drive"] - run["load.tau"] / R - run["plant.F"]
    step_late = run["plant.T_drive"][1:] - run["load.tau"][:-1] / R - run["plant.F"][1:]
    assert min(np.abs(balance).max(), np.abs(step_late).max()) < 1e-9
    assert np.ptp(run["plant.F"]) > 5.0


def test_the_friction_is_the_kernel_on_the_motion_of_the_motor(runs):
    k = kernel("SingleTsmDahl")
    for run in runs.values():
        columns = {"v": R * run.columns["motor.omega"], "a": R * run.columns["motor.domega"]}
        rows = np.column_stack([columns.get(v.name, np.zeros(run.time.size)) for v in k.inputs])
        force = k.simulate(k.params("published"), run.time, rows)[:, [v.name for v in k.outputs].index("F")]
        assert np.abs(force - run.columns["plant.F"]).max() < 1e-9


def test_the_voltage_at_work_is_that_of_the_motor_equations(runs):
    """U = R_a i + k_e N omega k_t N e i = tau + J domega + own friction: within what coils and steps hide."""
    run = runs["1_hz.5_mm"]
    p = kernel("DcMotor").params(values={"gear_ratio": scenario.GEAR})
    tau, omega, domega = (
        run.columns[c] * s for c, s in (("plant.T_drive", R), ("motor.omega", 1), ("motor.domega", 1))
    )
    N, e = p.gear_ratio, p.efficiency
    inertia = p.J_load + e * N * N * p.J_rotor
    own = e * N * (p.b * N * omega + p.tau_c * np.sign(omega))
    current = (tau + inertia * domega + own) / (e * N * p.k_t)
    expected = p.R_a * current + p.k_e * N * omega
    moving = (np.abs(omega) > 0.3 * np.abs(omega).max()) & (run.time > 1.0)
    assert np.median(np.abs(expected - run.columns["controller.u"])[moving]) < 0.2
    assert np.abs(run.columns["controller.u"][moving]).max() > 2.0


def test_five_millimetres_are_followed_and_twenty_five_end_at_the_voltage(runs):
    found = {name: {n: m.value for n, m in scenario.quantities(name, run).items()} for name, run in runs.items()}
    assert found["1_hz.5_mm"]["followed"] == pytest.approx(5.0, rel=0.03)
    assert found["1_hz.5_mm"]["error_rms"] < 0.5
    assert found["1_hz.25_mm"]["voltage_max"] == 24.0
    # without load and friction the speed is u/(k_e N); a square wave of it makes pi/2 of the amplitude of a sine
    p = kernel("DcMotor").params()
    bound = 1e3 * R * 24.0 / (p.k_e * scenario.GEAR) / 4.0
    assert found["1_hz.25_mm"]["followed"] < bound * (1 + 1e-9)
    assert found["1_hz.25_mm"]["error_rms"] > 2 * found["1_hz.5_mm"]["error_rms"]
    assert math.isclose(found["1_hz.5_mm"]["friction_max"], 4.8, rel_tol=0.06)  # on the imposed sine 4.826
