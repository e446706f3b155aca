"""What stands at a limit of its range is said of the answer too, not of the baseline alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.parameters import bound_notes
from tsm_fmu.diagnosis.fits.quantised import Levels, with_levels
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.regression.problem import FitRun

Rig = Callable[..., FitRun]


@pytest.fixture(scope="module")
def run(rig: Rig) -> FitRun:
    """A spring about x = -0.53 m beside the friction."""
    plain = rig(31)
    x = np.cumsum(plain.inputs[:, 0]) * np.gradient(plain.time)
    return replace(plain, targets=plain.targets + (0.31 * (x + 0.53) + 0.9 * (x + 0.53) ** 3)[:, None])


def fitted(run: FitRun, known: dict[str, float], effects: tuple[str, ...], limits: tuple[float, float]) -> Fitted:
    task = Task("LuGreFriction", [run], ("F",), known, limits={"stiffness_hardening.x_c": limits})
    return refit(task, effects, {"stiffness_hardening.k_1": 0.2, "stiffness_hardening.k_3": 0.5})


def test_a_centre_outside_its_range_is_said_and_one_within_is_not(run: FitRun, known: dict[str, float]) -> None:
    base = fitted(run, known, (), (0.0, 0.5))
    stopped = fitted(run, known, ("stiffness_hardening",), (0.0, 0.5))
    assert any(
        "the answer's fit stopped at a bound of stiffness_hardening.x_c" in n for n in bound_notes(base, stopped)
    )
    free = fitted(run, known, ("stiffness_hardening",), (-2.0, 0.5))
    assert free.values["stiffness_hardening.x_c"] == pytest.approx(-0.53, abs=0.05)
    assert not any("x_c" in note for note in bound_notes(base, free))
    coarse = with_levels(stopped, [Levels("F", 0.01, 0.0)])
    assert any("stiffness_hardening.x_c" in note for note in bound_notes(base, coarse))


def test_a_size_at_zero_is_no_limit(rig: Rig, known: dict[str, float]) -> None:
    """Less mass than none would fit better."""
    task = Task("LuGreFriction", [rig(32, inertia=-0.02)], ("F",), known)
    base, heavy = refit(task, (), {}), refit(task, ("inertia",), {"inertia.m": 0.01})
    assert heavy.values["inertia.m"] == pytest.approx(0.0, abs=1e-6)
    assert not any("inertia" in note for note in bound_notes(base, heavy))
