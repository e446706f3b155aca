"""What a fit says of what its model cannot do."""

from __future__ import annotations

import re

import numpy as np
import pytest
from rig import TRUE, backlash_run

from tsm_fmu.identification.fit import Fit, fit
from tsm_fmu.identification.shortfall import shortfalls
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.agreement import Agreement
from tsm_fmu.regression.problem import FitRun
from tsm_fmu.regression.residuals import ResidualTests
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


def left(rmse: float, offset: float = 0.0, nrmse: float = 0.5, unit: str = "rad") -> Agreement:
    return Agreement(unit, rmse, 4.0 * rmse, offset, float(np.sqrt(abs(rmse**2 - offset**2))), nrmse, 100)


def told(one: Agreement, floor: float | None, watson: float = 1.9, offsets: tuple[float, ...] = ()) -> tuple[str, ...]:
    runs = [{"y": left(one.rmse, mean)} for mean in offsets]
    return shortfalls({"y": one}, runs, {} if floor is None else {"y": floor}, {"y": ResidualTests(1.0, watson, 1, 1)})


@pytest.mark.parametrize(
    ("rmse", "nrmse", "floor", "watson", "said"),
    [
        (0.03, 0.0121, 0.00999, 1.9, True),  # each limit alone, from either side
        (0.03, 0.0119, 0.00999, 1.9, False),
        (0.03, np.nan, 0.00999, 1.9, False),
        (0.03, np.inf, 0.00999, 1.9, True),
        (0.03, 0.0121, 0.01001, 0.0, False),
        (0.03, 0.0121, None, 0.199, True),
        (0.03, 0.0121, None, 0.201, False),
        (0.03, 0.0119, None, 0.199, False),
        (0.03, 0.0121, None, np.nan, False),
    ],
)
def test_a_law_is_missing_where_the_error_is_notable_and_repeats_or_is_slow(rmse, nrmse, floor, watson, said) -> None:
    sentences = told(left(rmse, nrmse=nrmse), floor, watson)
    assert len(sentences) == said
    if said:
        assert sentences[0].startswith("what is left is no noise, 1.72 deg of y (")
        assert sentences[0].endswith("'tsm-fmu diagnose CARD --measured RUN ...' looks for what is missing")


@pytest.mark.parametrize(
    ("floor", "words"),
    [
        (None, "(slow)"),
        (0.02 / 3.456, "(3.5 times what does not repeat itself)"),
        (0.02 / 990.0, "(9.9e+02 times what does not repeat itself)"),
        (0.02 / 1010.0, "(the same from period to period)"),
        (0.0, "(the same from period to period)"),
    ],
)
def test_how_sure_it_is_that_a_law_is_missing(floor: float | None, words: str) -> None:
    (sentence,) = told(left(0.02, unit="N"), floor, 0.1)
    assert f"no noise, 20 mN of y {words}: where" in sentence


@pytest.mark.parametrize(
    ("share", "runs", "said"), [(0.24, 3, False), (0.26, 3, True), (0.9, 2, False), (0.26, 7, True), (0.0, 3, False)]
)
def test_constants_of_runs_are_told_where_they_are_a_quarter_of_the_square(share, runs, said) -> None:
    rmse = 1.23456  # as a force, in its own unit
    one = left(rmse, rmse * share**0.5, unit="N")
    means = tuple(np.linspace(-0.71239, 1.56789, runs))
    sentences = told(one, 0.1, offsets=means)
    assert len(sentences) == 1 + said
    if said:
        assert sentences[0].startswith(
            f"each run has a constant error of y of its own, from -0.712 N to 1.57 N, {one.offset:.3g} N RMS over "
            f"{runs} runs, and {one.shape_rmse:.3g} N beside it: a zero that moves"
        )
    assert len(told(left(rmse, rmse * share**0.5, nrmse=0.01), 0.1, offsets=means)) == 0


def test_channels_are_judged_each_by_its_own_and_told_together() -> None:
    """Three channels of unlike size and unit: a torque that lacks a law, a right one, an angle whose zero moves."""
    measured = {"tau": left(0.0213, unit="N.m"), "F": left(3.0, unit="N"), "x": left(0.2, 0.15)}
    runs = [{"tau": left(0.02), "F": left(3.0), "x": left(0.2, mean)} for mean in (-0.2, 0.1, 0.15)]
    tests = {name: ResidualTests(1.0, watson, 1.0, 1.0) for name, watson in (("tau", 0.1), ("F", 0.1), ("x", 1.9))}
    constants, lacking = shortfalls(measured, runs, {"F": 1.1, "x": 0.01}, tests)
    assert constants.startswith("each run has a constant error of x of its own, from -11.5 deg to 8.59 deg, 8.59 deg")
    assert "no noise, 21.3 mN.m of tau (slow) and 11.5 deg of x (20 times what does not repeat itself):" in lacking
    assert shortfalls({}, [], {}, {}) == ()
