"""A sensor that saturates is told from friction that levels off, from rests and from coarse converters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.conftest import exponential
from tsm_fmu.diagnosis.answer import limit as module
from tsm_fmu.diagnosis.answer.limit import limits_met, with_limits
from tsm_fmu.diagnosis.choice.floors import Floors
from tsm_fmu.diagnosis.criteria import LIMIT_EXCESS_RATIO, LIMIT_VISITS
from tsm_fmu.diagnosis.evidence import Limit
from tsm_fmu.diagnosis.fits.refit import Task, as_given, refit
from tsm_fmu.diagnosis.residual.limits import limits
from tsm_fmu.diagnosis.runs.prepared import prepared
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record

NOISE = 0.0031
SECONDS = (31.0, 17.0)


def met(change: Any, *, noise: float = NOISE, step: float = 0.0, rest: bool = False, periods: float = 1.0) -> dict:
    """Limits of a channel that a model makes as a sine and something slower, in two runs."""
    rng = np.random.default_rng(913)
    targets, residuals, places = [], [], list[Any]()
    for seconds in SECONDS:
        t = np.arange(int(seconds * 97.0)) / 97.0
        phase = periods * (1.9 * t + 0.4)
        model = np.sin(phase) + 0.3 * np.sin(0.37 * phase + 1.0)
        v = np.cos(phase)
        if rest:
            still = model > 0.8
            v = np.where(still, 0.0, v)
        y = change(model, v) + noise * rng.standard_normal(t.size)
        y = np.round(y / step) * step if step else y
        targets.append(y[:, None])
        residuals.append((y - model)[:, None])
        places.append(SimpleNamespace(time=t, v=v))
    return limits(("F",), targets, residuals, places)


@pytest.mark.parametrize(("sign", "level"), [(1.0, 0.71), (-1.0, 0.83)])
def test_an_end_that_is_cut_off_is_found_with_its_level_and_share(sign: float, level: float) -> None:
    found = met(lambda y, _: sign * np.minimum(sign * y, level))["F"]
    assert found.level == pytest.approx(sign * level, abs=NOISE)
    t = np.concatenate([np.arange(int(s * 97.0)) / 97.0 for s in SECONDS])
    model = np.sin(1.9 * t + 0.4) + 0.3 * np.sin(0.37 * (1.9 * t + 0.4) + 1.0)
    assert found.share == pytest.approx(np.mean(sign * model > level), abs=0.02)


@pytest.mark.parametrize(
    "options",
    [
        {"change": lambda y, _: y},
        {"change": lambda y, _: 0.8 * np.tanh(y / 0.8)},  # levels off, and moves on
        {"change": lambda y, _: y + 0.1 * np.abs(y)},
        {"change": lambda y, v: y + 0.3 * np.sign(v)},
        {"change": lambda y, _: np.minimum(y, 0.71), "noise": 0.15},  # within noise as wide as what is cut off
        {"change": lambda y, _: y, "step": 0.4},  # a converter stands at each of its levels
        {"change": lambda y, _: np.minimum(y, 0.8), "rest": True},  # a drive that rests there
        {"change": lambda y, _: np.minimum(y, 0.71), "periods": 0.03},  # once in a run
    ],
)  # fmt: skip
def test_what_is_no_limit_is_none(options: dict) -> None:
    assert met(**options) == {}


def test_nothing_beyond_a_limit() -> None:
    """A model that is too large in one place does not make a limit of it: elsewhere the channel goes on."""
    assert met(lambda y, v: np.where(v > 0.0, np.minimum(y, 0.71), y)) == {}
    assert LIMIT_VISITS > 1


@pytest.mark.parametrize(("gain", "limit"), [(0.97, True), (0.5, False)])
def test_a_model_that_is_off_everywhere_goes_on_beyond_no_limit(
    gain: float, limit: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Friction that levels off, in runs that a fit predicts badly, as some of others are."""
    one = met(lambda y, _: np.minimum(gain * y, gain * 0.83))
    assert (one["F"].excess > LIMIT_EXCESS_RATIO) is limit
    found = [({}, one), ({}, {"F": replace(one["F"], excess=0.3)})]
    monkeypatch.setattr(module, "_limits", lambda fit, *_: found[fit])
    fits: Any = (0, 1)
    for order in (fits, fits[::-1]):  # that of either fit will do
        assert limits_met(order, ()) == (one if limit else {})
    found = [(one, one), (one, one)]  # measured runs show it alone
    assert limits_met(fits, ()) == one


def chosen(effects: tuple[str, ...], acts: list[bool]) -> Any:
    fitted = SimpleNamespace(problem=SimpleNamespace(channels=("x_out", "tau_in")))
    winner = SimpleNamespace(effects=effects, acts=np.array(acts), fitted=fitted)
    none = np.zeros(2, bool)
    return _Selection(SimpleNamespace(winner=winner), Floors(np.ones(2), np.ones(2), None, none, none))


