"""Slow laws over several runs: each begins at a state of its own; one linear step that does not find it sees little."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from tests.diagnosis.conftest import exponential
from tsm_fmu.diagnosis.criteria import SHAPE_RANGE_RATIO
from tsm_fmu.diagnosis.fits.nuisance import refit_with
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, refit
from tsm_fmu.diagnosis.fits.response import public
from tsm_fmu.diagnosis.fits.screening import Screened, _Bench, _within, screen
from tsm_fmu.diagnosis.runs.prepared import prepared
from tsm_fmu.kernels.chain import attach
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.models.contract import Quantity

DT, ROWS, NOISE = 0.01, 2400, 0.004
GIVEN = {"F_c": 0.7, "F_s": 0.71, "v_s": 0.01, "sigma0": 150.0, "sigma1": 0.3, "sigma2": 0.1}
BEFORE = (1.7, 0.0, 3.1)
"""Runs of the travel of one that the drive has made before each: not in the order of the runs."""


def galled(travel: np.ndarray, _: np.ndarray) -> np.ndarray:
    return 1.0 + 0.055 * travel


def logarithmic(travel: np.ndarray, _: np.ndarray) -> np.ndarray:
    return 1.0 + 0.061 * np.log1p(4.1 * travel)


def warm(travel: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Of a drive that always moves: warmth by the time, with what each run has of it as it begins."""
    return 0.8 + 0.5 * np.exp(-(time / 17.0 + 0.45 * travel[0]))


def unchanged(travel: np.ndarray, _: np.ndarray) -> np.ndarray:
    return np.ones_like(travel)


def rig(number: int, level: Callable[[np.ndarray, np.ndarray], np.ndarray], before: Sequence[float] = BEFORE) -> Record:
    """Bristles of an exponential law, whose level changes slowly; the travel in runs of this length."""
    rng, t = np.random.default_rng(900 + number), np.arange(ROWS) * DT
    x = 0.05 * np.sin(2.3 * t + 0.4 * number) + 0.03 * np.sin(5.9 * t + number)
    v, z = np.gradient(x, DT), exponential(x, 0.0047)
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))]) / 2.9
    force = 0.7 * z * level(before[number] + travel, t) + 0.1 * v + NOISE * rng.normal(size=ROWS)
    return Record(f"run {number}", t, {"v": v, "F": force}, {"v": "m/s", "F": "N"})


def fitted(
    level: Callable[[np.ndarray, np.ndarray], np.ndarray], numbers: range = range(3), before: Sequence[float] = BEFORE
) -> Fitted:
    runs = prepared(kernel("LuGreFriction"), [rig(k, level, before) for k in numbers], (), (), None)
    return refit(Task("LuGreFriction", runs.measured, runs.channels, GIVEN), (), {})


def screened(base: Fitted, spec: str) -> Screened:
    return screen(base, [attach(kernel("LuGreFriction"), spec)])[0]


LAWS = [("wear", "X_0", galled), ("wear", "X_0", logarithmic), ("thermal", "h_0", warm)]


@pytest.mark.parametrize(("spec", "state", "level"), LAWS)
def test_the_state_of_each_run_is_in_the_linear_step(spec: str, state: str, level: Callable) -> None:
    """Most of what a refit gains, which ends at what the model leaves of friction that does not change."""
    base = fitted(level)
    seen = screened(base, spec)
    found = refit_with(base, seen, ())
    gained = 2.0 * np.log(base.rmse[0] / found.rmse[0])
    assert gained > 2.0
    assert seen.gain > 0.6 * gained
    states = seen.starts[0][1][f"{spec}.{state}"]
    assert states.shape == (3,)
    assert list(np.argsort(states)) in ([1, 0, 2], [2, 0, 1])  # friction that falls and rises may be told either way
    order = list(np.argsort(found.per_run[f"{spec}.{state}"]))
    assert order in ([1, 0, 2], [2, 0, 1])
    same = seen.starts[1]
    assert np.ptp(same[1][f"{spec}.{state}"]) == 0.0
    assert found.rmse[0] < 1.2 * fitted(unchanged).rmse[0]


def run_in(travel: np.ndarray, _: np.ndarray) -> np.ndarray:
    """Not the exponential of our law: what is run in goes faster at first and slower then."""
    return 0.6 + 1.4 / (1.0 + (0.9 * travel) ** 1.4)


def test_friction_that_falls_from_run_to_run_is_not_taken_for_one_that_rises() -> None:
    """With other states of each run it could: the new drive then begins where one does that has travelled far."""
    before = (0.0, 2.3, 4.7, 1.9, 2.7, 5.1)
    base = fitted(run_in, range(6), before)
    found = refit_with(base, screened(base, "wear"), ())
    assert int(np.argmin(found.per_run["wear.X_0"])) == 0
    assert found.values["wear.d"] > 0.3
    assert found.rmse[0] < 1.5 * fitted(unchanged, range(6), 6 * [0.0]).rmse[0]


def test_one_run_begins_where_nothing_was_before() -> None:
    """Of one run the size of an exponential law does what a travel before it would."""
    base = fitted(lambda travel, _: 1.0 + 0.4 * np.exp(-(travel - travel[0]) / 0.37), range(1))
    seen = screened(base, "wear")
    for place in seen.starts[:2]:
        assert place[1]["wear.X_0"] == pytest.approx([0.0])


def test_one_size_of_one_sign_is_begun_from_where_it_alone_does_much() -> None:
    seen = screened(fitted(galled), "wear")
    assert seen.alone
    for values, states in seen.alone:
        assert sum(values[f"wear.{size}"] != 0.0 for size in ("d", "r")) == 1
        assert states["wear.X_0"].shape == (3,)
    assert not screened(fitted(unchanged), "wear").alone, "nothing to explain"
    assert not screened(fitted(galled, range(1)), "wear").alone, "of one run the state is no other one's"


def test_a_linear_step_beyond_a_bound_begins_half_of_the_way_to_it() -> None:
    """At -1.4 of a size that may be -0.9 no chain would run, and the place was lost."""
    bounds = Quantity("1", "a size", lo=-0.9, hi=3.0)
    assert [_within(one, bounds) for one in (-1.4, -0.89, 0.0, 2.9, 3.1)] == [-0.45, -0.89, 0.0, 2.9, 1.5]


def test_states_of_other_runs_are_not_taken_over() -> None:
    """A reference run has one of its own: what candidates gain there is asked with starts of the measured runs."""
    seen = screened(fitted(galled), "wear")
    other = fitted(unchanged, range(1))
    found = refit_with(other, seen, ())
    assert found.per_run["wear.X_0"].shape == (1,)
    assert found.rmse[0] <= 1.01 * other.rmse[0]


def test_states_are_declared_in_the_scale_of_the_runs() -> None:
    base = fitted(galled)
    bench = _Bench(base)
    one = attach(kernel("LuGreFriction"), "wear")
    travel = max(float(np.sum(np.abs(np.diff(c.x)))) for c in bench.responses.signals)
    assert [s["X_0"] for s in bench.responses.extent.starts(one.module)] == pytest.approx(
        [share * travel for share in (0.0, 0.1, 0.3, 1.0, 3.0)]
    )
    assert bench.responses.extent.starts(attach(kernel("LuGreFriction"), "inertia").module) == [{}]
    limits = bench.responses.limits(bench.responses.acting(one))
    assert limits["wear.X_0"] == pytest.approx((0.0, 3.0 * travel * SHAPE_RANGE_RATIO))
    assert public(one, "X_0") == "wear.X_0"
