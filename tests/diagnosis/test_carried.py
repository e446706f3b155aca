"""Held-out runs: values move there within what their own runs leave open, and what that costs is left over."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tsm_fmu.diagnosis.fits.carried import STEPS, CarriedOver, carried_over, pooled
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.models.contract import InputError
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.residuals import rms

Rig = Callable[..., FitRun]
NOISE = 0.004


@pytest.fixture(scope="module")
def slow(rig: Rig, known: dict[str, float]) -> Fitted:
    """Of runs so slow that they hardly show what is viscous."""
    return refit(Task("LuGreFriction", [rig(91, pace=0.02), rig(92, pace=0.03)], ("F",), known), (), {})


def test_what_the_fitted_runs_leave_open_is_no_gap(slow: Fitted, rig: Rig) -> None:
    held = [rig(93), rig(94, pace=1.2)]
    before, after = rms(slow.held_out_errors(held))[0], np.sqrt(carried_over(slow, held).mean_square[0])
    assert before > 3.0 * NOISE
    assert after < 1.6 * NOISE


def test_more_steps_of_the_move_leave_no_less(rig: Rig, known: dict[str, float]) -> None:
    """A friction that was fitted far from the speed of the held-out runs has a long way to go."""
    slow = refit(Task("LuGreFriction", [rig(91, pace=0.05)], ("F",), {**known, "F_s": 10.0 * known["F_s"]}), (), {})
    held = [rig(93), rig(94, pace=1.2)]
    found, end = (carried_over(slow, held, steps).mean_square[0] for steps in (STEPS, 300))
    assert end <= found <= 1.01 * end


def test_what_no_values_give_stays(slow: Fitted, rig: Rig) -> None:
    """A mass that the model lacks."""
    held = [rig(95, inertia=0.06), rig(96, inertia=0.06)]
    force = rms([0.06 * np.gradient(run.inputs, run.time, axis=0) for run in held])[0]
    assert np.sqrt(carried_over(slow, held).mean_square[0]) > 0.6 * force


def test_what_the_move_costs_on_the_fitted_runs_counts(rig: Rig, known: dict[str, float]) -> None:
    """Runs of two rigs, of which no values serve both: what is left is no less than that of a fit to all."""
    ours, others = [rig(97), rig(98)], [scaled(rig(99), 1.4), scaled(rig(90), 1.4)]
    fitted = refit(Task("LuGreFriction", ours, ("F",), known), (), {})
    both = refit(Task("LuGreFriction", [*ours, *others], ("F",), known), (), {})
    found = carried_over(fitted, others).mean_square[0]
    on_ours, on_others = rms(both.residuals[:2])[0] ** 2, rms(both.residuals[2:])[0] ** 2
    assert found == pytest.approx(on_ours + on_others - fitted.rmse[0] ** 2, rel=0.1)
    assert found < rms(fitted.held_out_errors(others))[0] ** 2


def test_a_fit_is_looked_at_on_runs_that_it_was_not_fitted_to(slow: Fitted, rig: Rig) -> None:
    held = [rig(93), rig(94, pace=1.2)]
    for there, late in zip(slow.on(held).residuals, slow.held_out_errors(held), strict=True):
        assert there.shape[0] > late.shape[0]
        np.testing.assert_array_equal(there[-late.shape[0] :], late)


def scaled(run: FitRun, factor: float) -> FitRun:
    return FitRun(run.name, run.time, run.inputs, factor * run.targets)


def test_a_good_fit_is_hardly_moved(rig: Rig, known: dict[str, float]) -> None:
    fitted = refit(Task("LuGreFriction", [rig(81), rig(82)], ("F",), known), (), {})
    held = [rig(83)]
    found = carried_over(fitted, held)
    assert np.sqrt(found.mean_square[0]) == pytest.approx(rms(fitted.held_out_errors(held))[0], rel=0.05)
    assert found.samples == 1800  # 20 s without the first 2 s
    assert 4.0 <= found.effective[0] <= 1800


def test_parts_are_pooled_by_their_samples() -> None:
    parts = [CarriedOver(np.array([4.0]), np.array([50.0]), 100), CarriedOver(np.array([1.0]), np.array([70.0]), 300)]
    found = pooled(parts)
    assert (found.mean_square[0], found.effective[0], found.samples) == (1.75, 120.0, 400)


def test_a_short_run_is_refused(slow: Fitted, rig: Rig) -> None:
    with pytest.raises(InputError, match=r"held-out run run93 of 0.99 s -- expected more than the 2 s"):
        carried_over(slow, [rig(93, rows=100)])