@dataclass(frozen=True)
class _Selection:
    choice: Any
    floors: Floors


@pytest.mark.parametrize(
    ("effects", "acts", "expected"),
    [((), [False, False], True), (("inertia",), [False, True], True), (("backlash@x_out",), [True, False], False)],
)
def test_names_are_withdrawn_from_a_channel_at_its_limit(
    effects: tuple[str, ...], acts: list[bool], expected: bool
) -> None:
    one = chosen(effects, acts)
    found = with_limits(one, {"tau_in": Limit(0.7, 0.1, 3.0)})
    assert found.floors.without_answer is expected
    assert found.floors.unexplained.tolist() == [False, expected]


def test_a_force_cell_that_saturates_is_said_and_nothing_is_named() -> None:
    records = []
    for number in range(3):
        rng, t = np.random.default_rng(400 + number), np.arange(2400) * 0.01
        x = 0.05 * np.sin(2.3 * t + 0.4 * number) + 0.03 * np.sin(5.9 * t + number)
        v = np.gradient(x, 0.01)
        force = np.minimum(0.7 * exponential(x, 0.0047) + 1.9 * v, 0.83) + 0.004 * rng.standard_normal(t.size)
        records.append(Record(f"run {number}", t, {"v": v, "F": force}, {"v": "m/s", "F": "N"}))
    given = {"F_c": 0.6, "F_s": 0.61, "v_s": 0.01, "sigma0": 150.0, "sigma1": 0.3, "sigma2": 1.7}
    found = diagnose(kernel("LuGreFriction"), records[:2], holdout=records[2:], values=given)
    assert (found.verdict, found.family) == ("unknown", ("sensor",))
    assert found.limits["F"].level == pytest.approx(0.83, abs=0.01)
    assert "F stands at 0.83 N" in found.answer


@pytest.mark.parametrize("clipped", [False, True])
def test_a_limit_that_only_the_motion_of_held_out_runs_reaches(clipped: bool) -> None:
    records = []
    for number, size in enumerate((0.3, 0.3, 1.0)):
        rng, t = np.random.default_rng(500 + number), np.arange(2400) * 0.01
        x = size * (0.05 * np.sin(2.3 * t + 0.4 * number) + 0.03 * np.sin(5.9 * t + number))
        v = np.gradient(x, 0.01)
        force = 0.7 * exponential(x, 0.0047) + 1.9 * v
        force = (np.minimum(force, 0.83) if clipped else force) + 0.004 * rng.standard_normal(t.size)
        records.append(Record(f"run {number}", t, {"v": v, "F": force}, {"v": "m/s", "F": "N"}))
    given = {"F_c": 0.7, "F_s": 0.71, "v_s": 0.01, "sigma0": 150.0, "sigma1": 0.0, "sigma2": 1.9}
    runs = prepared(kernel("LuGreFriction"), records[:2], (), records[2:], None)
    fits = [as_given(Task("LuGreFriction", runs.measured, runs.channels, given), ())]
    assert limits_met(fits, runs.measured) == {}
    found = limits_met(fits, runs.measured, runs.holdout)
    assert set(found) == ({"F"} if clipped else set())
    assert all(one.level == pytest.approx(0.83, abs=0.01) for one in found.values())


@pytest.mark.parametrize(("clipped", "said"), [(False, False), (True, True)])
def test_friction_that_levels_off_as_given_is_no_limit_of_a_sensor(clipped: bool, said: bool) -> None:
    """With play before it: a refit without the play bends to a long presliding, and goes on where the force stands."""
    model, records = kernel("LuGreFriction"), []
    for number in range(2):
        rng, t = np.random.default_rng(70 + number), np.arange(2400) * 0.01
        x = 0.05 * np.sin(2.3 * t + 0.4 * number) + 0.03 * np.sin(5.9 * t + number)
        played = x.copy()
        for k in range(1, x.size):
            played[k] = np.clip(played[k - 1], x[k] - 0.02, x[k] + 0.02)
        v, force = np.gradient(x, 0.01), 0.64 * exponential(played, 0.0047)
        if clipped:
            force = np.minimum(0.64 * exponential(x, 0.0047) + 1.9 * v, 0.81)
        force = force + 0.003 * rng.standard_normal(t.size)
        records.append(Record(f"run {number}", t, {"v": v, "F": force}, {"v": "m/s", "F": "N"}))
    given = {"F_c": 0.64, "F_s": 0.64, "v_s": 0.01, "sigma0": 130.0, "sigma1": 0.0, "sigma2": 1.9 * clipped}
    runs = prepared(model, records, (), (), None)
    task = Task("LuGreFriction", runs.measured, runs.channels, given)
    fits = [refit(task, (), {}), as_given(task, ())]
    assert "F" in limits_met(fits[:1], runs.measured)  # the refit alone would have it
    assert ("F" in limits_met(fits, runs.measured)) is said
