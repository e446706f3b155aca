"""A zero that wanders is told from laws, from noise and from a motion as slow as it is; laws beside it are found."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tests.diagnosis.conftest import exponential
from tsm_fmu.diagnosis.answer import wander as module
from tsm_fmu.diagnosis.answer.candidates import steps_of
from tsm_fmu.diagnosis.answer.wander import explained_by_zeros, offsets_of, with_free_zeros, zeros_that_wander
from tsm_fmu.diagnosis.choice.floors import Floors
from tsm_fmu.diagnosis.choice.selection import Selection
from tsm_fmu.diagnosis.criteria import WANDERING_SPREAD_SHARE
from tsm_fmu.diagnosis.evidence import Wander
from tsm_fmu.diagnosis.report.write import write_diagnosis
from tsm_fmu.diagnosis.residual.wander import slow_with_nothing, wandering_zeros
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates
from tsm_fmu.diagnosis.runs.prepared import PreparedRuns
from tsm_fmu.diagnosis.workflow import diagnose
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.problem import FitRun

SPREAD, NOISE = 0.7, 0.004
SECONDS = (31.0, 23.0, 37.0)
Error = Callable[[Any, int], np.ndarray]


def wander(t: np.ndarray, number: int, size: float = 0.09) -> np.ndarray:
    """A random walk through two first-order lags of 2.3 s, of this RMS: no sum of a few cosines."""
    y = np.cumsum(np.random.default_rng(600 + number).standard_normal(t.size))
    step = t[1] - t[0]
    for _ in range(2):
        low = np.empty(t.size)
        low[0] = y[0]
        for k in range(1, t.size):
            low[k] = low[k - 1] + (y[k] - low[k - 1]) * step / 2.3
        y = low
    return size * (y - y.mean()) / y.std()


def places(slow: Sequence[bool] = (False, False, False)) -> list[Coordinates]:
    found = []
    for k, (seconds, is_slow) in enumerate(zip(SECONDS, slow, strict=True)):
        t = np.arange(int(seconds * 53.0)) / 53.0
        pace = 0.13 if is_slow else 3.7
        x = 0.31 * np.sin(pace * t + k) + 0.12 * np.sin(2.3 * pace * t)
        v, zero = np.gradient(x, t), 0.0 * t
        side = np.sign(v)
        found.append(Coordinates(x, v, np.gradient(v, t), side, side, zero, np.abs(x - x[0]), zero, None, t))
    return found


def left_by(error: Error, where: Sequence[Coordinates], noise: float = NOISE) -> list[np.ndarray]:
    rng = np.random.default_rng(601)
    return [(error(p, k) + noise * rng.standard_normal(p.time.size))[:, None] for k, p in enumerate(where)]


def wandering(error: Error, slow: Sequence[bool] = (False, False, False), noise: float = NOISE) -> dict[str, Wander]:
    where = places(slow)
    return wandering_zeros(("F",), left_by(error, where, noise), where, np.array([SPREAD]), ("m", "N"))


@pytest.mark.parametrize("size", [0.02, 0.09])
def test_a_zero_that_wanders_is_found_with_its_size(size: float) -> None:
    found = wandering(lambda p, k: 0.3 * k + wander(p.time, k, size))["F"]
    assert found.rms == pytest.approx(size, rel=0.15)
    assert 5.0 < found.period < 2.0 * min(SECONDS)


@pytest.mark.parametrize(
    "error",
    [
        lambda p, _: 0.0 * p.time,
        lambda p, _: 0.1 * p.x,  # laws of the motion
        lambda p, _: 0.1 * np.sign(p.v),
        lambda p, _: 0.1 * np.cos(9.0 * p.x),
        lambda p, _: 0.1 * np.exp(-p.time / 9.0),  # of the time, alike in all runs
        lambda p, k: wander(p.time, k, 0.5 * WANDERING_SPREAD_SHARE * SPREAD),
        lambda p, k: wander(p.time, k) * np.sign(p.v),  # of a friction, not of a zero
        lambda p, k: wander(p.time, k) if k else 0.03 * np.sign(p.v),  # in some of the runs
        lambda p, k: wander(p.time, k, 0.03) + 0.1 * np.sin(11.0 * p.time + k),
    ],
)
def test_what_else_a_model_may_leave_is_no_zero_that_wanders(error: Error) -> None:
    assert wandering(error) == {}


def test_noise_of_an_instrument_does_not_wander() -> None:
    assert wandering(lambda p, _: 0.0 * p.time, noise=0.2) == {}


def test_a_motion_as_slow_as_the_zero_says_nothing_of_it() -> None:
    def error(p: Any, k: int) -> np.ndarray:
        return wander(p.time, k)

    assert wandering(error, (True, True, True)) == {}
    assert "F" in wandering(error, (False, True, False))


@pytest.mark.parametrize("slow", [(False, False, False), (True, False, True), (True, True, True)])
def test_what_moves_slowly_and_with_nothing_is_so_however_slow_the_motion_is(slow: Sequence[bool]) -> None:
    where = places(slow)
    (share,) = slow_with_nothing(left_by(lambda p, k: wander(p.time, k), where), where, ("m", "N"))
    assert 0.7 < share < 1.0
    laws: list[Error] = [lambda p, _: 0.1 * p.x, lambda p, _: 0.1 * np.sign(p.v), lambda p, _: 0.0 * p.time]
    for law in laws:
        assert slow_with_nothing(left_by(law, where), where, ("m", "N")) == 0.0


def test_runs_are_compared_but_for_the_zeros_that_wander() -> None:
    t = np.linspace(0.0, 9.0, 301)
    runs = [FitRun(f"r{k}", t, t[:, None], np.column_stack([t, np.cos(k + t)])) for k in range(3)]
    before = PreparedRuns(
        kernel("TendonDrive"), ("x_out", "tau_in"), (runs[0],), (runs[1],), (runs[2],), (None, None, None), ()
    )
    found = with_free_zeros(before, {"tau_in"})
    assert [g[0].slow_zero.channels for g in (found.measured, found.holdout, found.reference)] == [(1,)] * 3
    assert [g[0].slow_zero.constant for g in (found.measured, found.holdout, found.reference)] == [False, True, False]
    assert before.measured[0].slow_zero is None
    assert offsets_of(["tau_in"]) == ["offset_drift@tau_in"]


def chosen(
    effects: tuple[str, ...], left: tuple[float, float], unexplained: tuple[bool, bool], *, answer: bool = True
) -> Any:
    """A selection whose winner leaves so much of two channels of which the model itself leaves 1 and 1."""
    problem = SimpleNamespace(channels=("x_out", "tau_in"))
    residuals = [0.01 * np.random.default_rng(9).standard_normal((99, 2))]
    fitted = SimpleNamespace(problem=problem, residuals=residuals, rmse=np.array(left))
    winner = SimpleNamespace(effects=effects, fitted=fitted, measured=np.array(left) ** 2, held_out=None)
    refitted = SimpleNamespace(measured=np.ones(2), held_out=None)
    floors = Floors(np.zeros(2), np.zeros(2), None, np.array(unexplained), np.array(unexplained), in_part=answer)
    baselines: Any = SimpleNamespace(refitted=refitted, reference=None, joint=None)
    return Selection(baselines, (), SimpleNamespace(winner=winner), floors)  # pyright: ignore[reportArgumentType]


PLAIN = chosen((), (1.0, 1.0), (False, True), answer=False)


@pytest.mark.parametrize(
    ("left", "unexplained", "still"),
    [
        ((1.0, 0.9), (False, False), (False, False)),  # what is left is no law, and does not wander
        ((1.0, 0.3), (False, True), (False, False)),  # a tenth of the mean square: the zero moves a little faster
        ((1.0, 0.9), (False, True), None),
        ((0.3, 0.3), (True, True), (True, False)),  # the other channel is not theirs
    ],
)
def test_zeros_that_are_free_must_explain_their_channels(left: Any, unexplained: Any, still: Any) -> None:
    found = explained_by_zeros(chosen(("creep",), left, unexplained), PLAIN, {"tau_in"})
    assert (found is None) == (still is None)
    if found:
        assert found.floors.unexplained.tolist() == list(still)


@pytest.mark.parametrize(
    ("before", "after", "kept"),
    [
        ((), ("creep",), True),
        (("offset_drift@tau_in",), (), True),  # a drift is a zero that moves too
        (("creep", "offset_drift@tau_in"), ("creep",), True),
        (("creep",), ("wear",), False),
        (("offset_drift@x_out",), (), False),
    ],
)
def test_what_was_named_is_named_beside_zeros_that_wander(before: Any, after: Any, kept: bool) -> None:
    named = chosen(before, (1.0, 0.5), (False, False))
    free = chosen(after, (1.0, 0.1), (False, False))
    assert (explained_by_zeros(free, named, {"tau_in"}) is not None) == kept
    taken_away = chosen(before, (1.0, 0.5), (False, True), answer=False)
    assert explained_by_zeros(free, taken_away, {"tau_in"}) is not None, "nothing was named"


@pytest.mark.parametrize(("hides", "answer", "found"), [(False, True, True), (True, False, True), (True, True, False)])
def test_without_an_answer_a_zero_is_looked_for_behind_a_law_with_a_memory_too(
    monkeypatch: pytest.MonkeyPatch, hides: bool, answer: bool, found: bool
) -> None:
    """Such a law follows part of a zero; one that is named is not asked what the model leaves without it."""
    where = places()
    whole = left_by(lambda p, k: wander(p.time, k), where)
    less = left_by(lambda p, k: wander(p.time, k) * np.sign(p.v), where) if hides else whole
    monkeypatch.setattr(module, "places_of", lambda _: where)
    monkeypatch.setattr(module, "coordinate_units", lambda _: ("m", "N"))

    def leaving(residuals: list[np.ndarray]) -> Any:
        fitted = SimpleNamespace(
            residuals=residuals, spread=np.array([SPREAD]), problem=SimpleNamespace(kernel=None), at=lambda _: fitted
        )
        return SimpleNamespace(fitted=fitted, added=("creep",))

    still = np.array([not answer])
    floors = Floors(np.zeros(1), np.zeros(1), None, np.array([True]), still, in_part=answer)
    baselines: Any = SimpleNamespace(with_nuisances=leaving(whole))
    choice: Any = SimpleNamespace(best=leaving(less))
    zeros = zeros_that_wander(
        Selection(baselines, (), choice, floors), cast("Any", SimpleNamespace(channels=("F",), measured=()))
    )
    assert list(zeros) == (["F"] if found else [])


def test_steps_to_an_answer_begin_with_the_zeros_that_wander() -> None:
    start = {"F": (0.3, 0.4)}

    def fit(added: tuple[str, ...], rmse: float, held_out: float) -> Any:
        fitted = SimpleNamespace(rmse=np.array([rmse]), residuals=[np.full((9, 1), rmse)], spread=np.ones(1))
        fitted.at = lambda _: fitted
        return SimpleNamespace(
            added=added, fitted=fitted, measured=np.array([rmse**2]), held_out=np.array([held_out]),
            effective=np.array([90.0]), effective_held_out=np.array([90.0]),
        )  # fmt: skip

    plain = fit((), 0.3, 0.16)
    fits = [plain, fit(("creep",), 0.2, 0.09), fit(("wear",), 0.1, 0.04), fit(("wear", "creep"), 0.05, 0.01)]
    run: Any = object()
    named = ("wear", "creep", "offset_drift@F")
    zero, first = steps_of(fits, named, start, plain, [run], ["offset_drift@F"])
    assert zero.effects == ("offset_drift@F",)
    assert (zero.measured["F"], zero.holdout["F"]) == (pytest.approx(0.3), pytest.approx(0.4))
    assert first.effects == ("offset_drift@F", "wear")
    assert (first.measured["F"], first.holdout["F"]) == (pytest.approx(0.1), pytest.approx(0.2))
    assert steps_of(fits, ("offset_drift@F",), start, plain, [run], ["offset_drift@F"]) == ()


def rig(number: int, size: float, mass: float = 0.0) -> Record:
    """Bristles of an exponential law and a mass, and a force cell whose zero wanders."""
    rng, t = np.random.default_rng(640 + number), np.arange(5200) * 0.006
    phase = 3.1 * t + 0.9 * number
    x = 0.031 * np.sin(phase) + 0.012 * np.sin(2.7 * phase + 1.0)
    v = np.diff(x, prepend=x[0]) / 0.006  # of the step that ends there: its sum is the position
    force = (
        0.7 * exponential(x, 0.0047)
        + 0.1 * v
        + mass * np.gradient(v, t)
        + wander(t, number, size)
        + 0.004 * rng.standard_normal(t.size)
    )
    return Record(f"run {number}", t, {"v": v, "F": force}, {"v": "m/s", "F": "N"})


VALUES = {"F_c": 0.7, "F_s": 0.71, "v_s": 0.01, "sigma0": 150.0, "sigma1": 0.3, "sigma2": 0.1}


def test_a_zero_that_wanders_alone_is_named_and_said(tmp_path: Path) -> None:
    model, runs = kernel("LuGreFriction"), [rig(k, 0.11) for k in range(3)]
    found = diagnose(model, runs[:2], holdout=runs[2:], values=VALUES)
    assert (found.verdict, found.effects, found.family) == ("named", ("offset_drift@F",), ("time",))
    assert found.wanders["F"].rms == pytest.approx(0.11, rel=0.2)
    assert "The zero of F wanders within each run (" in found.answer
    gap = found.gap["F"]
    assert gap.refitted > 0.1
    assert max(gap.after, gap.holdout_after or np.inf) < 0.03
    assert found.model is not None
    assert "offset_drift@F" in found.model.effects
    paths = write_diagnosis(tmp_path, found)  # the FMU gives what was simulated
    data = json.loads((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    assert data["wanders"]["F"]["rms"] == found.wanders["F"].rms
    assert data["effects"] == ["offset_drift"]
    assert paths


def test_a_zero_that_wanders_hides_no_mass() -> None:
    model, runs = kernel("LuGreFriction"), [rig(k, 0.13, 0.043) for k in range(3)]
    found = diagnose(model, runs[:2], holdout=runs[2:], values=VALUES)
    assert found.verdict == "named"
    assert set(found.effects) == {"inertia", "offset_drift@F"}
    assert found.model is not None
    assert found.model.parameters["inertia.m"].value == pytest.approx(0.043, rel=0.1)
    assert found.gap["F"].holdout_after == pytest.approx(found.gap["F"].after, rel=0.5)
    assert [step.effects for step in found.steps] == [("offset_drift@F",)]
    left = found.steps[0].measured["F"]
    assert found.gap["F"].after < left < found.gap["F"].refitted
