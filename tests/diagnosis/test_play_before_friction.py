"""Play that the motion has before it comes to a friction: its response, that it is named, and that no spring is."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnosis.conftest import exponential
from tsm_fmu.diagnosis.fits.refit import Task, refit
from tsm_fmu.diagnosis.fits.response import Responses
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.problem import FitRun

DT, LEVEL, REACH, NOISE = 0.0103, 0.64, 0.0047, 0.0031
EXACT = {"F_c": LEVEL, "F_s": LEVEL, "v_s": 0.01, "sigma0": LEVEL / REACH, "sigma1": 0.0, "sigma2": 0.0}
ROUGH = {**EXACT, "F_c": 0.71, "F_s": 0.71, "sigma0": 310.0, "sigma2": 0.13}


def played(x: np.ndarray, w: float) -> np.ndarray:
    y = x.copy()
    for k in range(1, x.size):
        y[k] = min(max(y[k - 1], x[k] - w), x[k] + w)
    return y


def springs(x: np.ndarray) -> np.ndarray:
    """Springs that slip one after the other: a curve after reversals with corners, and no gap."""
    found = np.zeros(x.size)
    for reach, share in ((0.0011, 0.3), (0.0043, 0.45), (0.0126, 0.25)):
        f = 0.0
        for k in range(1, x.size):
            f = min(max(f + (x[k] - x[k - 1]) / reach, -1.0), 1.0)
            found[k] += share * f
    return found


def positions(t: np.ndarray, seed: int) -> np.ndarray:
    a, b = np.random.default_rng(seed).uniform(0.0, 6.0, 2)
    return 0.051 * np.sin(2.3 * t + a) + 0.029 * np.sin(5.9 * t + b)


@pytest.mark.parametrize("w", [0.0013, 0.0117])
def test_the_response_is_the_change_of_the_friction_along_what_play_leaves_of_the_way(w: float) -> None:
    model, t = kernel("LuGreFriction"), DT * np.arange(900)
    v = np.append(0.0, np.diff(positions(t, 3))) / DT
    force = LEVEL * exponential(positions(t, 3), REACH) + NOISE * np.random.default_rng(5).standard_normal(t.size)
    fitted = refit(Task("LuGreFriction", [FitRun("r", t, v[:, None], force[:, None])], ("F",), EXACT), (), EXACT)

    def friction(speed: np.ndarray) -> np.ndarray:
        return model.simulate(model.params(values=fitted.values), t, speed[:, None])[:, 0]

    left = played(np.cumsum(v) * DT, w)
    still = friction(v)
    expected = friction(np.append(0.0, np.diff(left)) / DT) - still
    acting = Responses(fitted, np.ones(1)).acting(attach(model, "backlash@v"))
    (found,) = acting.responses_to([{"w": w}])
    assert np.linalg.norm(found - expected) < 1e-9 * np.linalg.norm(expected)
    assert np.linalg.norm(expected) > 0.02 * np.linalg.norm(still)


def records(law, seed: int) -> list[Record]:
    """Three runs of friction along a way, as a log of its speed."""
    found = []
    for n in range(3):
        rng, t = np.random.default_rng(seed + n), DT * np.arange(2000)
        x = positions(t, seed + 10 * n)
        force = LEVEL * law(x) + NOISE * rng.standard_normal(t.size)
        columns = {"v": np.gradient(x, DT), "F": force}
        found.append(Record(f"r{n}", t, columns, {"v": "m/s", "F": "N"}))
    return found


@pytest.mark.parametrize("w", [0.0029, 0.0171])
def test_play_is_named_though_the_friction_has_another_law(w: float) -> None:
    *measured, held_out = records(lambda x: exponential(played(x, w), REACH), 71)
    found = diagnose(kernel("LuGreFriction"), measured, holdout=[held_out], values=ROUGH)
    assert found.verdict == "named"
    assert found.effects == ("backlash@v",)
    assert found.model.parameters["v.backlash.w"].value == pytest.approx(w, rel=0.05)
    assert "backlash before the friction" in found.answer


def test_springs_that_slip_one_after_the_other_are_no_play() -> None:
    *measured, held_out = records(springs, 83)
    found = diagnose(kernel("LuGreFriction"), measured, holdout=[held_out], values=ROUGH)
    assert not {"backlash@v", "smooth_backlash@v"} & set(found.effects), found.answer
