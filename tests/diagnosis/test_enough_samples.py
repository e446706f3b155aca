"""How many samples the search works on: more where the fit to few of them does not hold on all."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsm_fmu.diagnosis import investigation
from tsm_fmu.diagnosis.fits.refit import Task
from tsm_fmu.diagnosis.runs.thinning import thinned_for_search
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun

ROWS, DT = 40_000, 0.004


def long_run() -> FitRun:
    """One stroke of thousands of samples: how few do is not limited by them."""
    t = np.arange(ROWS) * DT
    x = 0.3 * np.sin(2.0 * np.pi * 0.017 * t)
    return FitRun("long", t, np.stack([x, np.ones(ROWS)], axis=1), x[:, None])


@pytest.mark.parametrize(("worse", "expected"), [((), 1), ((1,), 4), ((1, 4), 16)])
def test_the_search_takes_four_times_the_samples_until_a_fit_holds_on_all(
    worse: tuple[int, ...], expected: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, run = kernel("PairedTsmBacklash"), long_run()
    runs: Any = SimpleNamespace(model=model, measured=[run], channels=("x_out",))
    task = Task(model.name, thinned_for_search(model, [run], ("x_out",)), ("x_out",), {})
    tried: list[int] = []

    def fitted(_runs: Any, task: Any, _progress: Any, times: int) -> Any:
        tried.append(task.runs[0].time.size)
        left = np.array([0.0021 if times in worse else 0.00101])
        one = SimpleNamespace(rmse=np.array([0.001]), at=lambda _: SimpleNamespace(rmse=left))
        return [], SimpleNamespace(refitted=SimpleNamespace(fitted=one))

    monkeypatch.setattr(investigation, "_baselines", fitted)
    times, *_ = investigation._on_enough_samples(runs, task, lambda _: None)
    assert times == expected
    assert len(tried) == len(worse) + 1
    assert tried == sorted(set(tried))


def test_where_all_samples_are_there_a_fit_that_does_not_hold_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    model, run = kernel("PairedTsmBacklash"), long_run().only(np.arange(ROWS) < 900)
    runs: Any = SimpleNamespace(model=model, measured=[run], channels=("x_out",))
    one = SimpleNamespace(rmse=np.array([0.001]), at=lambda _: SimpleNamespace(rmse=np.array([0.7])))
    monkeypatch.setattr(
        investigation, "_baselines", lambda *_: ([], SimpleNamespace(refitted=SimpleNamespace(fitted=one)))
    )
    times, *_ = investigation._on_enough_samples(runs, Task(model.name, [run], ("x_out",), {}), lambda _: None)
    assert times == 1
