"""What an effect is worth beside parameters that do the same: nothing, however far the two have moved apart."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.conftest import exponential
from tsm_fmu.diagnosis.fits import takeover
from tsm_fmu.diagnosis.fits.nuisance import refit_without
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.fits.significance import significant_nuisances
from tsm_fmu.diagnosis.fits.takeover import without
from tsm_fmu.regression.problem import FitRun

OFFSET = "offset_drift@x_out"
GIVEN = {
    "c": 0.93, "beta": -0.41, "alpha": 9.0, "ratio": 1.0, "sigma0": 5.0, "sigma1": 0.0, "sigma2": 0.01,
    "tau_c": 0.1, "tau_s": 0.1, "v_s": 0.3, "tau_v": 0.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def drive() -> FitRun:
    """A run of a drive with a lost motion, zero and friction in closed form, as `DistalEstimator` sees it."""
    rng, t = np.random.default_rng(71), 0.01 * np.arange(1200)
    x = np.minimum(t / 0.5, 1.0) ** 2 * (0.8 * np.sin(1.1 * t + 0.4) + 0.4 * np.sin(2.9 * t))
    torque = 0.4 * np.sin(1.7 * t + 0.3)
    out = 0.97 * x - 0.23 * exponential(x, 0.11) + 0.052
    load = (torque - 0.104 * exponential(x, 0.019)) / 1.03
    targets = np.column_stack([out, load]) + rng.normal(size=(t.size, 2)) * [2e-3, 1e-3]
    return FitRun("run", t, np.column_stack([x, torque]), targets)


def apart(fitted: Fitted, by: float) -> Fitted:
    """The same fit with the offset so far up and the model's own zero so far down."""
    table = fitted.table.copy()
    for name, sign in (("x_out__offset_drift__b", 1.0), ("x_0", -1.0)):
        table[:, fitted.problem.fields.index(name)] += sign * by
    return replace(fitted, table=table)


@pytest.fixture(scope="module")
def beside(drive: FitRun) -> Fitted:
    task = Task("DistalEstimator", [drive], ("x_out", "tau_out"), GIVEN, fixed=("tau_v",))
    plain = refit(task, (), {})
    weighted = replace(task, weights=1.0 / plain.rmse)
    return refit(weighted, (OFFSET,), plain.values, fixed=["x_out.offset_drift.c"])


@pytest.mark.parametrize("by", [-0.83, 0.4])
def test_a_zero_takes_over_an_offset_wherever_both_are(beside: Fitted, by: float) -> None:
    fitted = apart(beside, by)
    np.testing.assert_allclose(fitted.rmse, beside.rmse, rtol=1e-9)  # the two are one freedom
    moved = without(fitted, OFFSET)
    values, per_run = moved.values, moved.per_run
    np.testing.assert_allclose(moved.rmse, beside.rmse, rtol=1e-2)  # known before any refit
    assert values["x_out.offset_drift.b"] == 0.0
    assert values["x_0"] == pytest.approx(fitted.values["x_0"] + fitted.values["x_out.offset_drift.b"], abs=2e-3)
    less = refit_without(fitted, OFFSET, [OFFSET], (values, per_run))
    np.testing.assert_allclose(less.rmse, beside.rmse, rtol=1e-3)


@pytest.mark.parametrize("by", [-0.83, 0.4])
def test_an_offset_beside_a_zero_of_the_model_is_no_effect(beside: Fitted, by: float) -> None:
    assert significant_nuisances(apart(beside, by), [OFFSET], [OFFSET]) == {}


@pytest.mark.filterwarnings("error")
def test_nothing_is_moved_beyond_all_numbers(beside: Fitted, monkeypatch: pytest.MonkeyPatch) -> None:
    """A parameter of next to no slope would have to go there: all stay where they are."""
    real, column = takeover.output_jacobian, beside.problem.space.free.index("x_0")

    def hardly(*given: Any) -> Any:
        slopes = real(*given)
        slopes[:, column] *= 1e-290
        return slopes

    monkeypatch.setattr(takeover, "output_jacobian", hardly)
    far = replace(beside, table=1e35 * beside.table)
    moved = without(far, OFFSET)
    off = [beside.problem.fields.index(name) for name in beside.problem.fields if "offset_drift" in name]
    kept = np.delete(moved.table, off, axis=1)
    assert np.array_equal(kept, np.delete(far.table, off, axis=1))
    assert (moved.table[:, off] == 0.0).all()
