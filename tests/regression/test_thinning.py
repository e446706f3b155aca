"""How many samples a long run keeps: counted by hand for motions whose strokes have a known number of samples."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.thinning import thinned

MODEL = kernel("PairedTsmBacklash")


def strokes(number: int, samples: int, middle: float = 0.0) -> FitRun:
    """Strokes of so many samples to and fro about a middle; sample k is k."""
    x = np.tile(np.repeat([0.4, -0.4], samples), number // 2) + middle
    rows = np.arange(x.size, dtype=float)
    return FitRun("run", rows, x[:, None], rows[:, None])


@pytest.mark.parametrize(
    ("samples", "kept_every"),
    [(10, 1), (49, 1), (50, 2), (74, 2), (75, 3), (1000, 40)],
)
def test_a_stroke_keeps_25_samples(samples: int, kept_every: int) -> None:
    for middle in (0.0, 7.3, -11.9):  # counted from the middle of the motion, not from 0
        run = strokes(8, samples, middle)
        (found,) = thinned(MODEL, [run], 1)
        assert found.time.tolist() == run.time[::kept_every].tolist()
        assert found.targets.tolist() == run.targets[::kept_every].tolist()
        assert found.inputs.tolist() == run.inputs[::kept_every].tolist()


def test_runs_together_keep_the_rows_asked_for_and_each_its_least() -> None:
    long, short = strokes(4, 1500), strokes(2, 500)  # 6000 and 1000 samples, 25 of a stroke allow 60 and 20
    steps = [round(float(one.time[1])) for one in thinned(MODEL, [long, short], 1000, shortest=300)]
    assert steps == [7, 3]  # 7000 // 1000 of all; 1000 // 300 of the short one
    assert [one.time.size for one in thinned(MODEL, [long, short], 7001)] == [6000, 1000]
    (alone,) = thinned(MODEL, [long], 1500)
    assert alone.time.size == 1500


def test_a_run_that_stands_still_has_one_stroke() -> None:
    run = FitRun("still", np.arange(400.0), np.full((400, 1), 0.3), np.zeros((400, 1)))
    (found,) = thinned(MODEL, [run], 10)
    assert found.time.size == 25
