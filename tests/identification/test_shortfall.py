"""What a fit says of what its model cannot do."""

from __future__ import annotations

import re

import numpy as np
import pytest
from rig import TRUE, backlash_run

from tsm_fmu.identification.fit import Fit, fit
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.specification import per_run_fields, search_space

MODEL = kernel("PairedTsmBacklash")
ZEROS = {"a": -1.2731, "b": -1.1837, "c": -1.2419, "d": -1.2077}
NOISE = 7e-4


def fitted(runs: list[FitRun], *, own_zeros: bool) -> Fit:
    per_run = per_run_fields(MODEL) if own_zeros else ()
    space = search_space(MODEL, None, {**TRUE, "x_0": -1.2}, per_run=per_run)
    return fit(MODEL, runs, ("x_out",), space, single_start=True)


def rig_runs(encoder: float = 0.0) -> list[FitRun]:
    return [
        backlash_run(name, 31 + k, x_0=zero, noise=NOISE, encoder=encoder)
        for k, (name, zero) in enumerate(ZEROS.items())
    ]


def test_zeros_that_move_are_said_with_their_size() -> None:
    found = fitted(rig_runs(), own_zeros=False)
    said = [f for f in found.findings if "a constant error of x_out of its own" in f]
    assert len(said) == 1
    scatter = np.degrees(np.std(list(ZEROS.values())))
    (rms,) = re.findall(r"([\d.]+) deg RMS over 4 runs", said[0])
    assert float(rms) == pytest.approx(scatter, rel=0.15)
    assert "tsm-fmu diagnose CARD" in found.findings[-1]


@pytest.mark.parametrize("encoder", [0.0, 2.0 * np.pi / 4000])
def test_nothing_is_said_of_a_model_that_is_right(encoder: float) -> None:
    found = fitted(rig_runs(encoder), own_zeros=True)
    assert not [f for f in found.findings if "diagnose" in f or "constant error" in f]


def test_law_that_the_model_lacks_is_said() -> None:
    runs = [FitRun(r.name, r.time, r.inputs, r.targets + 0.31 * r.inputs**3) for r in rig_runs()]
    found = fitted(runs, own_zeros=True)
    assert "x_out" in found.findings[-1]
    assert "tsm-fmu diagnose CARD" in found.findings[-1]
