"""What is said of a better model: its steps in numbers, the zeros of the runs in closed form, and the words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.improvement import _gains_text, _zeros, _zeros_text, improvement_of
from tsm_fmu.diagnosis.choice.path import Stop
from tsm_fmu.diagnosis.fits.refit import Fitted, Task, as_given
from tsm_fmu.diagnosis.improved import ImprovementStep, RunZeros
from tsm_fmu.diagnosis.runs.prepared import PreparedRuns
from tsm_fmu.effects import words
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

MODEL = kernel("TendonDrive")
CHANNELS = ("x_out", "tau_in")
PLAIN = {
    "c": 0.9, "beta": -1e-12, "alpha": 9.3, "ratio": 1.03, "sigma0": 5.3, "sigma1": 0.0, "sigma2": 0.003,
    "tau_c": 1e-6, "tau_s": 1e-6, "v_s": 0.3, "tau_v": 0.0,
}  # fmt: skip
"""An angle that is 0.9 of the other and a zero; hardly any friction."""
ZEROS, LEVELS, SEEN = (0.31, -0.17, 0.05), (0.02, -0.011, 0.004), (0.2, 0.1, -0.06)
"""The zeros of the runs' angles, constants of their torques, and the zeros that the fit has."""
ANGLE, TORQUE = 0.0117, 0.0031
"""Size of a wiggle beside the zeros, of each sign as often."""


def run_of(name: str, zero: float, level: float, count: int = 400, seed: int = 1) -> FitRun:
    """Whose wiggle has no mean, neither in the first two seconds nor after."""
    t = 0.01 * np.arange(count)
    inputs = np.column_stack([0.7 * np.sin(2.1 * t + seed), 0.2 + 0.1 * np.cos(3.0 * t)])
    y = MODEL.simulate(MODEL.params(values={**PLAIN, "x_0": zero}), t, inputs)
    columns = [[v.name for v in MODEL.outputs].index(c) for c in CHANNELS]
    wiggle = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    return FitRun(name, t, inputs, y[:, columns] + np.column_stack([ANGLE * wiggle, level + TORQUE * wiggle]))


RUNS = tuple(run_of(f"r{k}", *of, seed=k) for k, of in enumerate(zip(ZEROS, LEVELS, strict=True)))


def prepared_runs(runs: Sequence[FitRun] = RUNS, holdout: Sequence[FitRun] = ()) -> PreparedRuns:
    return PreparedRuns(MODEL, CHANNELS, tuple(runs), (), tuple(holdout), (), ())


def fitted(runs: Sequence[FitRun] = RUNS, zeros: Sequence[float] = SEEN) -> Fitted:
    one = as_given(Task("TendonDrive", list(runs), CHANNELS, PLAIN), ())
    table = one.table.copy()
    for name in one.problem.per_run:
        table[:, one.problem.fields.index(name)] = 0.0
    table[:, one.problem.fields.index("x_0")] = zeros
    return replace(one, table=table)


def test_the_zero_of_a_run_is_that_beside_the_mean_of_the_fit() -> None:
    angle, torque = _zeros(fitted(), prepared_runs())
    assert angle is not None
    assert torque is not None
    assert (angle.channel, angle.unit, torque.channel, torque.unit) == ("x_out", "rad", "tau_in", "N.m")
    expected = [zero - np.mean(SEEN) for zero in ZEROS]
    assert angle.by_run == pytest.approx(dict(zip(("r0", "r1", "r2"), expected, strict=True)), abs=1e-6)
    assert torque.by_run == pytest.approx(dict(zip(("r0", "r1", "r2"), LEVELS, strict=True)), abs=1e-5)
    assert angle.scatter == pytest.approx(np.std(ZEROS, ddof=1), rel=1e-5)
    assert torque.scatter == pytest.approx(np.std(LEVELS, ddof=1), rel=1e-3)
    assert (angle.beside, torque.beside) == (pytest.approx(ANGLE, rel=1e-4), pytest.approx(TORQUE, rel=1e-3))
    assert (angle.holdout_common, angle.holdout_own) == (None, None)


@pytest.mark.parametrize(("share", "said"), [(0.048, False), (0.052, True)])
def test_zeros_are_said_from_a_twentieth_of_the_mean_square_on(share: float, said: bool) -> None:
    scatter = ANGLE * (share / (1.0 - share)) ** 0.5
    runs = [run_of(f"r{k}", 0.3 + scatter * x, 0.0) for k, x in enumerate((-1.0, 0.0, 1.0))]
    angle, torque = _zeros(fitted(runs, (0.3, 0.3, 0.3)), prepared_runs(runs))
    assert torque is None
    assert (angle is not None) is said


