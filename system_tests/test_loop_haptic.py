"""Distal torque from proximal signals in the closed MSSP loop."""

from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.cosim.cases import run_cases, with_values
from tsm_fmu.scenarios import mssp_feedforward as scenario
from tsm_fmu.scenarios import mssp_haptic

R = 0.025
EXTRA = ("motor.domega", "friction.tau_drive", "haptic.F")


@pytest.fixture(scope="module")
def case(fmus):
    system, experiment = scenario.cases({name: fmus(name) for name in scenario.FMUS})["periodic.law_1"]
    return {"periodic.law_1": (system, replace(experiment, stop=11.0))}


@pytest.fixture(scope="module")
def run(case):
    return run_cases(case, record=[*scenario.RECORD, *EXTRA])["periodic.law_1"]


def test_the_plants_own_model_returns_the_torque_of_the_load(run):
    rounding = 8 * np.finfo(float).eps * np.max(np.abs(run.columns["friction.tau_drive"]))
    assert np.max(np.abs(run.columns["haptic.tau_out"] - run.columns["load.tau"])) <= rounding
    assert np.ptp(run.columns["load.tau"]) > 0.1
    friction = (run.columns["friction.tau_drive"] - run.columns["load.tau"]) / R
    np.testing.assert_allclose(friction, run.columns["friction.F"], atol=rounding / R)
    assert np.max(np.abs(friction)) > 5.0  # the estimate is not trivial: friction exceeds the load's 4 N at the pulley


def test_quantities_are_the_friction_columns_of_the_tables(case, run):
    found = scenario.quantities("periodic.law_1", run)
    window = run.time >= 10.0 - 1e-9
    error = (run.columns["haptic_lugre.tau_out"] - run.columns["load.tau"])[window] / R
    assert found["haptic_lugre_mean"].value == pytest.approx(np.mean(error), rel=1e-12)
    assert found["haptic_lugre_std"].value == pytest.approx(np.std(error), rel=1e-12)
    assert found["haptic_lugre_peak_to_peak"].value == pytest.approx(np.ptp(error), rel=1e-12)
    assert found["friction_std"].value == pytest.approx(np.std(run.columns["friction.F"][window]), rel=1e-12)


def test_lugre_estimator_is_right_where_its_assumptions_hold(case, run):
    """With k_x = lambda = F_0 = 0 and n = sigma = 1, Eqs (6), (7) are its own law up to the speed it derives."""
    own = {"k_x": "0", "lambda": "0", "F_0": "0", "n": "1", "sigma": "1"}
    changed = with_values(case, {f"friction.{name}": value for name, value in own.items()})
    changed = with_values(changed, {"haptic_lugre.tau_v": "0"})
    (plain,) = run_cases(changed, record=[*scenario.RECORD, *EXTRA]).values()
    error = mssp_haptic.friction_error(plain, "haptic_lugre")
    p = {"upsilon": 25.8085, "force_scale": 0.04, "rho": 26.6659, "k_zeta": 127.9493}
    quotient = np.diff(plain.columns["motor.phi"], prepend=plain.columns["motor.phi"][0]) / 1e-3
    apart = np.abs(quotient - plain.columns["motor.omega"])
    bound = p["force_scale"] * (p["upsilon"] * apart + p["k_zeta"] * p["rho"] * np.cumsum(apart) * 1e-3)
    assert (np.abs(error) <= bound + 1e-9).all()
    here = plain.time >= 1.0
    assert np.max(np.abs(error[here])) < 0.1 * np.max(np.abs(mssp_haptic.friction_error(run, "haptic_lugre")[here]))


def test_uncompensated_case_has_no_estimator(fmus):
    cases = scenario.cases({name: fmus(name) for name in scenario.FMUS})
    with_it = {name for name, (system, _) in cases.items() if any(c.name == "haptic" for c in system.components)}
    assert with_it == set(mssp_haptic.REPORTED)
