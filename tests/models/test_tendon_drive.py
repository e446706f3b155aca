"""TendonDrive and DistalEstimator: the sum of their tested parts, each other's inverse, exact steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError

DRIVE = kernel("TendonDrive")
ESTIMATOR = kernel("DistalEstimator")
UGLY = {"c": 0.913, "beta": -0.377, "alpha": 7.31, "x_0": -1.19, "x_h_0": 0.017, "ratio": 0.923}
FRICTION = {"sigma0": 3.17, "sigma1": 0.0131, "sigma2": 0.0273, "tau_c": 0.0443, "tau_s": 0.0617, "v_s": 0.23}
T = np.arange(8001) * 1e-3
X_IN = 0.52 * np.sin(2 * math.pi * 0.3 * T) + 0.11 * np.sin(2 * math.pi * 1.7 * T + 0.4)
TAU_OUT = 0.3 + 0.21 * np.cos(2 * math.pi * 0.5 * T)


def drive(values, x_in=X_IN, tau_out=TAU_OUT, time=T):
    return DRIVE.simulate(DRIVE.params(None, values), time, np.column_stack([x_in, tau_out]))


def test_motion_is_that_of_the_backlash_model():
    backlash = kernel("PairedTsmBacklash")
    motion = {k: v for k, v in UGLY.items() if k != "ratio"}
    expected = backlash.simulate(backlash.params(None, motion), T, X_IN[:, None])[:, 0]
    assert (drive(UGLY)[:, 0] == expected).all()


def test_drive_torque_is_load_over_ratio_plus_lugre_friction_of_the_filtered_speed():
    lugre = kernel("LuGreFriction")
    renamed = {"tau_c": "F_c", "tau_s": "F_s"}
    p = lugre.params(None, {renamed.get(k, k): v for k, v in FRICTION.items()})
    y = drive(UGLY | FRICTION | {"tau_v": 0.021})
    friction = lugre.simulate(p, T, y[:, [1]])[:, 0]
    assert y[:, 2] == pytest.approx(0.923 * TAU_OUT + friction, abs=1e-14)


def test_speed_filter_is_exact_on_ramps_and_a_difference_quotient_without_time_constant():
    ramp = 0.2 + 0.73 * T
    y = drive({"tau_v": 0.05}, x_in=ramp)
    assert y[:, 1] == pytest.approx(0.73 * (1 - np.exp(-T / 0.05)), abs=1e-11)
    coarse = drive({"tau_v": 0.05}, x_in=ramp[::37], tau_out=TAU_OUT[::37], time=T[::37])
    assert coarse[:, 1] == pytest.approx(y[::37, 1], abs=1e-11)
    quotient = drive({"tau_v": 0.0})[1:, 1]
    assert quotient == pytest.approx(np.diff(X_IN) / np.diff(T), rel=1e-14)


def test_estimator_returns_the_distal_side_from_proximal_signals():
    values = UGLY | FRICTION
    y = drive(values)
    estimate = ESTIMATOR.simulate(ESTIMATOR.params(None, values), T, np.column_stack([X_IN, y[:, 2]]))
    assert (estimate[:, 0] == y[:, 0]).all()
    assert estimate[:, 1] == pytest.approx(TAU_OUT, abs=1e-14)


def test_estimator_has_the_parameters_of_the_drive():
    assert ESTIMATOR.parameters[:-1] == DRIVE.parameters
    assert ESTIMATOR.parameters[-1].name == "hold"
    assert [v.name for v in ESTIMATOR.inputs] == ["x_in", "tau_in"]
    assert [v.name for v in ESTIMATOR.outputs] == ["x_out", "tau_out"]


def test_friction_takes_energy_over_a_closed_cycle():
    dt = 1e-3
    t = np.arange(10001) * dt
    x = 0.37 * np.sin(2 * math.pi * 0.5 * t)
    y = drive(FRICTION, x_in=x, tau_out=0 * t, time=t)
    assert (y[4001:8001, 2] * np.diff(x)[4000:8000]).sum() > 4 * 0.37 * 2 * FRICTION["tau_c"] * 0.9


def test_drive_starts_at_rest_where_it_is():
    y = drive(UGLY | FRICTION, x_in=np.full(T.size, 0.83))
    assert (y[:, 0] == y[0, 0]).all()
    assert (y[:, 1] == 0.0).all()
    assert y[:, 2] == pytest.approx(0.923 * TAU_OUT, rel=1e-15)


@pytest.mark.parametrize(
    ("name", "value", "interval"),
    [("ratio", 0.0, r"\(0, inf\)"), ("tau_v", -0.01, r"\[0, inf\)"), ("tau_c", 0.0, r"\(0, inf\)")],
)
def test_parameters_that_cannot_be_solved_are_refused(name, value, interval):
    for model in (DRIVE, ESTIMATOR):
        with pytest.raises(InputError, match=rf"parameter {name} = {value} .* -- expected a value in {interval}"):
            model.params("published", {name: value})


def test_loss_of_passivity_is_said():
    assert DRIVE.warnings(DRIVE.params("published")) == ()
    p = DRIVE.params("published", {"sigma1": 0.9})
    (text,) = DRIVE.warnings(p)
    assert "below sigma1 (tau_s - tau_c)/tau_c = 0.4365 N.m.s/rad" in text
    assert ESTIMATOR.warnings(ESTIMATOR.params("published", {"sigma1": 0.9})) == (text,)
