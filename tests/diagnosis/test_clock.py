"""A channel whose clock runs slow is told from a lag, an offset, a ratio and noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis.answer.clock import clock_notes, clock_runs_slow, slow_clocks
from tsm_fmu.regression.problem import FitRun

CHANNELS = ("x_out", "tau_in")


def motion(t: np.ndarray) -> np.ndarray:
    return 0.7 * np.sin(1.9 * t + 0.3) + 0.23 * np.sin(6.7 * t) + 0.02 * t


def fitted(errors: Any, lead: int = 0, noise: float = 0.002) -> Any:
    """A fit that knows the motion, of two runs whose first channel is off by ``errors`` of the time, each from zero."""
    rng, runs, residuals = np.random.default_rng(67), [], []
    for seconds, rate in ((31.0, 83.0), (17.0, 141.0)):
        t = np.arange(int(seconds * rate)) / rate
        own = np.stack([motion(t), np.cos(t)], axis=1)
        error = np.stack([errors(t), np.zeros_like(t)], axis=1) + noise * rng.standard_normal((t.size, 2))
        run = FitRun("r", t, t[:, None], own + error).compared_from(lead)
        runs.append(run)
        residuals.append(error[lead:])
    return SimpleNamespace(
        problem=SimpleNamespace(channels=CHANNELS, runs=runs), residuals=residuals, spread=np.array([0.5, 0.7])
    )  # fmt: skip


@pytest.mark.parametrize("rate", [1.3e-3, -0.9e-3])
@pytest.mark.parametrize(("late", "lead"), [(0.0, 0), (0.021, 170)])
def test_a_clock_that_runs_slow_is_found_with_its_rate(rate: float, late: float, lead: int) -> None:
    one = fitted(lambda t: motion(t - rate * t - late) - motion(t), lead)
    assert slow_clocks(one) == {"x_out": pytest.approx(rate, rel=0.06)}
    (said,) = clock_notes(one)
    when = "later" if rate > 0.0 else "earlier"
    assert said.startswith(
        f"x_out comes {when} by {1e3 * abs(slow_clocks(one)['x_out']):.2g} ms in each second of a run"
    )


@pytest.mark.parametrize(
    ("rate", "noise", "found"), [(1.4e-4, 6e-4, True), (1.4e-4, 2.4e-3, False), (1.2e-4, 6e-4, False)]
)
def test_a_slow_clock_may_make_little(rate: float, noise: float, found: bool) -> None:
    """0.3 % of the spread, and what noise and constant lags do not make."""
    assert bool(slow_clocks(fitted(lambda t: motion(t - rate * t) - motion(t), noise=noise))) is found


@pytest.mark.parametrize(
    "errors",
    [
        lambda t: motion(t - 0.03) - motion(t), lambda t: 0.003 * t, lambda t: 0.08 * motion(t),
        lambda t: 0.05 * np.tanh(9.0 * np.gradient(motion(t), t)), lambda t: 0.0 * t, lambda t: 0.03 * np.sin(0.2 * t),
        lambda t: 0.003 * t * np.sign(np.gradient(motion(t), t)),
    ],
    ids=["delay", "drift", "ratio", "friction", "noise", "wander", "lost motion that grows"],
)  # fmt: skip
def test_what_else_a_channel_may_have_is_no_slow_clock(errors: Any) -> None:
    assert slow_clocks(fitted(errors)) == {}
    assert list(clock_notes(fitted(errors))) == []


def test_what_is_not_compared_says_nothing_of_the_clock() -> None:
    one = fitted(lambda t: motion(t - 4.1e-3 * t) - motion(t))
    for residual in one.residuals:
        residual[residual.shape[0] // 3 :] = 0.0
    assert slow_clocks(one)["x_out"] == pytest.approx(4.1e-3, rel=0.1)


@pytest.mark.parametrize(
    ("effects", "contradicted"),
    [
        (("delay@x_out",), True), (("sensor_lag@x_out",), True), (("wear", "delay@x_out"), True),
        (("delay@tau_in",), False), (("gain_error@x_out",), False), (("offset_drift@x_out",), False), ((), True),
    ],
)  # fmt: skip
def test_neither_a_lag_of_that_channel_nor_nothing_is_an_answer(effects: tuple[str, ...], contradicted: bool) -> None:
    one = SimpleNamespace(effects=effects, fitted=fitted(lambda t: motion(t - 1.3e-3 * t) - motion(t)))
    choice: Any = SimpleNamespace(winner=one, supported=(one,))
    assert clock_runs_slow(choice) is contradicted
    steady = SimpleNamespace(effects=effects, fitted=fitted(lambda t: 0.0 * t))
    assert not clock_runs_slow(SimpleNamespace(winner=steady, supported=(steady,)))