def test_a_held_out_run_is_judged_with_the_mean_zero_and_with_that_of_its_first_two_seconds() -> None:
    held = [run_of("h", 0.4, 0.013, 600), run_of("i", -0.2, 0.001, 400)]
    angle, torque = _zeros(fitted(), prepared_runs(holdout=held))
    assert angle is not None
    assert torque is not None
    off = np.array([0.4, -0.2]) - np.mean(SEEN)
    late = np.array([400.0, 200.0])  # samples that are scored
    common = np.sqrt(np.sum(late * (off**2 + ANGLE**2)) / late.sum())
    assert angle.holdout_common == pytest.approx(common, rel=1e-4)
    assert angle.holdout_own == pytest.approx(ANGLE, rel=1e-3)
    level = np.sqrt(np.sum(late * (np.array([0.013, 0.001]) ** 2 + TORQUE**2)) / late.sum())
    assert torque.holdout_common == pytest.approx(level, rel=1e-2)
    assert torque.holdout_own == pytest.approx(TORQUE, rel=1e-2)


def test_steps_have_the_errors_of_each_channel() -> None:
    start, held = fitted(), [run_of("h", 0.4, 0.013, 600)]
    better = fitted(zeros=ZEROS)
    way = [
        Stop("", start, (np.array([0.04, 0.01]), np.array([0.05, 0.03])), start.rmse),
        Stop("wear", better, (np.array([0.01, 0.0004]),) * 2, better.rmse),
    ]
    runs = prepared_runs(holdout=held)
    found = improvement_of(way, runs, (), (), "", 3)
    first, last = found.steps
    assert (first.added, last.added) == ("", "wear")
    mean_square = np.mean((np.array(ZEROS) - SEEN) ** 2)
    assert first.measured["x_out"] == pytest.approx(np.hypot(ANGLE, mean_square**0.5), rel=1e-4)
    assert last.measured["x_out"] == pytest.approx(ANGLE, rel=1e-4)
    assert first.left_out == pytest.approx({"x_out": 0.045**0.5, "tau_in": 0.02**0.5})
    assert last.left_out == pytest.approx({"x_out": 0.1, "tau_in": 0.02})
    assert last.holdout["x_out"] == pytest.approx(ANGLE, rel=1e-3)
    assert [z.channel for z in found.zeros] == ["x_out", "tau_in"]
    assert found.text.count("moves from run to run") == 2
    assert (found.effects, found.not_named) == ((), ())
    assert (found.model.model, found.model.provenance.seed) == ("TendonDrive", 3)
    assert improvement_of(way, prepared_runs(), (), (), "", 0).steps[1].holdout == {}


def step(added: str, left_out: float, holdout: float | None = None) -> ImprovementStep:
    sides = [{"x_out": left_out, "tau_in": 0.1 * left_out}, {} if holdout is None else {"tau_in": holdout}]
    return ImprovementStep(added, {"x_out": 1.0}, *sides)


def test_gains_are_told_on_held_out_runs_if_there_are_any() -> None:
    one = replace(fitted(), effects=("wear", "creep@x_out"))
    steps = [step("", 0.0349), step("wear", 0.02), step("without delay", 0.02), step("creep@x_out", 0.0087)]
    assert _gains_text(steps, one, ()) == (
        "For prediction: wear, creep@x_out; error on runs left out in turn: x_out 2 -> 0.498 deg, "
        "tau_in 3.49 -> 0.87 mN.m."
    )
    held = [step("", 0.3, 0.31), step("wear", 0.2, 0.0123)]
    assert _gains_text(held, one, ("wear", "creep@x_out")) == (
        "For prediction: wear; error on held-out runs: tau_in 0.31 -> 0.0123 N.m. "
        f"Useful, not named: {words('wear')}, {words('creep@x_out')}. They make runs that were not fitted come out "
        "better, which is no evidence that the rig has them."
    )
    left = [step(name, 2.0) for name in ("", "wear and delay", "hold = 1", "creep@x_out", "without wear")]
    without = replace(one, effects=("delay", "creep@x_out"))
    assert _gains_text(left, without, ()).startswith("For prediction: delay, hold = 1, creep@x_out; error")
    nothing = "For prediction: no effect makes runs that are left out of the fit come out better."
    assert _gains_text(steps[:1], one, ()) == nothing
    assert _gains_text([steps[0], steps[2]], one, ("wear",)) == nothing


def test_zeros_in_words() -> None:
    zeros = RunZeros("x_out", "rad", {"a": 0.1, "b": 0.2}, 0.03456, 0.00123)
    said = (
        "The zero of x_out moves from run to run by 2 deg (standard deviation over 2 runs: re-engagement, or slip); "
        "0.0705 deg remain beside it."
    )
    assert _zeros_text(zeros) == said
    assert _zeros_text(replace(zeros, holdout_common=0.05)) == said
    assert _zeros_text(replace(zeros, holdout_own=0.05)) == said
    assert _zeros_text(replace(zeros, holdout_common=0.05, holdout_own=0.002)) == (
        f"{said} A held-out run: 2.86 deg where its zero is not known, 0.115 deg with the zero of its first 2 s."
    )
    force = _zeros_text(RunZeros("F", "N", {"a": 0.1}, 0.09, 0.2))
    assert "by 90 mN (" in force
    assert "200 mN remain" in force
